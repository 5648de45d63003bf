"""Who may call: keys, sessions, roles, revocations."""
