"""The rights of identities on graphs and folders, by the rules that are stored."""

import asyncio
import contextlib
import logging
import time
from collections.abc import Awaitable, Callable, Coroutine, Mapping, Sequence
from functools import partial
from typing import Any, Final, Literal, NamedTuple, TypeAlias

import msgspec
from sqlalchemy import ColumnElement, Row, and_, bindparam, false, or_, select

from action_assistant.editor.log import graph_events as h
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import Conflict, Forbidden, NotFound, Unavailable
from action_assistant.journal.events import Draft
from action_assistant.journal.journal import Journal
from action_assistant.schema import editor_tables
from action_assistant.web.auth.caller import caller
from action_assistant.web.auth.graph_rules import (
    CLOSED,
    MAY_NOT_EDIT,
    OPEN,
    Rule,
    RuledFolder,
    combined,
    may_edit,
    may_see,
    rule_at,
    with_person,
)
from action_assistant.web.auth.graph_seals import (
    GraphSeals,
    RulesFile,
    Sight,
    Statement,
    statement_of,
)
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.roles import OWNER

log: Final = logging.getLogger(__name__)

#: The kinds of things that paths of routes name.
Kind: TypeAlias = Literal["graph", "draft", "version", "action", "folder"]
#: Says of the id of a graph whether somebody may see it.
Sees: TypeAlias = Callable[[str], bool]

_AGAIN_S: Final = 1.0  # between attempts to read the rules

_GRAPH: Final = editor_tables.graph
_COLUMNS: Final = select(_GRAPH.c.id, _GRAPH.c.folder, _GRAPH.c.rule, _GRAPH.c.draft_of)
_ONE: Final = _COLUMNS.where(_GRAPH.c.id == bindparam("id"))
_VERSION: Final = select(editor_tables.version.c.graph).where(
    editor_tables.version.c.id == bindparam("id")
)


class Rules(NamedTuple):
    """The own rule of a thing, if any, the rule that counts for it, and the one that would count
    without an own one."""

    own: Rule | None
    counts: Rule
    around: Rule


