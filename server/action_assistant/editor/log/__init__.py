"""The editor's part of the log: kinds of events, epochs, and where the log is."""
