"""sync: a folder of UMRF files and the graphs of a server, kept in step."""
