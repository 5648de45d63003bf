"""The action library: the actions that have a document, and those that graphs use, each name once.

Actions are made, imported, updated from graphs, and graphs updated from them.
"""

import logging
from collections.abc import Awaitable, Callable, Sequence
from contextlib import AsyncExitStack
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import anyio
import msgspec
from anyio import CapacityLimiter, Lock, create_task_group
from sqlalchemy import select

from action_assistant.editor.catalogue.catalogue import Catalogue, GraphView, fit
from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.catalogue.graph_rights import Sees, sight_of_everything
from action_assistant.editor.catalogue.server_edits import store_update
from action_assistant.editor.documents.contents import GraphAtSeq
from action_assistant.editor.documents.document import new_aid
from action_assistant.editor.library import library_updates
from action_assistant.editor.library.action_uses import (
    NOTHING,
    ActionSource,
    LibraryAction,
    as_actions,
    found,
    merged,
)
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.log.graph_events import DocumentKind
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import BadInput, Conflict, Refused
from action_assistant.journal.journal import Journal
from action_assistant.schema import editor_tables
from action_assistant.umrf.action_updates import Renames
from action_assistant.umrf.model import Action
from action_assistant.web.http.plain_texts import require_plain
from action_assistant.web.workers.lanes import HOPELESS, RunInWorker

if TYPE_CHECKING:  # slow to load
    from action_assistant.editor.rooms.remote_room import AnyRoom

log: Final = logging.getLogger(__name__)

_AT_ONCE: Final = 4  # documents that are read

_Listing = Callable[[list[tuple[ActionSource, bytes]]], bytes]


class Library:
    """Lists the actions of the library and of graphs. A document is read again only when it has
    changed."""

    def __init__(
        self,
        journal: Journal,
        graph_reader: GraphReader,
        caller_sight: Callable[[], Awaitable[Sees]] = sight_of_everything,
    ) -> None:
        self._caller_sight = caller_sight
        self._journal = journal
        self._graph_reader = graph_reader
        self._read: dict[str, tuple[int, bytes]] = {}
        self._reading = Lock()
        self._shown: dict[_Listing, tuple[dict[str, int], bytes]] = {}

    async def all(self) -> bytes:
        """Return all actions, sorted by name: the JSON of a list of `LibraryAction`, of the
        documents that the person may see. Documents that cannot be read are skipped."""
        return await self._listed(merged)

    async def graphs(self) -> bytes:
        """Return every graph that the person may see as the action that stands for it: the JSON of a
        list of `GraphAsAction`."""
        return await self._listed(as_actions)

    async def _listed(self, listing: _Listing) -> bytes:
        sees = await self._caller_sight()
        async with self._reading:  # what one request reads the next one has
            every = await self._sources()
            sources = [each for each in every if sees(each[0].document)]
            if len(sources) < len(every):
                return await self._graph_reader.ask(listing, sources)
            seqs = {source.document: source.seq for source, _ in sources}
            before = self._shown.get(listing)
            if before is None or before[0] != seqs:
                before = seqs, await self._graph_reader.ask(listing, sources)
                self._shown[listing] = before
            return before[1]

    async def _sources(self) -> list[tuple[ActionSource, bytes]]:
        """Return all documents with actions, the last changed first, each with its actions as
        `found` encodes them."""
        graph, event = editor_tables.graph, editor_tables.editor_event
        last = (
            select(event.c.seq)
            .where(event.c.stream == "graph/" + graph.c.id)
            .order_by(event.c.seq.desc())
            .limit(1)
        )
        rows = await self._journal.query(
            select(
                graph.c.id,
                graph.c.made_at,
                graph.c.kind,
                last.scalar_subquery().label("seq"),
                last.with_only_columns(event.c.at).scalar_subquery().label("at"),
            )
            .where(graph.c.deleted_at.is_(None), graph.c.draft_of.is_(None))
            .order_by(graph.c.made_at, graph.c.id)
        )
        limit = CapacityLimiter(_AT_ONCE)
        refused: list[Refused] = []
        async with create_task_group() as reading:
            for row in rows:
                reading.start_soon(self._refresh, row.id, row.seq, row.kind, limit, refused)
        if refused:
            raise refused[0]
        self._read = {row.id: self._read[row.id] for row in rows}
        return [
            (
                ActionSource(row.id, row.made_at, self._read[row.id][0], row.kind),
                self._read[row.id][1],
            )
            for row in sorted(rows, key=lambda row: row.at, reverse=True)
        ]

    async def _refresh(
        self,
        graph: str,
        seq: int,
        kind: DocumentKind,
        limit: CapacityLimiter,
        refused: list[Refused],
    ) -> None:
        """Read the actions of a document, or add to `refused` why they cannot be read now. One whose
        contents cannot be read counts as empty, so that the others are listed."""
        known = self._read.get(graph)
        if known is not None and known[0] >= seq:
            return
        async with limit:
            try:
                sight = await self._graph_reader.now(graph)
                seq, actions = sight.seq, await self._graph_reader.ask(found, sight, kind)
            except HOPELESS:
                actions = NOTHING
            except Refused as error:
                refused.append(error)
                return
            except Exception:
                log.exception("%s: the actions of change %d cannot be read", graph, seq)
                actions = NOTHING
        self._read[graph] = seq, actions


