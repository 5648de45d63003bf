"""The runner process: robots, runs, Stop. Knows no CRDT."""
