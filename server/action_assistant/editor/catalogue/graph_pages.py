"""Pages, sorts, searches and counts graphs in the database, as a person may see them.

The rows of `graph_facts` answer for documents. Before a query, rows of graphs that have changed are
brought up to date; a query never reads more documents than a page has graphs.
"""

import asyncio
from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal, TypeAlias

import msgspec
from sqlalchemy import ColumnElement, Row, Select, and_, case, exists, func, or_, select

from action_assistant.editor.catalogue import graph_facts
from action_assistant.editor.catalogue.catalogue import READ_FOR_A_LIST, Catalogue, GraphView
from action_assistant.editor.catalogue.graph_checks import GraphChecks
from action_assistant.editor.catalogue.graph_facts import ChangedGraph
from action_assistant.editor.catalogue.graph_rights import GraphRights
from action_assistant.editor.documents.thumbnails import Thumbnail, digest_of
from action_assistant.editor.log.graph_events import graph_of
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.editor.workers import encoded
from action_assistant.errors import NotFound
from action_assistant.journal.journal import Journal
from action_assistant.journal.slots import Cursor, is_later, slot_in
from action_assistant.schema.editor_tables import (
    editor_event,
    editor_head,
    graph,
    graph_label,
)
from action_assistant.schema.editor_tables import graph_facts as facts
from action_assistant.web.auth.caller import acting_for
from action_assistant.web.auth.identity import Identity

#: By what a list is sorted; "changed" and "problems" and "size": the last, most or largest first.
Order: TypeAlias = Literal["changed", "name", "problems", "size"]

MOST: Final = 200  # graphs on a page
MOST_FIRST: Final = 200  # graphs that may be named to come first
MOST_DRAWN: Final = 60  # thumbnails of one answer
#: For whom facts are computed: the server sees every graph.
_OURSELVES: Final = "facts of graphs"
_READ: Final = 60  # documents that a query waits for
_WORDS: Final = 20  # of a search
_AT_ONCE: Final = 400  # graphs that one query names

_LISTED: Final = and_(
    graph.c.kind == "graph", graph.c.deleted_at.is_(None), graph.c.draft_of.is_(None)
)


class Wanted(msgspec.Struct, frozen=True):
    """The graphs that are wanted. `search`: each of its words stands in the name, description,
    robots or labels of a graph, or in the name of somebody who is in it now. `folder`: the graph
    lies in the folder with this id; "" in none; None anywhere. `deep`: also in the folders inside of
    it. `label`: the graph has this one."""

    search: str = ""
    folder: str | None = None
    deep: bool = False
    label: str | None = None


class Page(msgspec.Struct, frozen=True):
    """Some of the graphs that were wanted, and the count of all of them (`total`)."""

    graphs: tuple[GraphView, ...]
    total: int


class GraphName(msgspec.Struct, frozen=True):
    """The id and the name of a graph."""

    id: str
    name: str


class ThumbnailOf(msgspec.Struct, frozen=True):
    """The thumbnail of the graph with this id, as the list names it by its `digest`."""

    graph: str
    digest: str
    thumbnail: Thumbnail


class LabelCount(msgspec.Struct, frozen=True):
    """A label, and how many graphs have it."""

    label: str
    graphs: int


