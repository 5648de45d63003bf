"""The editor process: documents, rooms, versions, the page."""
