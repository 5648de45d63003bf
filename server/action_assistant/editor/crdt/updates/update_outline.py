"""The outline of an update: the structs that it brings and builds on (rule R4)."""

from typing import Final

import msgspec

from action_assistant.editor.crdt.nesting import Placed

MOST_STRUCTS: Final = 200_000
MOST_CLIENTS: Final = 20_000
MOST_CLIENT: Final = 2**53 - 1  # beyond that a page cannot read the number, and fails
MOST_CLOCK: Final = 2**31 - 1


class PairedText(msgspec.Struct, frozen=True, array_like=True):
    """A text in which some characters take two clocks (surrogate pairs). It begins at the clock
    `start` (item number) of a Yjs client; `units`: the text as UTF-16."""

    client: int
    start: int
    units: bytes

    @property
    def end(self) -> int:
        """The clock (item number of the same Yjs client) of the item that comes right after the
        text."""
        return self.start + len(self.units) // 2

    def is_within(self, clock: int) -> bool:
        """Return whether this clock (item number) falls on the second half of a surrogate pair of
        the text."""
        return (
            self.start < clock < self.end and self.units[2 * (clock - self.start) + 1] >> 2 == 0x37
        )


class UpdateOutline(msgspec.Struct, frozen=True):
    """The outline (summary) of a Yjs update. A clock is the number of an item of a client.
    `brings`: its structs (items), as `(client, from clock, to clock)`. `needs`: the next clock of
    each client that a document must have before. `placed`: structs that may be nested. `fields`:
    keys that may be new; `actions`: how many of these are actions. `structs`: the number of
    structs. `paired`: texts with surrogate pairs, which must not be split."""

    brings: tuple[tuple[int, int, int], ...]
    needs: dict[int, int]
    placed: tuple[Placed, ...] = ()
    actions: int = 0
    fields: int = 0
    structs: int = 0
    paired: tuple[PairedText, ...] = ()

    def ready(self, known: dict[int, int]) -> bool:
        """Return whether a document has all that the update builds on. `known`: the next clock
        (item number) of each Yjs client in it."""
        ends: dict[int, int] = {}
        if len(self.brings) == 1:  # nearly always
            client, start, end = self.brings[0]
            if start > known.get(client, 0):
                return False
            ends[client] = end
        else:
            for client, start, end in self.brings:
                if start > max(known.get(client, 0), ends.get(client, 0)):
                    return False
                ends[client] = max(end, ends.get(client, 0))
        for client, clock in self.needs.items():
            if clock > known.get(client, 0) and clock > ends.get(client, 0):
                return False
        return True
