"""The folders that the engines of robots index, where the runner can reach them."""
