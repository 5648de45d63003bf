"""Runs as the journal tells them: what is over, and what an earlier process left."""

from collections.abc import Awaitable, Callable, Sequence
from functools import partial
from typing import Any, Protocol, TypeVar

from sqlalchemy import Row, Select

from action_assistant.errors import NotFound
from action_assistant.journal.events import Event
from action_assistant.runner.events import ModifyRequested, Requested, decode
from action_assistant.runner.recorder import Store, stream_of
from action_assistant.runner.runs import Run, replay
from action_assistant.umrf import codec
from action_assistant.umrf.model import Graph

T = TypeVar("T")


class Ledger(Store, Protocol):
    """What the runner asks of its journal."""

    async def query(self, statement: Select[Any]) -> list[Row[Any]]:
        """Rows of the tables. Raises Unavailable."""
        ...


class Aside(Protocol):
    """A way to do work that takes long without holding up a Stop."""

    def __call__(self, work: Callable[[], T], /) -> Awaitable[T]:
        """The outcome of the work."""
        ...


class History:
    """Reads runs. Raises Unavailable while the journal cannot be read."""

    def __init__(self, ledger: Ledger, aside: Aside) -> None:
        self._ledger = ledger
        self._aside = aside

    async def replayed(self, run: str) -> tuple[Run | None, int]:
        """A run and the seq of its last event. Raises msgspec.DecodeError."""
        events = await self._ledger.read(stream_of(run))
        found = await self._aside(lambda: replay(decode(each.kind, each.body) for each in events))
        return found, events[-1].seq if events else 0

    async def run(self, run: str) -> Run:
        """A run. Raises NotFound."""
        found, _ = await self.replayed(run)
        if found is None:
            raise NotFound("There is no such run.")
        return found

    async def umrf(self, run: str) -> str:
        """The graph as it was sent. Raises NotFound."""
        first = await self._ledger.read(stream_of(run), limit=1)
        event = decode(first[0].kind, first[0].body) if first else None
        if not isinstance(event, Requested):
            raise NotFound("There is no such run.")
        return event.umrf

    async def events(self, run: str, after: int, limit: int) -> Sequence[Event]:
        """Stored events of a run with `seq > after`."""
        return await self._ledger.read(stream_of(run), after=after, limit=limit)

    async def rows(self, statement: Select[Any]) -> list[Row[Any]]:
        """Rows of the tables."""
        return await self._ledger.query(statement)


async def graph_of(store: Store, run: Run, aside: Aside) -> Graph | None:
    """The graph that a run has now: as it was sent, or changed since. None when it cannot be read.
    Raises Unavailable."""
    stored = await store.read(stream_of(run.id))
    sent = {Requested.kind, ModifyRequested.kind}
    for each in reversed(stored):
        event = decode(each.kind, each.body) if each.kind in sent else None
        if isinstance(event, Requested | ModifyRequested) and event.digest == run.digest:
            return await aside(partial(_read, event.umrf.encode()))
    return None


def _read(text: bytes) -> Graph | None:
    try:
        return codec.read(text).graph
    except codec.Unreadable:
        return None
