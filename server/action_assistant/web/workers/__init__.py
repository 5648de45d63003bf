"""Worker processes: lanes of them, and what one is from within."""
