"""Graphs, versions, people and invitations, as the tables and rooms know them."""
