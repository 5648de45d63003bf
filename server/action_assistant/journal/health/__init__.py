"""How a journal is doing: what its writer has done, and whether anything can be stored now."""
