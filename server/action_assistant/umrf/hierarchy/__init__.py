"""Hierarchical tasks: graphs with sub-graphs, flattened, extracted and unpacked (docs/umrf.md,
Flattening)."""
