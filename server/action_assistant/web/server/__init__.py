"""How a process listens, what stands before it, and the application it serves."""
