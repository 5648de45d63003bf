"""UMRF files of every dialect, read and written."""
