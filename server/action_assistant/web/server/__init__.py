"""The sockets of a process, the proxy before it, and the application that it serves."""