class GraphRights:
    """Knows the rule of each graph and folder. Nothing is asked of the database while there is no
    rule. `file`: where the runner finds the rules; `keys` seal them. Methods that ask the journal
    raise Unavailable while it cannot be read."""

    def __init__(self, journal: Journal, rooms: Rooms, file: RulesFile, keys: Keys) -> None:
        self._journal = journal
        self._rooms = rooms
        self._file = file
        self._seals = GraphSeals(keys)
        self._folders: dict[str, RuledFolder] = {}
        self._counts: dict[str, Rule] = {}  # by graph, as far as is known; the rest is read
        self._is_ruled = False
        self._generation = 0  # of what is known here
        self._last_at = 0  # of statements and sights
        self._refreshing = asyncio.Lock()  # an older reading must not replace a newer one
        self._changes = 0  # that were stored
        self._counted = 0  # of these, by which is decided here
        self._tasks: set[asyncio.Task[None]] = set()

    async def refresh(self) -> Unavailable | None:
        """Read the folders and their rules again, close the sockets of those who may no longer see
        or edit what they have open, and store a statement for the runner. Return the error if the
        statement could not be written. Raise Unavailable if the journal cannot be read."""
        async with self._refreshing:
            changes = self._changes
            self._generation += 1  # before anybody is put out: see `admit`
            self._counts = {}
            folder = editor_tables.folder.c
            rows = await self._journal.query(select(folder.id, folder.parent, folder.rule))
            ruled = select(_GRAPH.c.id).where(_GRAPH.c.rule.is_not(None)).limit(1)
            graphs = await self._journal.query(ruled)
            self._folders = {row.id: RuledFolder(row.parent, _rule(row.rule)) for row in rows}
            was_ruled = self._is_ruled
            self._is_ruled = bool(graphs) or any(each.rule for each in self._folders.values())
            if was_ruled or self._is_ruled:
                await self._put_out()
            error = await self._tell_runner()
            self._counted = changes
            return error

    async def carry_out(self, store: Callable[[], Awaitable[object]]) -> None:
        """Store a change of a rule or a place by `store`, and let it count, also if the caller is gone
        meanwhile. Raise what `store` raises; raise Unavailable if the change is stored, and cannot be
        read, so that nothing is decided until it can, or if the runner could not be told of it."""
        await asyncio.shield(self._background(self._carried_out(store)))

    async def _carried_out(self, store: Callable[[], Awaitable[object]]) -> None:
        try:
            await store()
        finally:  # it may be stored, whatever was raised
            self._changes += 1
        await self._let_count()

    async def made(self) -> None:
        """Tell the runner the rule of a new graph or draft, which is there whatever becomes of that: a
        start of it brings its rule to the runner, too."""
        if self._is_ruled:
            self._changes += 1
            with contextlib.suppress(Unavailable):  # logged, and tried again
                await self._let_count()

    async def _let_count(self) -> None:
        """Let stored changes count. If that fails it is tried again, since rooms are open meanwhile."""
        try:
            error = await self.refresh()
        except Exception:
            log.exception("the rules of graphs cannot be read; nothing is decided by older ones")
            self._background(self._try_again())
            raise
        if error is not None:
            raise error

    async def _try_again(self) -> None:
        while self._counted != self._changes:
            await asyncio.sleep(_AGAIN_S)
            try:
                await self._require_current()
            except Exception:
                log.exception("the rules of graphs still cannot be read")

    def _background(self, work: Coroutine[Any, Any, None]) -> "asyncio.Task[None]":
        task = asyncio.create_task(work, name="graph rights")
        self._tasks.add(task)
        task.add_done_callback(self._forget)
        return task

    def _forget(self, task: "asyncio.Task[None]") -> None:
        self._tasks.discard(task)
        if not task.cancelled():
            task.exception()  # raised to whoever waits; nobody may, and it was logged

    async def _require_current(self) -> None:
        """Read the rules again if a stored change does not count yet. Raise Unavailable if the journal
        cannot be read: nobody may see what an older rule allows."""
        if self._counted != self._changes:
            await self.refresh()

    async def _tell_runner(self) -> Unavailable | None:
        """Store the rules that count now for the runner, unless it knows them."""
        rows = await self._journal.query(_COLUMNS) if self._is_ruled else []
        by_id = {row.id: row for row in rows}
        counting = {row.id: self._of_row(row, by_id).counts for row in rows}
        self._counts = counting
        known = self._file.newest() or Statement(0, (), {})
        now = statement_of(counting, known)
        if (now.rules, now.graphs) == (known.rules, known.graphs):
            return None
        statement = msgspec.structs.replace(now, at=self._moment(now.at))
        try:
            await asyncio.to_thread(self._file.store, self._seals.sealed(statement))
        except Unavailable as error:
            log.error("the rules of graphs are not stored: %s", error.detail)
            return error
        return None

    def _moment(self, earliest: int = 0) -> int:
        """Return the present time in microseconds since 1970, or `earliest` if that is later; after
        each time returned so far, whatever the clock does."""
        self._last_at = max(time.time_ns() // 1000, self._last_at + 1, earliest)
        return self._last_at

    def statement(self) -> Statement:
        """Return the newest sealed rules of all graphs."""
        return self._file.newest() or self._seals.sealed(Statement(0, (), {}))

    async def sight_of(self, version: str, digest: str, graphs: Sequence[str]) -> Sight:
        """Return the sealed rules of a version with this digest. `graphs`: the ids of its graph and
        of those inside."""
        at = self._moment()  # before the rules are read: a later change makes a later statement
        rules = tuple([await self._counting(graph) for graph in graphs])
        return self._seals.sealed(Sight(version, digest, tuple(graphs), rules, at))

    async def rule_for_copy(
        self, graphs: Sequence[str], folder: str | None, author: str
    ) -> Rule | None:
        """Return the own rule of a new graph that is made in a folder of what stands in `graphs`, so
        that nobody sees it who may not see all of them; None if the folder says so already."""
        rules = {await self._counting(graph) for graph in graphs} - {OPEN}
        if not rules:
            return None
        rule = rules.pop() if len(rules) == 1 else with_person(combined(rules), author)
        return None if rule == self.rule_in(folder) else rule

    async def _counting(self, graph: str) -> Rule:
        """Return the rule that counts for a graph; CLOSED if there is none with this id."""
        await self._require_current()
        if not self._is_ruled:
            return OPEN
        known = self._counts.get(graph)
        if known is not None:
            return known
        rules = await self._rule_of("graph", graph)
        return CLOSED if rules is None else rules.counts

    async def _put_out(self) -> None:
        """Close the sockets of those who may no longer see or edit what they have open."""
        for room in self._rooms.open_rooms():
            graph = h.graph_of(room.stream)
            rule = None if graph is None else await self._rule_of("graph", graph)
            if rule is not None:
                self._rooms.put_out(
                    room.stream, partial(may_see, rule.counts), partial(may_edit, rule.counts)
                )

    async def check(self, kind: Kind, thing: str, identity: Identity, *, edits: bool) -> None:
        """Raise NotFound if the thing with this id does not exist, or, with the same message, if
        the identity may not see it. Raise Forbidden if `edits` is True and the identity may see but
        not edit the thing. Do nothing while there are no rules. Raise Unavailable if the
        journal cannot be read."""
        await self._require_current()
        if not self._is_ruled:
            return  # the route says by itself what does not exist
        rules = await self._rule_of(kind, thing)
        if rules is None or not may_see(rules.counts, identity):
            raise NotFound(f"There is no {kind} {thing!r}.")
        if edits and not may_edit(rules.counts, identity):
            raise Forbidden(MAY_NOT_EDIT)

    async def admit(self, graph: str, identity: Identity) -> bool:
        """Return whether the rule of a graph lets an identity edit it. Raise NotFound if it may not
        see it. Whoever joins the room in the same step of the event loop is found by `put_out`
        after each later change of a rule."""
        while True:
            generation = self._generation
            await self.check("graph", graph, identity, edits=False)
            rules = await self._rule_of("graph", graph) if self._is_ruled else None
            if generation == self._generation:
                return rules is None or may_edit(rules.counts, identity)

    async def caller_sight(self) -> Sees:
        """Return a function that says which graphs the client for whom this task works may see."""
        asking = caller()
        identity = None if asking is None else asking.identity
        return _everything if identity is None else await self.sight(identity)

    async def caller_sees(self, graph: str) -> bool:
        """Return whether the client for whom this task works may see a graph. The server itself
        sees every graph."""
        asking = caller()
        return (
            asking is None or asking.identity is None or await self.may_see(graph, asking.identity)
        )

    async def may_see(self, graph: str, identity: Identity) -> bool:
        """Return whether an identity may see a graph. One that does not exist is seen by owners, and
        by everybody while there is no rule."""
        return may_see(await self._counting(graph), identity)

    async def sight(self, identity: Identity) -> Sees:
        """Return a function that says whether an identity may see the graph with an id."""
        await self._require_current()
        if not self._is_ruled or identity.person.role == OWNER:
            return _everything
        rows = {row.id: row for row in await self._journal.query(_COLUMNS)}

        def sees(graph: str) -> bool:
            row = rows.get(graph)
            if row is None:
                return False
            return may_see(self._of_row(row, rows).counts, identity)

        return sees

    def restricts(self, rule: str | None, folder: str | None) -> bool:
        """Return whether not everybody may see or edit a graph in a folder, with a `rule` as it is
        stored."""
        return self._is_ruled and self.rule_in(folder, _rule(rule)) != OPEN

    async def is_restricted(self, graph: str) -> bool:
        """Return whether not everybody may see or edit a graph."""
        return await self._counting(graph) != OPEN

    async def restrictions(self) -> Callable[[str], bool]:
        """Return a function that says `is_restricted` of the graph with an id."""
        await self._require_current()
        rows = await self._journal.query(_COLUMNS) if self._is_ruled else []
        by_id = {row.id: row for row in rows}
        return frozenset(
            row.id for row in rows if self._of_row(row, by_id).counts != OPEN
        ).__contains__

    async def is_visible(self, identity: Identity) -> ColumnElement[bool] | None:
        """Return a condition for queries of the table of graphs, by which an identity may see a graph
        that is no draft; None if it sees every graph."""
        await self._require_current()
        if not self._is_ruled or identity.person.role == OWNER:
            return None
        ruled = select(_GRAPH.c.rule).where(_GRAPH.c.rule.is_not(None)).distinct()
        rules = [row.rule for row in await self._journal.query(ruled)]
        seen = [text for text in rules if may_see(msgspec.json.decode(text, type=Rule), identity)]
        folders = self.folders_seen(identity)  # not those out of sight: new ones may have come
        by_folder = or_(_GRAPH.c.folder.is_(None), _GRAPH.c.folder.in_(folders))
        by_rule = _GRAPH.c.rule.in_(seen) if seen else false()
        return or_(and_(_GRAPH.c.rule.is_(None), by_folder), by_rule)

    def folders_seen(self, identity: Identity) -> dict[str, str | None]:
        """Return the folder around each folder that an identity may see, by id. A folder in one that
        it may not see is shown as in none."""
        shown = {each for each in self._folders if self.sees_folder(each, identity)}
        return {
            each: parent if (parent := self._folders[each].parent) in shown else None
            for each in shown
        }

    def sees_folder(self, folder: str | None, identity: Identity) -> bool:
        """Return whether an identity may see a folder; None: no folder. While a stored change does not
        count yet, only owners see folders."""
        if folder is not None and self._counted != self._changes:
            return identity.person.role == OWNER
        return may_see(rule_at(None, folder, self._folders), identity)

    def caller_sees_folder(self, folder: str) -> bool:
        """Return whether the client whose request is being answered may see a folder. True where
        the work is for no client, or for one without an identity."""
        asking = caller()
        return (
            asking is None or asking.identity is None or self.sees_folder(folder, asking.identity)
        )

    def caller_is_owner(self) -> bool:
        """Return whether this task works for an owner, or for the server itself."""
        asking = caller()
        identity = None if asking is None else asking.identity
        return identity is None or identity.person.role == OWNER

    def rule_in(self, folder: str | None, own: Rule | None = None) -> Rule:
        """Return the rule that counts for a thing with the rule `own` in a folder."""
        return rule_at(own, folder, self._folders)

    async def rules_of(self, kind: Kind, thing: str) -> Rules:
        """Return the rules of a thing. Raise NotFound if it does not exist."""
        await self._require_current()
        rules = await self._rule_of(kind, thing)
        if rules is None:
            raise NotFound(f"There is no {kind} {thing!r}.")
        return rules

    async def rule_for_graph(self, graph: str, rule: Rule | None, author: str) -> None:
        """Store the rule of a graph; None: that of its folder counts. Raise NotFound for an unknown
        graph, Conflict for a draft, Unavailable if it could not be stored, or not for the runner."""
        rows = await self._journal.query(_ONE, {"id": graph})
        if not rows:
            raise NotFound(f"There is no graph {graph!r}.")
        if rows[0].draft_of is not None:
            raise Conflict("A draft has the rights of its graph; change those.")
        ruled = h.draft(h.RULED, author, h.GraphRuled(rule))
        await self._store(h.about_stream(graph), ruled)

    async def rule_for_folder(self, folder: str, rule: Rule | None, author: str) -> None:
        """Store the rule of a folder; None: that of the folder around it counts. Raise Unavailable as
        `rule_for_graph` does."""
        await self._store(h.FOLDERS, h.draft(h.FOLDER_RULED, author, h.FolderRuled(folder, rule)))

    async def _store(self, stream: str, ruled: Draft) -> None:
        await self.carry_out(partial(self._journal.append, stream, [ruled]))

    async def _rule_of(self, kind: Kind, thing: str) -> Rules | None:
        """Return the rules of a graph, folder or version (which has those of its graph) with the
        id `thing`: its own one and those that it inherits. Return None if there is no such thing."""
        if kind == "folder":
            found = self._folders.get(thing)
            if found is None:
                return None
            return Rules(found.rule, self.rule_in(thing), self.rule_in(found.parent))
        if kind == "version":
            rows = await self._journal.query(_VERSION, {"id": thing})
            if not rows:
                return None
            thing = rows[0].graph
        chain: dict[str, Row[Any]] = {}  # the graph, and the origins of a draft
        wanted: str | None = thing
        while wanted is not None and wanted not in chain:
            found_rows = await self._journal.query(_ONE, {"id": wanted})
            if not found_rows:
                break
            chain[wanted] = found_rows[0]
            wanted = found_rows[0].draft_of
        return self._of_row(chain[thing], chain) if thing in chain else None

    def _of_row(self, row: Row[Any], rows: Mapping[str, Row[Any]]) -> Rules:
        """Return the rules of a graph by its row; a draft has those of its origin, also a draft of a
        draft. `rows`: its row and those of its origins, by id."""
        passed: set[str] = set()
        while row.draft_of is not None:
            passed.add(row.id)
            if row.draft_of not in rows or row.draft_of in passed:
                return Rules(None, CLOSED, CLOSED)
            row = rows[row.draft_of]
        own = _rule(row.rule)
        return Rules(own, self.rule_in(row.folder, own), self.rule_in(row.folder))


def _everything(_: str) -> bool:
    """Return that every graph may be seen."""
    return True


async def sight_of_everything() -> Sees:
    """Return a function that says that every graph may be seen."""
    return _everything


def _rule(text: str | None) -> Rule | None:
    return None if text is None else msgspec.json.decode(text, type=Rule)
