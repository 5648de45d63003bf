"""Versions: what a graph was at one seq, published as UMRF that never changes again."""

import logging
from datetime import datetime
from typing import Any, Final

import anyio
import msgspec
from sqlalchemy import Connection, Row, Select, select

from action_assistant.editor.catalogue.graph_checks import HIDDEN_INSIDE, GraphChecks
from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.documents import contents
from action_assistant.editor.log import graph_events as h
from action_assistant.errors import (
    BadInput,
    Conflict,
    Forbidden,
    NotFound,
    Refused,
    TooLarge,
)
from action_assistant.journal.journal import Journal
from action_assistant.random_ids import random_id
from action_assistant.schema import editor_tables
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.files import codec
from action_assistant.umrf.json.text import UmrfGraph
from action_assistant.umrf.run_size import MOST_ACTIONS, MOST_INSIDE, excess
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.auth.released_versions import Release, ReleasedVersions

log: Final = logging.getLogger(__name__)

LABEL_LIMIT: Final = 200  # characters
NOTE_LIMIT: Final = 4_000  # characters


class PinnedGraph(msgspec.Struct, frozen=True):
    """A graph inside of a version, with its content at publication. `name`: of the actions that
    stand for it; `graph`: its id; `version`: its newest version with that content, null if none.
    `current_digest`: of the graph that has the name now, null if none has."""

    name: str
    version: str | None
    digest: str
    umrf: UmrfGraph
    graph: str
    current_digest: str | None


class InsideGraph(msgspec.Struct, frozen=True):
    """A graph inside of another one, with its present content. `name`: of the actions that stand
    for it; `graph`: its id."""

    name: str
    digest: str
    umrf: UmrfGraph
    graph: str


class InsideView(msgspec.Struct, frozen=True):
    """All graphs inside of a graph after its change `seq`, in their present state, by name;
    `digest`, `tree_digest`: those of a version that would be published now. `several`: names
    that several graphs have, of which the oldest counts; `cut`: more graphs are inside than
    listed."""

    seq: int
    digest: str
    tree_digest: str
    subgraphs: tuple[InsideGraph, ...]
    several: tuple[str, ...]
    cut: bool


class ReleaseView(msgspec.Struct, frozen=True):
    """The owner who released a version, and when."""

    by: PersonRef
    at: datetime


class VersionView(msgspec.Struct, frozen=True, omit_defaults=True):
    """A version. `umrf`: the graph as text, kept unchanged; `subgraphs`: all graphs inside, by
    name; lists omit both. `tree_digest`: of the graph together with them, null for old versions.
    `released`: by which owner it was released, null if it is not."""

    id: str
    graph: str
    label: str
    digest: str
    seq: int
    author: PersonRef
    at: datetime
    tree_digest: str | None
    umrf: UmrfGraph | None = None
    note: str = ""
    subgraphs: tuple[PinnedGraph, ...] | None = None
    released: ReleaseView | None = None


