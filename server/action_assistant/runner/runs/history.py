"""Reads runs from the journal: those that are over, and those that an earlier process left open."""

from collections.abc import Awaitable, Callable, Iterable, Sequence
from typing import Any, Protocol, TypeAlias

import msgspec
from sqlalchemy import Row, Select

from action_assistant.errors import NotFound
from action_assistant.journal.events import Event
from action_assistant.runner.runs import queries
from action_assistant.runner.runs.events import ModifyRequested, Requested, RunEvent, decode
from action_assistant.runner.runs.fold import replay
from action_assistant.runner.runs.recorder import Store, stream_of
from action_assistant.runner.runs.run import Run


class RunnerJournal(Store, Protocol):
    """The journal of the runner: streams of events, and queries of its tables."""

    async def query(self, statement: Select[Any]) -> list[Row[Any]]:
        """Return the rows of a SELECT on the tables. Raise Unavailable if the journal cannot be
        read."""
        ...


#: Reads a run that is over, and the seq of its last event. The flag asks for the run with all visits; without
#: it, only with those that people are shown. Raises NotFound.
Past: TypeAlias = Callable[[str, bool], Awaitable[tuple[Run, int]]]


class LeftRun(msgspec.Struct, frozen=True):
    """A stored run, the number (`seq`) of its last event, and whether all of its events could be
    read."""

    run: Run
    seq: int
    is_whole: bool


class RunHistory:
    """Reads runs. `past`: reads ended runs in a worker; without it they are folded in this process.
    Raises Unavailable while the journal cannot be read."""

    def __init__(self, journal: RunnerJournal, past: Past | None = None) -> None:
        self._journal = journal
        self._past = past

    async def followed(self, run: str) -> tuple[Run | None, int]:
        """Return a run with all its visits, so that it can be followed further, and the number
        (seq) of its last event; (None, 0) if there is no such run. Raise msgspec.DecodeError if a
        stored event is damaged."""
        if self._past is not None:
            return await self._past(run, True)
        return await self.replayed(run)

    async def replayed(self, run: str) -> tuple[Run | None, int]:
        """Fold a run in this process and return it with the number (seq) of its last event; (None,
        0) if there is no such run. Only for use before the runner accepts requests, since it
        blocks."""
        events = await self._journal.read(stream_of(run))
        found = replay(decode(each.kind, each.body) for each in events)
        return found, events[-1].seq if events else 0

    async def left(self, run: str) -> tuple[Run | None, int, bool]:
        """Return a run that an earlier process left open, the number (seq) of its last event, and
        whether all events could be read. Damaged events are skipped; the run is None if its first
        event is missing."""
        events = await self._journal.read(stream_of(run))
        read = [_decoded(each) for each in events]
        events_read = [event for event in read if event is not None]
        return replay(events_read), events[-1].seq if events else 0, len(events_read) == len(read)

    async def piece_ids(self, run: str, having: str = "") -> list[str]:
        """Return the ids of all stored pieces of a led run, in the order of their numbers.
        Numbers may be missing: a piece that could not be stored has used up its number. `having`:
        return only pieces with an event of this kind. Raise Unavailable if the journal cannot be
        read."""
        rows = await self._journal.query(queries.streams_of_pieces(run, having))
        return pieces_in(run, (row.stream.removeprefix(stream_of("")) for row in rows))

    async def pieces(self, run: str) -> tuple[list[LeftRun], list[str]]:
        """Return the pieces of a led run in the order of their numbers, and the ids of the
        pieces that cannot be read at all. Raise Unavailable if the journal cannot be read."""
        found: list[LeftRun] = []
        lacking: list[str] = []
        for id_ in await self.piece_ids(run):
            piece, seq, is_whole = await self.left(id_)
            if piece is None or piece.piece is None:
                lacking.append(id_)
            else:
                found.append(LeftRun(piece, seq, is_whole))
        return found, lacking

    async def run(self, run: str) -> Run:
        """Return a run as people are shown it. Raise NotFound if there is no such run."""
        if self._past is not None:
            return (await self._past(run, False))[0]
        found, _ = await self.replayed(run)
        if found is None:
            raise NotFound("There is no such run.")
        return found

    async def umrf(self, run: str) -> str:
        """Return the text of the graph as it was sent. Raise NotFound if there is no such run."""
        return (await self.requested(run)).umrf

    async def requested(self, run: str) -> Requested:
        """Return the first event of a run, its accepted start. Raise NotFound if there is no such
        run."""
        first = await self._journal.read(stream_of(run), limit=1)
        event = decode(first[0].kind, first[0].body) if first else None
        if not isinstance(event, Requested):
            raise NotFound("There is no such run.")
        return event

    async def events(self, run: str, after: int, limit: int) -> Sequence[Event]:
        """Return stored events of a run with `seq > after`, at most `limit`."""
        return await self._journal.read(stream_of(run), after=after, limit=limit)

    async def rows(self, statement: Select[Any]) -> list[Row[Any]]:
        """Return the rows of a SELECT on the tables. Raise Unavailable if the journal cannot be
        read."""
        return await self._journal.query(statement)


def pieces_in(run: str, ids: Iterable[str]) -> list[str]:
    """Return those of `ids` that belong to pieces of the led run `run`, each once, in the
    order of their numbers."""
    return sorted({each for each in ids if whole_of(each) == run}, key=piece_number)


def piece_number(piece: str) -> int:
    """Return the number of a piece in its led run, the first being 1. `piece`: its id."""
    return int(piece.rpartition(".")[2])


def whole_of(run: str) -> str:
    """Return the id of the led run of which this run is a piece, going by its id; "" if it is
    none."""
    whole, _, number = run.rpartition(".")
    return whole if number.isascii() and number.isdecimal() else ""


def _decoded(event: Event) -> RunEvent | None:
    try:
        return decode(event.kind, event.body)
    except msgspec.DecodeError:
        return None


async def newest_sent_text(store: Store, run: Run) -> str | None:
    """Return the text of the graph that a run has now: the one that was started, or the last change
    of it. Return None if no stored event has the text. Raise Unavailable if the journal (`store`)
    cannot be read."""
    stored = await store.read(stream_of(run.id))
    sent = {Requested.kind, ModifyRequested.kind}
    for each in reversed(stored):
        event = decode(each.kind, each.body) if each.kind in sent else None
        if isinstance(event, Requested | ModifyRequested) and event.digest == run.digest:
            return event.umrf
    return None
