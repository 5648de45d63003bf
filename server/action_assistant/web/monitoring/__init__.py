"""How a process tells others how it is: metrics, readiness, status."""
