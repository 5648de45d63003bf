"""Action packages: the C++ sources of an action, as the engine loads it
(docs/umrf-and-the-engine.md 5)."""
