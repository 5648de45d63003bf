"""The commands of the command line, by what they touch: processes, files, a running server."""
