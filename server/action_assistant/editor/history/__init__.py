"""The history of documents: an index of their changes key by key, and everything derived from it."""
