"""Robots: their engines as watched, registrations, what others told them."""
