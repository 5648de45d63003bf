"""Runs and raw messages in files: archives, retention, shipped examples."""
