"""The people of a server, and the invitations by which they come in."""
