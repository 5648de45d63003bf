"""The folders whose files the engines of robots index, where the runner has them, too."""