class Versions:
    """Publishes, releases and lists versions of graphs. Its methods raise Unavailable while the
    journal cannot be read or written."""

    def __init__(
        self,
        journal: Journal,
        graph_reader: GraphReader,
        checks: GraphChecks,
        released: ReleasedVersions,
    ) -> None:
        self._released = released
        self._releasing = anyio.Lock()
        self._journal = journal
        self._graph_reader = graph_reader
        self._checks = checks

    async def publish(
        self,
        graph: str,
        author: PersonRef,
        *,
        label: str = "",
        note: str = "",
        seq: int | None = None,
    ) -> tuple[VersionView, bool]:
        """Publish a version of a graph (its id) at its change `seq` (None: the newest), with the
        present state of the graphs inside pinned. Return it, and whether it is new. Without label
        and note, an equal version of that seq is returned instead of a new one. Raise NotFound for
        an unknown graph, Conflict for an unknown change, BadInput for a long label or note,
        TooLarge for a graph that could not be started."""
        label, note = _within_limits(label, note)
        sight = await self._graph_reader.moment(graph, seq)
        made = random_id()
        stamp = codec.Stamp(graph=graph, version=made, run=None)
        inside = await self._checks.inside(sight)
        found = await self._graph_reader.ask(contents.released, sight, stamp, inside)
        _require_runnable(found, inside)
        if not label and not note:
            for row in await self._rows(graph, sight.seq):
                if (row.tree_digest or row.digest) == found.tree_digest:
                    return await self.get(row.id), False
        published = h.VersionPublished(
            id=made,
            label=label,
            digest=found.digest,
            seq=sight.seq,
            author_name=author.name,
            umrf=msgspec.Raw(found.umrf),
            note=note,
            subgraphs=tuple([await self._pinned(part) for part in found.parts]),
            tree_digest=found.tree_digest,
        )
        await self._journal.append(
            h.about_stream(graph), [h.draft(h.PUBLISHED, author.id, published)]
        )
        return await self.get(made), True

    async def graphs_in(self, version: str) -> tuple[str, tuple[str, ...]]:
        """Return the digest of a version with all graphs inside, and the ids of its graph and of
        these. Raise NotFound for an unknown version."""
        row, published = await self._published(version)
        inside = (each.graph for each in published.subgraphs)
        return row.tree_digest or row.digest, tuple(dict.fromkeys((row.graph, *inside)))

    async def release(self, version: str, author: PersonRef) -> VersionView:
        """Release the version with the id `version` in the name of the owner `author`, whose role
        the caller has checked. For a released version, only write the file again that runners
        read.

        Raise NotFound if there is no such version, Conflict if its graph is a draft. Raise
        Unavailable if the release cannot be stored, or if the file cannot be written: then the
        version is released, and no runner knows of it yet."""
        async with self._releasing:
            row = await self._row(version)
            graph = editor_tables.graph.c
            named = select(graph.draft_of).where(graph.id == row.graph)
            if any(each.draft_of is not None for each in await self._journal.query(named)):
                raise Conflict(
                    "A version of a draft can never be released: merge the draft, and release a version "
                    "of its graph."
                )
            if row.released_at is None:
                body = h.VersionReleased(version, author.name)
                await self._journal.append(row.stream, [h.draft(h.RELEASED, author.id, body)])
                row = await self._row(version)
            await anyio.to_thread.run_sync(self._released.add, _release_of(row))
        return _view(row)

    async def withdraw(self, version: str, author: PersonRef) -> VersionView:
        """Withdraw the release of the version with this id, so that it no longer starts on robots
        that demand a release. Return the version; one that was not released stays as it is. Raise
        NotFound if there is no such version, Unavailable if the withdrawal cannot be stored."""
        async with self._releasing:
            row = await self._row(version)
            await anyio.to_thread.run_sync(self._released.remove, version)
            if row.released_at is not None:
                body = h.VersionReleased(version, author.name)
                withdrawn = h.draft(h.RELEASE_WITHDRAWN, author.id, body)
                await self._journal.append(row.stream, [withdrawn])
        return _view(await self._row(version))

    async def write_releases(self) -> None:
        """Make the files of released versions equal to the log, which may say more or less after a
        crash or a restored backup. A fault is logged: nothing more is released by it."""
        rows = await self._journal.query(
            select(editor_tables.version).where(editor_tables.version.c.released_at.is_not(None))
        )
        try:
            await anyio.to_thread.run_sync(self._released.make_equal, map(_release_of, rows))
        except Refused as refused:
            log.error("the released versions: %s", refused.detail)

    async def _row(self, version: str) -> Row[Any]:
        chosen = select(editor_tables.version).where(editor_tables.version.c.id == version)
        rows = await self._journal.query(chosen)
        if not rows:
            raise NotFound(f"There is no version {version!r}.")
        return rows[0]

    async def inside(self, graph: str, seq: int | None) -> InsideView:
        """Return the graphs that publishing a graph at its change `seq` (None: the newest) would
        include. Raise NotFound for an unknown graph, Conflict for an unknown change, Unavailable if
        the journal cannot be read."""
        sight = await self._graph_reader.moment(graph, seq)
        inside = await self._checks.inside(sight)
        stamp = codec.Stamp(graph=graph)
        found = await self._graph_reader.ask(contents.released, sight, stamp, inside)
        graphs = tuple(
            InsideGraph(each.name, each.digest, msgspec.Raw(each.umrf), each.graph)
            for each in found.parts
        )
        digests = found.digest, found.tree_digest
        return InsideView(sight.seq, *digests, graphs, inside.several, inside.cut)

    async def breakpoints(
        self, graph: str, seq: int | None, *, inside: bool = False
    ) -> list[Breakpoint]:
        """Return the breakpoints of a graph at its change `seq` (None: the newest), as a start names them;
        with `inside` also those of the graphs inside, of now. Raise as `inside` does."""
        sight = await self._graph_reader.moment(graph, seq)
        within = (await self._checks.inside(sight)).graphs if inside else ()
        own = await self._graph_reader.ask(contents.breakpoints, sight)
        return [*own, *[each for one in within for each in await self._inner(*one)]]

    async def breakpoints_of(self, version: str) -> list[Breakpoint]:
        """Return the breakpoints of the graph of a version at its moment, as a start names them, and those
        of the graphs that it has pinned, of now: also of deleted ones. Raise NotFound for an unknown
        version, Forbidden if the person may not see a graph inside."""
        row, published = await self._published(version)
        found = await self.breakpoints(row.graph, row.seq)
        for each in published.subgraphs:
            found += await self._inner(each.name, await self._graph_reader.now(each.graph))
        return found

    async def _inner(self, name: str, sight: contents.GraphAtSeq) -> list[Breakpoint]:
        own = await self._graph_reader.ask(contents.breakpoints, sight)
        return [msgspec.structs.replace(each, inside=name) for each in own]

    async def get(self, version: str) -> VersionView:
        """Return one version with its UMRF and its pinned sub-graphs. Raise NotFound if there is
        none with this id."""
        row, published = await self._published(version)
        subgraphs = tuple([await self._shown(each) for each in published.subgraphs])
        return msgspec.structs.replace(_view(row), umrf=published.umrf, subgraphs=subgraphs)

    async def _published(self, version: str) -> tuple[Row[Any], h.VersionPublished]:
        """Return the row of a version and its event. Raise NotFound if there is none with this id,
        Forbidden if the person may not see a graph inside."""
        row = await self._row(version)
        (event,) = await self._journal.read(row.stream, after=row.event_seq - 1, upto=row.event_seq)
        published = msgspec.json.decode(event.body, type=h.VersionPublished)
        if not all([await self._checks.caller_sees(each.graph) for each in published.subgraphs]):
            raise Forbidden(HIDDEN_INSIDE)
        return row, published

    async def of(self, graph: str) -> list[VersionView]:
        """Return the versions of a graph, newest first, without their UMRF."""
        return [_view(row) for row in await self._rows(graph)]

    async def _pinned(self, part: contents.ReleasedPart) -> h.PinnedSubgraph:
        version = editor_tables.version.c
        same = (version.graph == part.graph, version.digest == part.digest)
        newest = select(version.id).where(*same).order_by(version.event_seq.desc()).limit(1)
        found = await self._journal.query(newest)
        kept = found[0].id if found else None
        return h.PinnedSubgraph(part.name, kept, part.digest, msgspec.Raw(part.umrf), part.graph)

    async def _shown(self, pinned: h.PinnedSubgraph) -> PinnedGraph:
        fields = msgspec.structs.asdict(pinned)
        return PinnedGraph(**fields, current_digest=await self._checks.digest(pinned.name))

    async def _rows(self, graph: str, seq: int | None = None) -> list[Row[Any]]:
        chosen = _of_graph(graph)
        if seq is not None:
            chosen = chosen.where(editor_tables.version.c.seq == seq)
        return await self._journal.query(chosen)


