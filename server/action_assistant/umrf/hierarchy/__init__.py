"""Hierarchical tasks: graphs with sub-graphs, made into one (docs/umrf.md, Flattening)."""
