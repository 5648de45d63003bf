"""Reads Yjs updates before they are applied, and refuses what a room or a page could not bear."""
