"""Starts: reading, checking, looking at the robot, storing once."""