class NewAction(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A new action without parameters, or, with `from_graphs`, with the parameters that graphs use."""

    name: str
    description: str = ""
    from_graphs: bool = False


class GraphMoment(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A graph, and its change that a person has seen."""

    graph: str
    seq: int


class UpdatedGraph(msgspec.Struct, frozen=True):
    """A graph after an update of its uses. `seq`: its newest change; `changed`: whether that is new;
    `refused`: why the update of this graph failed, after others were changed; "" if it did not."""

    graph: str
    seq: int
    changed: bool
    refused: str = ""


class LibraryEdits:
    """Carries out commands of people on actions of the library; the caller has checked their role.
    Its methods raise Unavailable while the journal cannot be read or written. `action`: the id of the document of an action; `author`: the id of the person."""

    def __init__(
        self,
        journal: Journal,
        rooms: Rooms,
        graph_reader: GraphReader,
        catalogue: Catalogue,
        library: Library,
        files: RunInWorker,
    ) -> None:
        self._journal = journal
        self._rooms = rooms
        self._graph_reader = graph_reader
        self._catalogue = catalogue
        self._library = library
        self._files = files
        self._making = anyio.Lock()

    async def create(self, body: bytes, author: str) -> tuple[GraphView, bytes | None]:
        """Create the document of an action from a `NewAction` or from a file (`body`). Only graphs
        that the person sees are used for its parameters. Return it
        and, for a file, the JSON of an `ImportReport`, else None. Raise BadInput, NotUmrf or
        TooLarge, with the place, for a bad file; Conflict for a taken name; NotFound if no graph
        uses the action."""
        try:
            wanted = msgspec.json.decode(body, type=NewAction)
        except (msgspec.DecodeError, RecursionError, UnicodeDecodeError):
            return await self._bring(body, author)
        if not wanted.from_graphs:  # else a file may have brought the name
            require_plain(body)
        name, description = fit(wanted.name, wanted.description)
        action = Action(key=new_aid(), name=name, description=description)
        if wanted.from_graphs:
            known = await self._of_graphs(name)
            action = msgspec.structs.replace(
                known, key=action.key, description=description or known.description
            )
        about = h.GraphCreated(action.name, action.description, kind="action")
        return await self._add(action, author, about), None

    async def _bring(self, body: bytes, author: str) -> tuple[GraphView, bytes]:
        found = await self._files(library_updates.brought, body)
        name, description = fit(found.action.name, found.action.description)
        about = h.GraphCreated(name, description, found.dialect, found.notes, "action")
        action = msgspec.structs.replace(found.action, key=new_aid())
        return await self._add(action, author, about, body), found.reading

    async def _add(
        self, action: Action, author: str, about: h.GraphCreated, file: bytes | None = None
    ) -> GraphView:
        async with self._making:  # of two of one name at a time, one is refused
            for view in await self._catalogue.all(kind="action"):
                if view.name == action.name:
                    raise Conflict(
                        f"The library has an action {action.name!r} already.",
                        where={"graph": view.id},
                    )
            return await self._catalogue.add_action(action, author, about, file)

    async def _of_graphs(self, name: str) -> Action:
        sights = await self._using(name)
        action: Action = await self._graph_reader.ask(library_updates.of_graphs, name, sights)
        return action

    async def uses(self, action: str, renames: Renames) -> tuple[int, bytes]:
        """Return the number of the action's last change, and the JSON of a list of `ActionUse` for
        it, of the graphs that the person sees. `renames`: parameters that were renamed."""
        sight = await self._graph_reader.now(action)
        name = (await self._catalogue.get(action)).name
        graphs = await self._using(name)
        found: bytes = await self._graph_reader.ask(library_updates.uses, sight, graphs, renames)
        return sight.seq, found

    async def update_uses(
        self, action: str, seq: int, graphs: Sequence[GraphMoment], renames: Renames, author: str
    ) -> list[UpdatedGraph]:
        """Update the uses of an action in graphs to its parameters after its change `seq`, by one
        edit for each graph. `graphs`: with the change that the person has seen; `renames`:
        parameters that were renamed. Raise BadInput if a graph is named twice; Conflict if a graph
        has changed meanwhile, and the errors of an edit, while no graph is changed. After that each
        graph says what came of it."""
        sight = await self._graph_reader.at(action, seq)
        name = (await self._catalogue.get(action)).name
        if len({each.graph for each in graphs}) < len(graphs):
            raise BadInput("A graph is named twice.", where={"path": "/graphs"})
        async with AsyncExitStack() as open_rooms:
            updates: list[tuple[GraphMoment, AnyRoom, bytes]] = []
            for each in graphs:
                await self._catalogue.require(each.graph, "graph")
                room = await open_rooms.enter_async_context(
                    self._rooms.reach(h.graph_stream(each.graph))
                )
                then = await _seen(room, each)
                update = await self._graph_reader.ask(
                    library_updates.updating, sight, then, renames
                )
                updates.append((each, room, update))
            for each, room, _ in updates:
                await _seen(room, each)

            updated: list[UpdatedGraph] = []

            async def updating(known: bytes, each: GraphMoment, state: bytes, seq: int) -> bytes:
                if seq == each.seq:
                    return known
                if not any(other.changed for other in updated):
                    raise _changed(each, seq)
                # Others are written already, so this one is updated as it is by now.
                now = GraphAtSeq(each.graph, seq, state)
                update: bytes = await self._graph_reader.ask(
                    library_updates.updating, sight, now, renames
                )
                return update

            for each, room, update in updates:
                compute = partial(updating, update, each)
                try:
                    found = await self._adapt(room, each.graph, compute, author, sight, name)
                except Refused as error:
                    if not any(other.changed for other in updated):
                        raise
                    found = UpdatedGraph(each.graph, room.seq, changed=False, refused=error.detail)
                updated.append(found)
            return updated

    async def take(self, action: str, graph: str, aid: str | None, author: str) -> GraphView:
        """Give an action of the library the parameters that one of its uses in a graph has; return
        the view of the library's action. `aid`: the key of that use; None: the first use whose
        parameters differ. Raise NotFound if the action, the graph or the use does not exist."""
        await self._catalogue.require(action, "action")
        await self._catalogue.require(graph, "graph")
        source = await self._graph_reader.now(graph)
        name = (await self._catalogue.get(action)).name

        async def taking(state: bytes, seq: int) -> bytes:
            sight = GraphAtSeq(action, seq, state)
            update: bytes = await self._graph_reader.ask(library_updates.taking, sight, source, aid)
            return update

        async with self._rooms.reach(h.graph_stream(action)) as room:
            await self._adapt(room, action, taking, author, source, name)
        return await self._catalogue.get(action)

    async def replacing_would(self, action: str, body: bytes) -> bytes:
        """Return the JSON of the `Difference` that `replace` with this file (`body`) would make.
        Raise the errors of `replace`."""
        await self._catalogue.require(action, "action")
        sight = await self._graph_reader.now(action)
        found: bytes = await self._files(library_updates.replacing_would, sight, body)
        return found

    async def replace(
        self, action: str, body: bytes, author: str, seq: int | None = None
    ) -> GraphView:
        """Replace an action by the content of its file (`body`), and return it. Raise BadInput,
        NotUmrf or TooLarge, with the place, for a bad file; Conflict for the file of another
        action, or if `seq` is not the last change."""
        await self._catalogue.require(action, "action")
        name = (await self._catalogue.get(action)).name

        async def replacing(state: bytes, now: int) -> bytes:
            if seq is not None and now != seq:
                raise _changed(GraphMoment(action, seq), now, "action")
            return await self._files(
                library_updates.replacing, GraphAtSeq(action, now, state), body
            )

        async with self._rooms.reach(h.graph_stream(action)) as room:
            await self._adapt(room, action, replacing, author, GraphAtSeq("", 0, b""), name)
        return await self._catalogue.get(action)

    async def built(self, action: str, build: h.ActionBuilt, author: str) -> None:
        """Store a report about a build of an action's package. Raise NotFound if the action does
        not exist."""
        await self._catalogue.require(action, "action")
        await self._journal.append(h.about_stream(action), [h.draft(h.BUILT, author, build)])

    async def last_build(self, action: str) -> h.ActionBuilt | None:
        """Return the last report of a build of an action's package; None if it was never built.
        Raise NotFound if the action does not exist."""
        await self._catalogue.require(action, "action")
        event = editor_tables.editor_event.c
        chosen = (
            select(event.body)
            .where(event.stream == h.about_stream(action), event.kind == h.BUILT)
            .order_by(event.seq.desc())
            .limit(1)
        )
        for row in await self._journal.query(chosen):
            return msgspec.json.decode(row.body, type=h.ActionBuilt)
        return None

    async def _adapt(
        self,
        room: "AnyRoom",
        document: str,
        compute: Callable[[bytes, int], Awaitable[bytes]],
        author: str,
        source: GraphAtSeq,
        name: str,
    ) -> UpdatedGraph:
        edit = await store_update(room, author, compute)
        if edit.changed:
            adapted = h.GraphAdapted(edit.seq, source.graph, source.seq, name)
            await self._journal.append(
                h.about_stream(document), [h.draft(h.ADAPTED, author, adapted)]
            )
        return UpdatedGraph(document, edit.seq, edit.changed)

    async def _using(self, name: str) -> list[GraphAtSeq]:
        """Return the graphs that use the action of this name and that the person sees, in their
        present state, the last changed first."""
        known = msgspec.json.decode(await self._library.all(), type=list[LibraryAction])
        used_in = {graph for each in known if each.name == name for graph in each.used_in}
        views = [view for view in await self._catalogue.all() if view.id in used_in]
        return [await self._graph_reader.now(view.id) for view in views]


async def _seen(room: "AnyRoom", moment: GraphMoment) -> GraphAtSeq:
    """Return the graph in this room if its last change is still the one that a person has seen
    (`moment`); raise Conflict if not."""
    found = await room.now()
    if found.seq != moment.seq:
        raise _changed(moment, found.seq)
    return GraphAtSeq(moment.graph, *found)


def _changed(moment: GraphMoment, seq: int, what: DocumentKind = "graph") -> Conflict:
    where: dict[str, Any] = {"graph": moment.graph}
    return Conflict(
        f"Somebody has changed this {what}: it was seen after its change {moment.seq}, and now has "
        f"{seq}. Nothing was written.",
        where=where,
    )
