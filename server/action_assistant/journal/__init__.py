"""The append-only log of what happened, and the tables folded from it."""
