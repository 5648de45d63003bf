"""The history of a graph: events of its two streams, edits of one person in one go as one entry."""

from collections.abc import Iterable, Iterator, Mapping
from datetime import datetime
from typing import Any, Final, Literal, TypeAlias

import msgspec
from msgspec.structs import replace
from sqlalchemy import Row, select

from action_assistant.editor.catalogue.people import People
from action_assistant.editor.catalogue.versions import Versions, VersionView
from action_assistant.editor.log import graph_events as h
from action_assistant.journal.journal import Journal
from action_assistant.schema import editor_tables
from action_assistant.web.auth.keys import PersonRef

_ONE_GO: Final = 5 * 60  # seconds between two edits of one entry
_CHANGES: Final = 10_000  # changes of the document that one answer looks at

Kind: TypeAlias = Literal[
    "created", "imported", "edited", "published", "restored", "adapted", "deleted", "recovered"
]


class TakenFrom(msgspec.Struct, frozen=True):
    """The document whose parameters were taken over, "" for a file, its change then, and the name of
    the action."""

    document: str
    seq: int
    action: str


#: The change that was gone back to, or of what parameters were taken over.
_Special: TypeAlias = int | TakenFrom


class HistoryEntry(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """Something that was done to a graph, between `at` and `until`.

    `seq` is the change of the document that `…/umrf?at=` and `…/restore` take to see the graph as it
    was after that edit; edits begin at `from_seq`. `restored` is the change that was gone back to,
    `adapted` that of which parameters were taken over.
    """

    kind: Kind
    author: PersonRef
    at: datetime
    until: datetime
    seq: int
    from_seq: int | None = None
    restored: int | None = None
    adapted: TakenFrom | None = None
    version: VersionView | None = None


class GraphHistory:
    """Tells the past of graphs."""

    def __init__(self, journal: Journal, people: People, versions: Versions) -> None:
        self._journal = journal
        self._people = people
        self._versions = versions

    async def of(self, graph: str, *, limit: int, before: int | None) -> list[HistoryEntry]:
        """Up to `limit` entries, newest first; with `before` only what was before that change."""
        rows = await self._rows(graph, before)
        versions = await self._versions.by_event(graph)
        special = await self._special(graph)
        found = list(_entries(reversed(rows), self._people, versions, special))
        return found[::-1][:limit]

    async def _rows(self, graph: str, before: int | None) -> list[Row[Any]]:
        event = editor_tables.editor_event.c
        document = h.graph_stream(graph)
        chosen = (
            select(event.seq, event.kind, event.author, event.at)
            .where(event.stream.in_([document, h.about_stream(graph)]))
            .order_by(event.position.desc())
            .limit(_CHANGES)
        )
        if before is not None:
            there = select(event.position).where(event.stream == document, event.seq == before)
            chosen = chosen.where(event.position < there.scalar_subquery())
        return await self._journal.query(chosen)

    async def _special(self, graph: str) -> dict[int, _Special]:
        """Changes that went back to others, or took over parameters, by their number."""
        event = editor_tables.editor_event.c
        chosen = select(event.kind, event.body).where(
            event.stream == h.about_stream(graph), event.kind.in_([h.RESTORED, h.ADAPTED])
        )
        found: dict[int, _Special] = {}
        for row in await self._journal.query(chosen):
            if row.kind == h.RESTORED:
                restored = msgspec.json.decode(row.body, type=h.GraphRestored)
                found[restored.seq] = restored.restored
            else:
                adapted = msgspec.json.decode(row.body, type=h.GraphAdapted)
                found[adapted.seq] = TakenFrom(adapted.source, adapted.at, adapted.name)
        return found


def _entries(
    rows: Iterable[Row[Any]],
    people: People,
    versions: Mapping[int, VersionView],
    special: Mapping[int, _Special],
) -> Iterator[HistoryEntry]:
    """Entries in order of time from events in order of time."""
    seq = 1
    last: HistoryEntry | None = None
    for row in rows:
        at = h.when(row.at)
        entry = HistoryEntry(
            kind="edited", author=people.person(row.author), at=at, until=at, seq=seq
        )
        match row.kind:
            case h.UPDATED | h.DEFERRED if row.seq == 1:
                continue  # what the graph was created with
            case h.UPDATED | h.DEFERRED:
                seq = row.seq
                if (how := special.get(seq)) is not None:
                    entry = _specially(replace(entry, seq=seq), how)
                elif last is not None and _same_go(last, entry):
                    last = replace(last, until=at, seq=seq)
                    continue
                else:
                    entry = replace(entry, seq=seq, from_seq=seq)
            case h.IMPORTED if last is not None:
                last = replace(last, kind="imported")
                continue
            case _:
                told = _of_the_whole(row, entry, versions)
                if told is None:
                    continue
                entry = told
        if last is not None:
            yield last
        last = entry
    if last is not None:
        yield last


def _specially(entry: HistoryEntry, how: _Special) -> HistoryEntry:
    if isinstance(how, TakenFrom):
        return replace(entry, kind="adapted", adapted=how)
    return replace(entry, kind="restored", restored=how)


def _of_the_whole(
    row: Row[Any], entry: HistoryEntry, versions: Mapping[int, VersionView]
) -> HistoryEntry | None:
    """The entry of an event about the graph as a whole; None for those that nobody is told."""
    match row.kind:
        case h.CREATED:
            return replace(entry, kind="created", seq=1)
        case h.PUBLISHED:
            version = versions[row.seq]
            return replace(entry, kind="published", seq=version.seq, version=version)
        case h.DELETED:
            return replace(entry, kind="deleted")
        case h.RECOVERED:
            return replace(entry, kind="recovered")
        case _:
            return None


def _same_go(last: HistoryEntry, entry: HistoryEntry) -> bool:
    return (
        last.kind == "edited"
        and last.author == entry.author
        and (entry.at - last.until).total_seconds() < _ONE_GO
    )
