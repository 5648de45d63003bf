"""The shared document: its layout, what it means, what can be said of it."""
