"""Several editors that share one database: each graph has one of them as its owner."""
