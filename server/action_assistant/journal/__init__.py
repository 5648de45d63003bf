"""The event log: streams of events, folded into tables that people query."""
