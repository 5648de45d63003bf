"""Makes, imports, lists, renames, deletes and recovers graphs, and makes the documents of library actions."""

import asyncio
from collections.abc import Awaitable, Callable, Collection, Sequence
from datetime import datetime
from typing import Any, Final

import msgspec
from sqlalchemy import Row, Select, bindparam, func, select

from action_assistant.editor.catalogue import server_edits
from action_assistant.editor.catalogue.graph_checks import GraphChecks, GraphSummary
from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.documents.contents import Counts, GraphInfo, info_of
from action_assistant.editor.interchange import document_edits, importing
from action_assistant.editor.interchange.document_edits import drafted
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import BadInput, NotFound, Refused
from action_assistant.journal.events import Addition, Draft
from action_assistant.journal.journal import Journal
from action_assistant.random_ids import random_id
from action_assistant.schema import editor_tables
from action_assistant.umrf.check import check
from action_assistant.umrf.model import Action, Graph, Key
from action_assistant.web.auth.graph_rules import Rule
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.http.plain_texts import require_plain
from action_assistant.web.workers.lanes import RunInWorker, run_here

NAME_LIMIT: Final = 200  # characters
DESCRIPTION_LIMIT: Final = 10_000
_AT_ONCE: Final = 50  # graphs of a list between two turns of others
READ_FOR_A_LIST: Final = 200  # documents that a list waits for
_LARGE_FILE: Final = 256 * 1024  # bytes of an imported file that is stored in a commit of its own


class DraftOf(msgspec.Struct, frozen=True):
    """The origin of a draft: the graph and the change that the draft began with; and the name of
    the draft."""

    graph: str
    seq: int
    name: str


class RefusedUse(msgspec.Struct, frozen=True):
    """A graph of which an edit failed, and why."""

    graph: str
    why: str


class CalledUses(msgspec.Struct, frozen=True, omit_defaults=True):
    """The graphs in which actions were renamed, each by one edit; and those in which that failed
    after others were changed."""

    changed: tuple[str, ...]
    refused: tuple[RefusedUse, ...] = ()


class GraphView(msgspec.Struct, frozen=True, omit_defaults=True):
    """A graph, or an action of the library, as lists and pages show it. `seq` counts the changes of
    its document.

    `damaged`: the first change that cannot be read; the graph stays in the state before it, and
    cannot be changed. `people`: who is in it now. `problems`: counts of the check; `wrong` and
    `to_fill_in`: counts for people, in which related problems count once. `drafts`: the number of
    its drafts. `folder`: the id of the folder in which it lies. `restricted`: not everybody may see
    or edit it. `thumbnail`: the digest of its thumbnail, which `GET /api/graphs/thumbnails` gives.
    """

    id: str
    name: str
    description: str
    seq: int
    updated_at: datetime
    made_at: datetime
    actions: int | None = None
    problems: Counts | None = None
    wrong: int | None = None
    to_fill_in: int | None = None
    robots: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()
    people: tuple[PersonRef, ...] = ()
    deleted_at: datetime | None = None
    damaged: int | None = None
    kind: h.DocumentKind = "graph"
    draft_of: DraftOf | None = None
    drafts: int = 0
    folder: str | None = None
    restricted: bool = False
    thumbnail: str | None = None


