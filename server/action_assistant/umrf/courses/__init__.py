"""Courses that a graph can take, followed without simulating each of them completely."""