class GraphPages:
    """Answers queries about the graphs that an identity may see, without drafts and deleted ones. Its
    methods raise Unavailable while the journal cannot be read."""

    def __init__(
        self,
        journal: Journal,
        rooms: Rooms,
        checks: GraphChecks,
        rights: GraphRights,
        catalogue: Catalogue,
    ) -> None:
        self._journal = journal
        self._rooms = rooms
        self._checks = checks
        self._rights = rights
        self._catalogue = catalogue
        self._renewing = asyncio.Lock()
        self._seen: Cursor | None = None  # up to which rows are known to be right, or in work

    async def page(
        self,
        identity: Identity,
        wanted: Wanted,
        *,
        limit: int,
        offset: int = 0,
        order: Order = "changed",
        first: Sequence[str] = (),
    ) -> Page:
        """Return up to `limit` of the wanted graphs, after the first `offset`. `first`: ids of graphs
        that come before all others, in this order. Raise NotFound for a folder that is unknown or
        out of sight, Unavailable if the journal cannot be read or written."""
        await self._renew()
        sees_all, conditions = await self._conditions(identity, wanted)
        chosen = (
            select(graph.c.id, graph.c.folder, graph.c.rule)
            .join(facts, facts.c.graph == graph.c.id)
            .where(*conditions)
            .order_by(*_in_order(order, first, sees_all=sees_all), graph.c.id)
        )
        rows = await self._journal.query(chosen.limit(limit).offset(offset))
        count = select(func.count()).select_from(graph).join(facts, facts.c.graph == graph.c.id)
        (total,) = await self._journal.query(count.where(*conditions))
        exact = self._checks.names.are_read or not sees_all
        if exact:
            await self._checks.names.refresh()
        views = await self._catalogue.some([row.id for row in rows], exact=exact)
        by_id = {row.id: row for row in rows}
        shown = tuple(self._in_sight(view, by_id[view.id], identity) for view in views)
        return Page(shown, total[0])

    async def names(self, identity: Identity) -> tuple[GraphName, ...]:
        """Return the names of all graphs, sorted by name."""
        await self._renew()
        _, conditions = await self._conditions(identity, Wanted())
        chosen = select(graph.c.id, facts.c.name).join(facts, facts.c.graph == graph.c.id)
        rows = await self._journal.query(
            chosen.where(*conditions).order_by(facts.c.name_key, graph.c.id)
        )
        return tuple(GraphName(row.id, row.name) for row in rows)

    async def thumbnails(
        self, identity: Identity, wanted: Mapping[str, str]
    ) -> tuple[ThumbnailOf, ...]:
        """Return thumbnails of graphs, by their digests as lists show them. Graphs that are out of
        sight, and those that have another digest, are left out. No document is read. Raise
        Unavailable if the journal cannot be read."""
        _, conditions = await self._conditions(identity, Wanted())
        chosen = select(graph.c.id).where(*conditions, graph.c.id.in_(wanted))
        seen = [row.id for row in await self._journal.query(chosen)]
        await self._checks.facts.recall(seen)
        known = [(each, self._checks.facts.get(each)) for each in seen]
        drawn = [(each, facts.info.thumbnail) for each, facts in known if facts is not None]
        return tuple(
            ThumbnailOf(each, wanted[each], encoded(Thumbnail, json))
            for each, json in drawn
            if digest_of(json) == wanted[each]
        )

    async def labels(self, identity: Identity, wanted: Wanted) -> tuple[LabelCount, ...]:
        """Return the labels of the wanted graphs, sorted by name. Raise NotFound as `page` does."""
        await self._renew()
        _, conditions = await self._conditions(identity, wanted)
        chosen = (
            select(graph_label.c.label, func.count().label("graphs"))
            .join(graph, graph.c.id == graph_label.c.graph)
            .join(facts, facts.c.graph == graph.c.id)
            .where(*conditions)
            .group_by(graph_label.c.label)
        )
        found = [LabelCount(row.label, row.graphs) for row in await self._journal.query(chosen)]
        return tuple(sorted(found, key=lambda each: (graph_facts.name_key(each.label), each.label)))

    async def _conditions(
        self, identity: Identity, wanted: Wanted
    ) -> tuple[bool, list[ColumnElement[bool]]]:
        """Return whether an identity sees every graph, and the conditions for those that are wanted
        and that it sees."""
        visible = await self._rights.is_visible(identity)
        conditions = [_LISTED] if visible is None else [_LISTED, visible]
        if wanted.folder is not None:
            place = self._place(identity, wanted.folder, deep=wanted.deep)
            conditions += [] if place is None else [place]
        if wanted.label is not None:
            has = graph_label.c.graph == graph.c.id, graph_label.c.label == wanted.label
            conditions.append(exists().where(*has))
        words = wanted.search.replace("\0", " ").lower().split()[:_WORDS]
        conditions += [self._says(word) for word in words]
        return visible is None, conditions

    def _place(self, identity: Identity, folder: str, *, deep: bool) -> ColumnElement[bool] | None:
        """Return the condition that a graph lies in a folder; None if any graph does. A graph in a
        folder that the identity does not see is shown as in none."""
        seen = self._rights.folders_seen(identity)
        if folder == "":
            return None if deep else or_(graph.c.folder.is_(None), graph.c.folder.not_in(seen))
        if folder not in seen:
            raise NotFound(f"There is no folder {folder!r}.")
        return graph.c.folder.in_(_inside(folder, seen) if deep else [folder])

    def _says(self, word: str) -> ColumnElement[bool]:
        """Return the condition that a graph, or somebody who is in it now, is called by a word."""
        present = {**self._rooms.people_elsewhere, **self._rooms.people_here()}
        visited = [
            found
            for stream, people in present.items()
            if (found := graph_of(stream)) is not None
            and any(word in person.name.lower() for person in people)
        ]
        says = facts.c.words.contains(word, autoescape=True)
        return or_(says, graph.c.id.in_(visited)) if visited else says

    def _in_sight(self, view: GraphView, row: Row[Any], identity: Identity) -> GraphView:
        """Return a graph as an identity may see it."""
        folder = row.folder if self._rights.sees_folder(row.folder, identity) else None
        restricted = self._rights.restricts(row.rule, row.folder)
        return msgspec.structs.replace(view, folder=folder, restricted=restricted)

    async def _renew(self) -> None:
        """Bring the rows of graphs up to date that have changed since the last call. The facts of a
        few graphs are computed now; those of many in the background, and until then the graphs are
        found by what was known before."""
        async with self._renewing:
            await self._checks.facts.write()
            seen, changed = await self._changed()
            await self._checks.facts.note_changes(changed)
            if len(changed) <= _READ and await self._has_names(changed):
                await self._checks.facts.recall([each.id for each in changed])
                with acting_for(
                    _OURSELVES
                ):  # counts that are stored are those of who sees everything
                    for each in changed:
                        await self._checks.summary(each.id, each.seq)
                await self._checks.facts.write()
            else:
                self._checks.compute_later({each.id: each.seq for each in changed})
            self._seen = seen

    async def _has_names(self, changed: Sequence[ChangedGraph]) -> bool:
        """Return whether the names of all graphs are known, by which those inside of others are
        found. With many graphs nobody waits until they are read for the first time."""
        names = self._checks.names
        if not names.are_read:
            if not changed:
                return False
            (count,) = await self._journal.query(select(func.count()).select_from(graph))
            if count[0] > READ_FOR_A_LIST:
                return False
        await names.refresh()
        return True

    async def _changed(self) -> tuple[Cursor, list[ChangedGraph]]:
        """Return the moment up to which events were seen, and the graphs whose rows are not
        right any more."""
        seen = self._seen
        if seen is None:
            seen = await self._journal.cursor()
            return seen, _changes(await self._journal.query(_outdated()))
        event = editor_event.c
        news = select(event.stream, func.max(event.position).label("at"))
        streams = await self._journal.query(
            news.where(is_later(event.position, seen)).group_by(
                event.stream, slot_in(event.position)
            )
        )
        ids = sorted({each for row in streams if (each := graph_of(row.stream)) is not None})
        found: list[ChangedGraph] = []
        for start in range(0, len(ids), _AT_ONCE):
            some = graph.c.id.in_(ids[start : start + _AT_ONCE])
            found += _changes(await self._journal.query(_outdated().where(some)))
        for row in streams:
            seen = seen.after(row.at)
        return seen, found


