"""The shared document: its layout, the graph that it holds, and what is derived from it."""
