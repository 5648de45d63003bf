"""Runs that are not over: the loop, the monitor, the service of all."""
