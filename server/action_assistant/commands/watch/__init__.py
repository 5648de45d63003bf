"""watch: what people change in a graph, as it comes."""