def versions_by_event(connection: Connection, graph: str) -> dict[int, VersionView]:
    """Return the versions of a graph, by the seq of the event that published them. Call it in a
    worker process."""
    return {row.event_seq: _view(row) for row in connection.execute(_of_graph(graph))}


def _of_graph(graph: str) -> Select[Any]:
    version = editor_tables.version.c
    chosen = select(editor_tables.version).where(version.graph == graph)
    return chosen.order_by(version.event_seq.desc())


def _require_runnable(found: contents.Released, inside: contents.Inside) -> None:
    """Raise TooLarge if the runner would refuse to start the version for its size. `found`: the
    version; `inside`: the graphs inside."""
    if inside.cut:
        raise TooLarge(
            "Not published: more is inside of the graph than can be run. At most "
            f"{MOST_INSIDE} graphs are run inside of one, and {MOST_ACTIONS:,} actions together."
        )
    too_large = excess(found.size)
    if too_large is not None:
        raise TooLarge(f"Not published, since it could not be started: {too_large}")


def _within_limits(label: str, note: str) -> tuple[str, str]:
    """Return label and note without spaces around them. Raise BadInput for one that is too long."""
    label, note = " ".join(label.split()), note.strip()
    if len(label) > LABEL_LIMIT:
        raise BadInput(f"A label has up to {LABEL_LIMIT} characters.", where={"path": "/label"})
    if len(note) > NOTE_LIMIT:
        raise BadInput(f"A note has up to {NOTE_LIMIT} characters.", where={"path": "/note"})
    return label, note


def _view(row: Row[Any]) -> VersionView:
    return VersionView(
        id=row.id,
        graph=row.graph,
        label=row.label,
        digest=row.digest,
        seq=row.seq,
        author=PersonRef(row.author_id, row.author_name),
        at=h.when(row.at),
        tree_digest=row.tree_digest,
        note=row.note,
        released=None if row.released_at is None else _released_view(row),
    )


def _released_view(row: Row[Any]) -> ReleaseView:
    by = PersonRef(row.released_by, row.released_by_name or "")
    return ReleaseView(by, h.when(row.released_at))


def _release_of(row: Row[Any]) -> Release:
    """Return the release of a version, from its row in the table."""
    view, digest = _released_view(row), row.tree_digest or row.digest
    return Release(version=row.id, digest=digest, by=view.by, at=view.at)
