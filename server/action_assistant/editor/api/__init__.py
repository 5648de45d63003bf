"""The routes of the editor."""
