"""Sub-graphs: made of actions, unpacked, downloaded and flattened."""
