"""Links: how the runner reaches an engine."""
