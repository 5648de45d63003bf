"""Yjs updates: messages, what an update brings, replicas, loading from the log."""
