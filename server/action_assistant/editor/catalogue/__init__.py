"""Graphs and their versions: listed, read, checked and changed."""
