"""Limits the time that a document takes to be opened. It is measured, since it does not follow from the size.

The CRDT library looks for the place of what was written at the same time as other things through all of
those. Updates that are harmless one by one can so become a document that holds the event loop up
whenever it is opened. Work beyond what is linear is at most that of each struct with each other one;
where so much could have come since the last measurement that it matters, it is measured again.
"""

import math
from typing import Final

from action_assistant.editor.crdt.document_quota import QuotaExceeded
from action_assistant.editor.crdt.updates.update_outline import UpdateOutline

#: Seconds of a processor that opening a document may take, beside what its size needs: an honest
#: graph takes 0.07 s per MiB.
SECONDS: Final = 0.25
_PER_MIB: Final = 0.2
_MOST: Final = 2.0
#: Seconds that may be added without being measured, beside what opening took; or half of what is left.
_SPARE: Final = 0.1
_EARLY: Final = 0.4  # of that, from which on it is measured while there is time
_STEP: Final = 75e-9  # seconds from one struct to the next
_STORED: Final = 12  # bytes of a struct in a document; few are smaller
_LEAST: Final = 4  # bytes of one that may stand beside others
_SMALLEST: Final = 6  # bytes of a struct in an update


class OpeningTime:
    """Bounds the time that opening a document takes, by the last measurement and an estimate for
    what was added since."""

    def __init__(self) -> None:
        self._came = 0  # structs that were ever added
        self._came_then = 0  # of these, when it was measured last
        self._measured_at = 0.0  # structs that there were then
        self._seconds = 0.0
        self._limit = SECONDS
        self._bound()

    @property
    def came(self) -> int:
        """The number of structs ever added, which also dates a measurement."""
        return self._came

    def opened(self, seconds: float, size: int, came: int | None = None) -> None:
        """Store a measurement: a document of `size` bytes was applied to an empty replica in
        `seconds`. `came`: the number of structs that the document had received at that time; None
        means now. A measurement older than the newest one is ignored."""
        then = self._came if came is None else came
        if then < self._came_then:
            return
        counted = self._measured_at + then - self._came_then
        # Overwritten structs are merged, so a document may have fewer than were ever added.
        self._measured_at = min(max(counted, size / _STORED), size / _LEAST)
        self._came_then, self._seconds = then, seconds
        self._limit = min(_MOST, SECONDS + _PER_MIB * size / (1 << 20))
        self._bound()

    def took(self, structs: int) -> None:
        """Count `structs` new structs (items) that the document has received."""
        self._came += structs

    def is_doubtful_with(self, size: int) -> bool:
        """Return whether the opening time has to be measured before updates of `size` bytes are applied."""
        return self._came + size / _SMALLEST > self._doubtful_from

    @property
    def is_due(self) -> bool:
        """Return whether a new measurement should start now, early enough that no edit waits for
        it."""
        return self._came > self._due_from

    def _bound(self) -> None:
        """Compute the numbers of added structs from which a measurement is due, and from which the
        time is in doubt."""
        spare = max(_SPARE + self._seconds, (self._limit - self._seconds) / 2)
        self._due_from = self._after(spare * _EARLY)
        self._doubtful_from = -1.0 if self.is_too_long else self._after(spare)

    def _after(self, seconds: float) -> float:
        """Return the number of structs ever added at which opening may take `seconds` longer than when it was
        measured."""
        structs = math.sqrt(self._measured_at**2 + 4 * seconds / _STEP)
        return structs - self._measured_at + self._came_then

    def refuse(self, read: UpdateOutline) -> None:
        """Raise QuotaExceeded for an update (`read`: its outline) that adds content to a document
        that takes too long to open."""
        if self.is_too_long and read.brings:
            said = f"a graph may take {self._limit:.1f} s to open; go on with a copy of it"
            raise QuotaExceeded(said)

    @property
    def is_too_long(self) -> bool:
        """Return whether the last measured opening time exceeds the limit."""
        return self._seconds > self._limit
