"""Queues of robots: starts that wait until it is their turn, and for a person."""
