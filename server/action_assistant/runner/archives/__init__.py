"""Runs in files: archives, retention, raw messages, shipped examples."""
