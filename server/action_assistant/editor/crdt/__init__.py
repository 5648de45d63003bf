"""Yjs documents: messages, reading and applying updates, replicas, loading from the log."""