def _outdated() -> Select[Any]:
    """Return a query for the graphs whose row in the table of facts is missing or not right."""
    right = and_(facts.c.seq >= editor_head.c.seq, facts.c.form == graph_facts.form())
    return (
        select(graph.c.id, editor_head.c.seq, graph.c.name, graph.c.description)
        .join(editor_head, editor_head.c.stream == "graph/" + graph.c.id)
        .outerjoin(facts, facts.c.graph == graph.c.id)
        .where(_LISTED, or_(facts.c.graph.is_(None), ~right))
    )


def _changes(rows: Sequence[Row[Any]]) -> list[ChangedGraph]:
    return [ChangedGraph(row.id, row.seq, row.name, row.description) for row in rows]


def _in_order(order: Order, first: Sequence[str], *, sees_all: bool) -> list[ColumnElement[Any]]:
    """Return by what graphs are sorted. Problems of graphs inside count only for those who see them
    all."""
    changed = facts.c.changed_at.desc()
    worst = facts.c.worst if sees_all else facts.c.worst_alone
    by: dict[Order, list[ColumnElement[Any]]] = {
        "changed": [changed],
        "name": [facts.c.name_key, changed],
        "problems": [worst.desc(), changed],
        "size": [facts.c.actions.desc(), changed],
    }
    ranks = {each: rank for rank, each in enumerate(dict.fromkeys(first))}
    ranked = [case(ranks, value=graph.c.id, else_=len(ranks))] if ranks else []
    return [*ranked, *by[order]]


def _inside(folder: str, parents: dict[str, str | None]) -> list[str]:
    """Return the ids of a folder and of all folders inside of it. `parents`: the folder around each
    one."""
    found, level = [folder], {folder}
    while level:
        level = {each for each, parent in parents.items() if parent in level} - set(found)
        found += sorted(level)
    return found
