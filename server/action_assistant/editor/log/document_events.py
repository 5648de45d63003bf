"""The kinds of events in the stream of a graph's document, and when they happened."""

from datetime import UTC, datetime
from typing import Final

UPDATED: Final = "graph.updated.v1"  # the body is the Yjs update as it came
DEFERRED: Final = "graph.deferred.v1"  # one that waits for others, which come later in the log


def when(at: int) -> datetime:
    """Return the datetime, in UTC, of a time in microseconds since 1970."""
    return datetime.fromtimestamp(at / 1_000_000, UTC)
