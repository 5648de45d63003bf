"""The state of a process for operators: metrics, readiness, status."""
