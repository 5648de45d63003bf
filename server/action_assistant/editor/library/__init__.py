"""The library of actions."""
