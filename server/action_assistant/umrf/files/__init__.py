"""UMRF files: reading of every dialect, and writing."""
