"""Links between the runner and engines."""
