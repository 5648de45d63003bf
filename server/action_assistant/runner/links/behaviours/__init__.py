"""Actions whose code is a Python file of the administrator's, each call in a process of its own."""
