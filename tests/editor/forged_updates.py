"""Yjs updates that no client makes."""

from action_assistant.editor.crdt.messages import number, text


def entry(client: int, clock: int, key: str, value: str, *, root: str = "things") -> bytes:
    """An update that sets one key of a root map to a string, in the name of a client."""
    item = b"\x28\x01" + text(root.encode()) + text(key.encode())
    return (
        b"\x01\x01" + number(client) + number(clock) + item + b"\x01\x77" + text(value.encode()) + b"\x00"
    )  # fmt: skip


def nested_values(depth: int, client: int = 7) -> bytes:
    """One value of arrays in arrays."""
    value = b"\x75\x01" * depth + b"\x7e"
    return b"\x01\x01" + number(client) + b"\x00\x28\x01\x06things\x01k\x01" + value + b"\x00"


def nested_types(depth: int, client: int = 7, *, start: int = 0, below: int | None = None) -> bytes:
    """Maps in maps in maps; the first one in the item `below`, or else in a root."""
    made = b"\x01" + number(depth) + number(client) + number(start)
    for n in range(depth):
        parent = below if n == 0 else start + n - 1
        place = b"\x01\x06things" if parent is None else b"\x00" + number(client) + number(parent)
        made += b"\x27" + place + b"\x01k" + b"\x01"
    return made + b"\x00"
