"""Robots: their registration, the watch of their engines, and the log of what others told them."""
