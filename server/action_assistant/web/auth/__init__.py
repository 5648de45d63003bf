"""Access control: keys, sessions, roles, revocations."""
