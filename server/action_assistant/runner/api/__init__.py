"""The routes of the runner."""
