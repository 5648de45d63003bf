"""Limits how deep shared types may lie in one another: deleting a deep chain recurses, and ends the process."""

from bisect import bisect_right, insort
from collections.abc import Mapping
from typing import Final, TypeAlias

import msgspec

from action_assistant.editor.crdt.messages import Malformed

DEEPEST_TYPES: Final = 32

#: Client, first clock, clock after the last.
Span: TypeAlias = tuple[int, int, int]


class Placed(msgspec.Struct, frozen=True):
    """A Yjs struct (an item, or a range of deleted ones) whose position is given by another struct,
    `client` and `clock`: `inside` of it, else beside it."""

    span: Span
    client: int
    clock: int
    inside: bool


class Nesting:
    """Tracks how deep the structs (items) of a Yjs document are nested. Only structs inside of
    others are stored; documents of our page have none."""

    def __init__(self, spans: dict[int, list[tuple[int, int, int]]] | None = None) -> None:
        #: Per client `(first clock, clock after the last, depth)`, in order.
        self.spans: Final = spans or {}

    def depths(self, placed: tuple[Placed, ...], known: Mapping[int, int]) -> dict[Span, int]:
        """Return how many types enclose each struct (item) that an update adds, by the struct's
        span (client, first clock, clock after the last); structs that no type encloses are missing.
        `placed`: the structs of the update whose position is given by another struct. `known`: per
        Yjs client, the first clock (number of an item) that the document does not have yet. Raise
        Malformed if a struct lies deeper than `DEEPEST_TYPES`."""
        if not placed or (not self.spans and not any(each.inside for each in placed)):
            return {}
        news = [each for each in placed if each.span[2] > known.get(each.span[0], 0)]
        found = self._resolved(news, known)
        if any(depth > DEEPEST_TYPES for depth in found.values()):
            raise Malformed("types nested too deeply")
        return {
            (client, max(start, known.get(client, 0)), end): depth
            for (client, start, end), depth in found.items()
            if depth
        }

    def learn(self, depths: Mapping[Span, int]) -> None:
        """Store the depths of the spans of an update that was applied to the document."""
        for (client, start, end), depth in depths.items():
            insort(self.spans.setdefault(client, []), (start, end, depth))

    def _resolved(self, placed: list[Placed], known: Mapping[int, int]) -> dict[Span, int]:
        """Return the depth of each struct in `placed`, without recursion: a struct waits for the
        one that gives its position. `known`: per Yjs client, the first clock that the document does
        not have yet. Raise Malformed if structs wait for each other in a circle."""
        by_client: dict[int, list[Placed]] = {}
        for each in placed:  # within a client they come in order
            by_client.setdefault(each.span[0], []).append(each)
        starts = {c: [each.span[1] for each in found] for c, found in by_client.items()}

        def below(client: int, clock: int) -> Placed | None:
            at = bisect_right(starts.get(client, []), clock) - 1
            found = by_client[client][at] if at >= 0 else None
            return found if found is not None and clock < found.span[2] else None

        depths: dict[Span, int] = {}
        for first in placed:
            path = [first]
            while path:
                each = path[-1]
                depth = self._depth(each.client, each.clock)
                if each.clock >= known.get(each.client, 0):
                    other = below(each.client, each.clock)
                    if other is not None and other.span not in depths:
                        if len(path) > len(placed):
                            raise Malformed("structs that stand on themselves")
                        path.append(other)
                        continue
                    depth = 0 if other is None else depths[other.span]
                client, start, _ = each.span
                if start < known.get(client, 0):  # the library goes on from what it has
                    depth = max(depth, self._depth(client, known[client] - 1) - each.inside)
                depths[each.span] = depth + each.inside
                path.pop()
        return depths

    def _depth(self, client: int, clock: int) -> int:
        spans = self.spans.get(client)
        if not spans:
            return 0
        at = bisect_right(spans, (clock, 1 << 64)) - 1
        return spans[at][2] if at >= 0 and clock < spans[at][1] else 0
