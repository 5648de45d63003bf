"""Links to engines: one port, several ways to reach a robot."""
