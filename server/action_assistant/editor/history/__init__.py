"""What was done to a document, key by key: an index of its log, and what follows from it."""
