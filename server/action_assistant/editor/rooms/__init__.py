"""Rooms: the people at one document, and how edits enter."""
