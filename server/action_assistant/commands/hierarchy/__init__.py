"""Commands on files of graphs that have sub-graphs."""
