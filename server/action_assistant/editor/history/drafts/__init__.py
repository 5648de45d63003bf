"""Drafts: graphs that are worked on apart from another one, compared with it, and merged."""
