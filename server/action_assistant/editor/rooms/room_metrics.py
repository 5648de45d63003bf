"""What rooms count, for everybody who watches the editor: little, since it is done for each edit."""

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Final

from prometheus_client import Metric
from prometheus_client.registry import Collector

from action_assistant.editor.rooms.batch import Objection, Offer
from action_assistant.journal.health.thread_histogram import ThreadHistogram

_BUCKETS: Final = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30)


class RoomMetrics(Collector):
    """Of all rooms of a process. Only the loop counts."""

    def __init__(self) -> None:
        self.opened = 0
        self.unloaded = 0
        self.refused: Final[Counter[str]] = Counter()  # edits, by why
        self.closed: Final[Counter[int]] = Counter()  # sockets, by close code
        self._acks = ThreadHistogram(
            "action_assistant_ack_seconds",
            "Time from an edit's arrival at its room until it was durable and acknowledged.",
            _BUCKETS,
        )

    def acknowledged(self, offers: Sequence[Offer]) -> None:
        """Edits are durable, or have brought nothing."""
        now = time.perf_counter()
        self._acks.observe([now - offer.at for offer in offers])

    def objected(self, error: Objection) -> None:
        """An edit was refused."""
        self.refused[_name(error)] += 1

    def collect(self) -> Iterator[Metric]:
        """As a registry asks."""
        yield from self._acks.collect()


def _name(error: Objection) -> str:
    """Of a reason, as labels are written."""
    name = type(error).__name__
    return "".join(f"_{c.lower()}" if c.isupper() else c for c in name).lstrip("_")
