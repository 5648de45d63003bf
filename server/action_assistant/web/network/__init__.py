"""Connections and addresses: how many there may be, and under which names."""
