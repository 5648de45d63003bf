"""The single checks of a graph."""
