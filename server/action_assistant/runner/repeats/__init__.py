"""Repeats: one start, carried out again and again, or with each of several values."""
