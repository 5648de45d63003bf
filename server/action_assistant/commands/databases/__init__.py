"""Commands about the databases themselves: which version their tables are of, and where they are."""