class NewGraph(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The body of a request for an empty graph."""

    name: str
    description: str = ""


class Catalogue:
    """Lists, makes, changes and deletes graphs and actions of the library. Its methods raise
    NotFound for an id that is unknown or deleted, Unavailable while the journal cannot be used.
    `author`: the id of the person for whom it acts."""

    def __init__(
        self,
        journal: Journal,
        rooms: Rooms,
        graph_reader: GraphReader,
        checks: GraphChecks,
        run_in_worker: RunInWorker = run_here,
        on_made: Callable[[], Awaitable[None]] | None = None,
    ) -> None:
        self._on_made = on_made or _do_nothing
        self._journal = journal
        self._run_in_worker = run_in_worker
        self._checks = checks
        self._rooms = rooms
        self._graph_reader = graph_reader

    async def require(self, graph: str, kind: h.DocumentKind | None = None) -> h.DocumentKind:
        """Check that a document exists and is not deleted, and return its kind. `graph`: its id.
        Raise NotFound if there is no such document, or if it is not of the kind `kind` (None: of
        any)."""
        found: h.DocumentKind = _there(
            graph, await self._journal.query(_KIND, {"id": graph}), kind
        ).kind
        return found

    async def get(self, graph: str) -> GraphView:
        """Return one graph as lists show it. Raise NotFound if no graph has this id."""
        await self._checks.names.refresh()
        return await self._view(await self._row(graph))

    async def all(
        self, *, deleted: bool = False, kind: h.DocumentKind = "graph"
    ) -> list[GraphView]:
        """Return all documents of a kind, the last changed first: without deleted ones and drafts
        or, with `deleted`, only deleted ones. Facts that need the documents of many graphs are None,
        and are computed for a later call."""
        graph = editor_tables.graph.c
        shown = [graph.deleted_at.is_(None), graph.draft_of.is_(None)]
        chosen = _rows().where(
            graph.kind == kind, *([graph.deleted_at.is_not(None)] if deleted else shown)
        )
        rows = await self._journal.query(chosen)
        if self._checks.names.are_read or len(rows) <= READ_FOR_A_LIST:
            await self._checks.names.refresh()
        has_names = self._checks.names.are_read
        may_read = READ_FOR_A_LIST if has_names else 0
        views: list[GraphView] = []
        later: dict[str, int] = {}
        for start in range(0, len(rows), _AT_ONCE):
            some = rows[start : start + _AT_ONCE]
            await self._checks.facts.recall([row.id for row in some])
            for row in some:
                if has_names and self._checks.is_known(row.id, row.seq):
                    views.append(await self._view(row))
                elif may_read:
                    may_read -= 1
                    views.append(await self._view(row))
                else:
                    later[row.id] = row.seq
                    summary = self._checks.known_summary(row.id, row.seq)
                    views.append(self._shown(row, summary))
            await asyncio.sleep(0)  # edits of others come first
        self._checks.compute_later(later)
        return sorted(views, key=lambda view: view.updated_at, reverse=True)

    async def some(self, graphs: Sequence[str], *, exact: bool = True) -> list[GraphView]:
        """Return the graphs with these ids as lists show them, in their order, without those that
        are gone. There must be few, since facts about them that are not known are computed first.
        Without `exact` no document is read, and problems are those that were counted last; what is
        not known is computed for a later call."""
        rows = {row.id: row for row in await self._journal.query(_some(graphs))}
        await self._checks.facts.recall(rows)
        found = [rows[graph] for graph in graphs if graph in rows]
        if exact:
            return [await self._view(row) for row in found]
        later = {row.id: row.seq for row in found if not self._checks.is_known(row.id, row.seq)}
        self._checks.compute_later(later)
        return [self._shown(row, self._checks.last_summary(row.id, row.seq)) for row in found]

    async def create(
        self,
        body: bytes,
        author: str,
        *,
        folder: str | None = None,
        rule: Rule | None = None,
    ) -> tuple[GraphView, bytes | None]:
        """Make a graph in the folder with this id, if any, with its own `rule`, if any. `body` is either an object with a name
        and a description, for an empty graph, or a UMRF file. Return the graph, and the JSON of an
        `ImportReport` if a file was read, else None. Raise BadInput, NotUmrf or TooLarge, with the
        place in the file, if the file cannot be read; then nothing is stored."""
        try:
            wanted = msgspec.json.decode(body, type=NewGraph)
        except (msgspec.DecodeError, RecursionError, UnicodeDecodeError):
            return await self.bring(body, author, folder=folder, rule=rule)
        require_plain(body)
        name, description = fit(wanted.name, wanted.description)
        graph = Graph(name=name, description=description, direction="right")
        made = h.draft(h.CREATED, author, h.GraphCreated(name, description))
        about = info_of(graph, check(graph))
        drafts = [made, *_placed(folder, rule, author)]
        return await self._add(document_edits.first(graph), about, drafts, author), None

    async def bring(
        self,
        body: bytes,
        author: str,
        *,
        keys: tuple[Key, ...] = (),
        folder: str | None = None,
        rule: Rule | None = None,
        run_in_worker: RunInWorker | None = None,
    ) -> tuple[GraphView, bytes]:
        """Make a graph from a UMRF file (`body`), which the log stores unchanged, in the folder
        with this id, if any, with its own `rule`, if any. `keys`: the keys of its actions in order; without them actions get new
        ones. Return the graph and the JSON of an `ImportReport`. Raise BadInput, NotUmrf or
        TooLarge if the file cannot be read."""
        found = await (run_in_worker or self._run_in_worker)(importing.imported, body, keys)
        about = found.about
        made = h.draft(
            h.CREATED,
            author,
            h.GraphCreated(about.name, about.description, found.dialect, found.notes),
        )
        file = Draft(h.IMPORTED, author, body)
        drafts = [made, *_placed(folder, rule, author)]
        return await self._add(found.update, about, drafts, author, file), found.reading

    async def folder_of(self, graph: str) -> str | None:
        """Return the id of the folder in which a graph lies, None for no folder. A draft lies where
        its graph does."""
        row = await self._row(graph)
        if row.draft_of is not None:
            row = await self._row(row.draft_of, deleted=True)
        folder: str | None = row.folder
        return folder

    async def describe(
        self, graph: str, author: str, *, name: str | None, description: str | None
    ) -> GraphView:
        """Give a graph another name or description (None: keep it) by an edit of its document;
        return it as lists show it."""
        row = await self._row(graph)
        new_name, new_description = fit(
            row.name if name is None else name,
            row.description if description is None else description,
        )
        async with self._rooms.reach(h.graph_stream(graph)) as room:
            await server_edits.rename(
                room,
                author,
                kind=row.kind,
                name=None if name is None else new_name,
                description=None if description is None else new_description,
                run_in_worker=self._run_in_worker,
            )
            return await self.get(graph)

    async def call_uses(
        self, graphs: Collection[str], before: str, name: str, author: str
    ) -> CalledUses:
        """Rename the actions called `before` in the graphs with these ids to `name`, by one edit
        for each graph, after the graph that they stand for was renamed. Raise NotFound, before
        anything is written, if a graph does not exist, and the errors of an edit while no graph is
        changed."""
        new_name, _ = fit(name, "")
        for graph in graphs:
            await self.require(graph, "graph")
        changed: list[str] = []
        refused: list[RefusedUse] = []
        for graph in dict.fromkeys(graphs):
            try:
                async with self._rooms.reach(h.graph_stream(graph)) as room:
                    if await server_edits.call_actions(
                        room, author, before, new_name, run_in_worker=self._run_in_worker
                    ):
                        changed.append(graph)
            except Refused as error:
                if not changed:
                    raise
                refused.append(RefusedUse(graph, error.detail))
        return CalledUses(tuple(changed), tuple(refused))

    async def delete(self, graph: str, author: str) -> None:
        """Mark a graph as deleted, and close the sockets of all who have it open."""
        await self._row(graph)
        stream = h.graph_stream(graph)
        self._rooms.check_existence(stream)  # also where it is never known whether this was stored
        await self._journal.append(h.about_stream(graph), [h.draft(h.DELETED, author)])
        self._rooms.expel(stream)

    async def recover(self, graph: str, author: str) -> GraphView:
        """Undelete a graph, and return it; does nothing to one that is not deleted."""
        row = await self._row(graph, deleted=True)
        if row.deleted_at is not None:
            try:
                await self._journal.append(h.about_stream(graph), [h.draft(h.RECOVERED, author)])
            finally:  # if it is unknown whether this was stored, the tables show it
                self._rooms.readmit(h.graph_stream(graph))
        return await self.get(graph)

    async def add_action(
        self, action: Action, author: str, about: h.GraphCreated, file: bytes | None = None
    ) -> GraphView:
        """Make the document of an action of the library, and return it as lists show it. `about`:
        the event that records this; `file`: the file from which the action was read, which is
        stored with the document; None if there was none."""
        graph = Graph(name=action.name, actions=(action,), direction="right")
        created = h.draft(h.CREATED, author, about)
        came = None if file is None else Draft(h.IMPORTED, author, file)
        info = info_of(graph, check(graph))
        return await self._add(document_edits.first(graph), info, [created], author, came)

    async def add_draft(self, origin: str, seq: int, name: str, author: str) -> GraphView:
        """Make a draft of the graph `origin` called `name`, and return it: a new graph with the
        content that `origin` had after its change `seq`, under the same keys. Comments are not
        copied. Raise NotFound if there is no such graph, Conflict if it has no such change, and
        Unavailable if the log cannot be read or written."""
        row = await self._row(origin, kind="graph")
        then = await self._graph_reader.at(origin, seq)
        update, about = await self._graph_reader.ask(drafted, then)
        drafts = [
            h.draft(h.CREATED, author, h.GraphCreated(row.name, row.description)),
            h.draft(h.DRAFTED, author, h.GraphDrafted(origin, seq, name)),
        ]
        return await self._add(update, about, drafts, author)

    async def _add(
        self,
        update: bytes,
        info: GraphInfo,
        events: list[Draft],
        author: str,
        file: Draft | None = None,
    ) -> GraphView:
        """Store a new graph, and return it as lists show it. `update`: its document as one Yjs
        update; `info`: its facts for lists; `events`: events about it; `file`: the event with the
        imported file. A large file is stored first, in a commit of its own, since edits of others
        wait for every commit; else all is stored in one commit."""
        made = random_id()
        document = Draft(h.UPDATED, author, update)
        if file is not None and len(file.body) > _LARGE_FILE:
            await self._journal.append(h.about_stream(made), [file])
        elif file is not None:
            events = [*events, file]
        await self._journal.append_all(
            [
                Addition(h.about_stream(made), tuple(events)),
                Addition(h.graph_stream(made), (document,)),
            ]
        )
        self._checks.made(made, update, info)
        await self._on_made()
        return await self.get(made)

    async def _row(
        self, graph: str, *, deleted: bool = False, kind: h.DocumentKind | None = None
    ) -> Row[Any]:
        rows = await self._journal.query(_ONE, {"id": graph})
        return _there(graph, rows, kind, deleted=deleted)

    async def _view(self, row: Row[Any]) -> GraphView:
        summary = await self._checks.summary(row.id, row.seq)
        name, description = _called(row, summary)
        if (name, description) != (row.name, row.description):
            now = h.GraphDescribed(name, description, summary.seq)
            await self._journal.append(
                h.about_stream(row.id), [h.draft(h.DESCRIBED, h.SERVER, now)]
            )
        return self._shown(row, summary)

    def _shown(self, row: Row[Any], summary: GraphSummary) -> GraphView:
        name, description = _called(row, summary)
        told = summary.told
        return GraphView(
            id=row.id,
            name=name,
            description=description,
            seq=max(row.seq, summary.seq),
            updated_at=h.when(row.at),
            made_at=h.when(row.made_at),
            actions=summary.actions,
            problems=summary.problems,
            wrong=None if told is None else told.wrong,
            to_fill_in=None if told is None else told.to_fill_in,
            robots=summary.robots,
            labels=summary.labels,
            people=self._rooms.people_in(h.graph_stream(row.id)),
            deleted_at=None if row.deleted_at is None else h.when(row.deleted_at),
            damaged=summary.damaged,
            kind=row.kind,
            draft_of=None
            if row.draft_of is None
            else DraftOf(row.draft_of, row.drafted_seq, row.draft_name),
            drafts=row.drafts,
            folder=row.folder,
            thumbnail=summary.thumbnail,
        )


def _called(row: Row[Any], summary: GraphSummary) -> tuple[str, str]:
    """Return the name and the description of a graph: those of its document where they are known,
    else those of its `row`."""
    name, description = summary.called(row.kind)
    return (
        row.name if name is None else name,
        row.description if description is None else description,
    )


async def _do_nothing() -> None:
    return


def _placed(folder: str | None, rule: Rule | None, author: str) -> list[Draft]:
    """Return the events that put a new graph into a folder, if any, and give it its own rule, if
    any."""
    filed = [] if folder is None else [h.draft(h.FILED, author, h.GraphFiled(folder))]
    return filed + ([] if rule is None else [h.draft(h.RULED, author, h.GraphRuled(rule))])


def _there(
    graph: str, rows: Sequence[Row[Any]], kind: h.DocumentKind | None, *, deleted: bool = False
) -> Row[Any]:
    """Return the first of `rows`, the row of a graph. Raise NotFound if there is no row, if the
    graph is deleted and `deleted` is False, or if it is not of this `kind`."""
    if not rows or (rows[0].deleted_at is not None and not deleted):
        raise NotFound(f"There is no {kind or 'graph'} {graph!r}.")
    if kind not in {None, rows[0].kind}:
        raise NotFound(f"{graph!r} is no {kind}; it is a {rows[0].kind}.")
    return rows[0]


def _rows() -> Select[Any]:
    """Return a query for graphs with the number and the time of the last change of their documents."""
    event, graph = editor_tables.editor_event, editor_tables.graph
    last = (
        select(event.c.seq)
        .where(event.c.stream == "graph/" + graph.c.id)
        .order_by(event.c.seq.desc())
        .limit(1)
    )
    at = last.with_only_columns(event.c.at)
    of = graph.alias("draft")
    drafts = select(func.count()).where(of.c.draft_of == graph.c.id, of.c.deleted_at.is_(None))
    return select(
        graph,
        last.scalar_subquery().label("seq"),
        at.scalar_subquery().label("at"),
        drafts.scalar_subquery().label("drafts"),
    )


def _some(graphs: Sequence[str]) -> Select[Any]:
    return _rows().where(editor_tables.graph.c.id.in_(graphs))


_ID: Final = editor_tables.graph.c.id == bindparam("id")
_ONE: Final = _rows().where(_ID)
_KIND: Final = select(editor_tables.graph.c.kind, editor_tables.graph.c.deleted_at).where(_ID)


def fit(name: str, description: str) -> tuple[str, str]:
    name = name.strip()
    if not name or len(name) > NAME_LIMIT:
        raise BadInput(f"A name has 1 to {NAME_LIMIT} characters.", where={"path": "/name"})
    if len(description) > DESCRIPTION_LIMIT:
        raise BadInput(
            f"A description has up to {DESCRIPTION_LIMIT} characters.",
            where={"path": "/description"},
        )
    return name, description
