"""The robot emulator: an engine node without an engine."""
