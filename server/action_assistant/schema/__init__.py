"""The tables of both databases, as the scripts in `migrations/` make them."""
