"""The store of runs: a run in an archive is read as if it were in the journal."""

from collections.abc import Callable, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, Final, Protocol

import msgspec
from sqlalchemy import Row, Select, select

from action_assistant.errors import Refused
from action_assistant.journal.chain import Head
from action_assistant.journal.events import (
    Addition,
    BareEvent,
    Draft,
    Event,
    StreamSnapshot,
    bare,
)
from action_assistant.journal.removal import StreamRemoved
from action_assistant.kit.lru_cache import LruCache
from action_assistant.runner.analysis import annotations
from action_assistant.runner.analysis.keyframes import SnapshotJournal
from action_assistant.runner.archives import archive_file
from action_assistant.runner.runs import queries, views
from action_assistant.runner.runs.history import pieces_in, whole_of
from action_assistant.schema.runner_tables import run
from action_assistant.web.workers.lanes import RunInWorker

_PREFIX: Final = "run/"
_CACHED: Final = 64 << 20  # bytes of archived events in memory
_RUNS: Final = 1_000  # archived runs in memory


class Archived(Refused):
    """The run was archived, and its archive file is not in the folder of archives."""

    title = "The run is in an archive that is not here"
    status = 410


class Journaled(SnapshotJournal, Protocol):
    """The journal with the operations that retention needs."""

    async def end(self, stream: str) -> Head:
        """Return the end of a stream: the seq of its last event, and its chain of hashes."""
        ...

    async def take_out(
        self,
        removed: StreamRemoved,
        also: Callable[[int], Addition],
        *,
        parts: Sequence[StreamRemoved] = (),
    ) -> int:
        """Record that the events of a stream are in an archive from now on, and return the number
        of that record. `parts`: streams that go with it, whose numbers follow. `also` makes events
        to store with it from that number. Raise Conflict if a stream has another end than stated,
        Unavailable if the journal cannot be written."""
        ...

    async def delete_some(self, stream: str, by: int) -> bool:
        """Delete some events of a stream that was taken out; return whether any events are left.
        `by`: the number of the record of that."""
        ...


class ArchiveStore:
    """Reads archived runs from their files in `folder`. All other calls go to the journal, and have
    its parameters and errors."""

    def __init__(self, journal: SnapshotJournal, folder: Path, run_in_worker: RunInWorker) -> None:
        self.folder = folder
        self._journal = journal
        self._run_in_worker = run_in_worker
        self._cache: LruCache[str, list[Event]] = LruCache(_RUNS, weight=_CACHED)

    async def append(
        self, stream: str, drafts: Sequence[Draft], *, expected: int | None = None
    ) -> int:
        """Append events to a stream of the journal, as `Journal.append` does."""
        return await self._journal.append(stream, drafts, expected=expected)

    async def newest(self, stream: str) -> int:
        """Return the seq of the last event of a stream, also of an archived one; 0 if the stream is
        empty."""
        return await self._journal.newest(stream)

    async def query(self, statement: Select[Any]) -> list[Row[Any]]:
        """Return the rows of a SELECT on the tables. Raise Unavailable if the journal cannot be
        read."""
        return await self._journal.query(statement)

    async def snapshot(self, stream: str) -> StreamSnapshot | None:
        """Return the stored keyframes of a stream; None for an archived run, whose keyframes were
        deleted with its events."""
        return None if await self.place(stream) else await self._journal.snapshot(stream)

    async def keep_snapshot(self, stream: str, seq: int, state: bytes) -> None:
        """Store keyframes of a stream (`state`) as of event number `seq`; does nothing for an
        archived run."""
        if await self.place(stream) is None:
            await self._journal.keep_snapshot(stream, seq, state)

    async def read(
        self, stream: str, *, after: int = 0, upto: int | None = None, limit: int | None = None
    ) -> list[Event]:
        """Return the events of a stream with `after` < seq ≤ `upto`, in order, at most `limit`;
        None for `upto` or `limit` sets no bound. Raise Archived if its archive file is missing,
        Damaged if it is damaged."""
        place = await self.place(stream)
        if place is None:
            return await self._journal.read(stream, after=after, upto=upto, limit=limit)
        events = await self._events(stream, place)
        last = len(events) if upto is None else min(upto, len(events))
        return list(islice(events, after, last if limit is None else min(last, after + limit)))

    async def bare(self, stream: str, usual: str, *, after: int, upto: int) -> list[BareEvent]:
        """Return the events of a stream as `read` does, but as (body, kind, at); the kind is None
        for events of the kind `usual`."""
        if await self.place(stream) is None:
            return await self._journal.bare(stream, usual, after=after, upto=upto)
        return bare(await self.read(stream, after=after, upto=upto), usual)

    async def place(self, stream: str) -> views.ArchivePlace | None:
        """Return the archive of a stream, if that is of an archived run or of a piece of one; None
        if its events are in the journal."""
        if not stream.startswith(_PREFIX):
            return None
        id_ = stream.removeprefix(_PREFIX)
        whole = whole_of(id_)
        wanted = select(run.c.number, run.c.archived_at, run.c.archived_as).where(
            run.c.id == (whole or id_), run.c.archived_at.is_not(None)
        )
        rows = await self._journal.query(wanted)
        if not rows:
            return None
        place = views.ArchivePlace(rows[0].number, rows[0].archived_at, rows[0].archived_as)
        if not whole:
            return place
        pieces = await self._archived_pieces(whole)  # an older version left them in the journal
        return msgspec.structs.replace(place, archived_as=pieces[id_]) if id_ in pieces else None

    async def pieces(self, run_id: str) -> list[str]:
        """Return the ids of the pieces of a led run, also of an archived one, in the order in
        which they were sent. Raise Unavailable if the journal cannot be read."""
        rows = await self._journal.query(queries.streams_of_pieces(run_id))
        here = (row.stream.removeprefix(_PREFIX) for row in rows)
        return pieces_in(run_id, (*here, *await self._archived_pieces(run_id)))

    async def _archived_pieces(self, run_id: str) -> dict[str, str]:
        """Return the archives of the pieces of a run: their files by id."""
        about = await self._journal.read(annotations.stream_about(run_id))
        put = [each.body for each in about if each.kind == annotations.RunArchived.kind]
        if not put:
            return {}
        archived = msgspec.json.decode(put[-1], type=annotations.RunArchived)
        return {each.run: each.file for each in archived.pieces}

    async def _events(self, stream: str, place: views.ArchivePlace) -> list[Event]:
        if (known := self._cache.get(stream)) is not None:
            return known
        path = self.folder / place.archived_as
        try:
            events = await self._run_in_worker(lambda: list(archive_file.read(path)))
        except OSError as error:
            raise Archived(
                f"Run {place.number} was archived on {views.time(place.archived_at):%Y-%m-%d} "
                f"as {place.archived_as}, which is not in {self.folder} ({error.strerror}). "
                "`action-assistant runs restore FILE` puts it back."
            ) from error
        if not events or events[0].stream != stream:
            raise archive_file.Damaged(f"{place.archived_as} holds another run.")
        return self._cache.put(stream, events, sum(len(each.body) + 200 for each in events))
