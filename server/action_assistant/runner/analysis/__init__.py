"""Conclusions from the events of a run: replay, causes, comparison, sums, files."""
