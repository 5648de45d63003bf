"""Runs: their events, the fold of these, views and queries."""
