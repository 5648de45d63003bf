"""Folders of graphs: made, renamed, moved and removed, and graphs moved between them.

A folder is no more than a place. Removing one moves its contents into the folder around it.
"""

import asyncio
from collections import Counter
from collections.abc import Mapping
from functools import partial
from typing import Final, Literal

import msgspec
from msgspec.structs import replace
from sqlalchemy import func, select

from action_assistant.editor.catalogue.graph_rights import GraphRights
from action_assistant.editor.log import graph_events as h
from action_assistant.errors import BadInput, Conflict, Forbidden, NotFound
from action_assistant.journal.journal import Journal
from action_assistant.random_ids import random_id
from action_assistant.safe_text import is_name
from action_assistant.schema import editor_tables
from action_assistant.web.auth.graph_rules import OPEN
from action_assistant.web.auth.identity import Identity

NAME_LIMIT: Final = 100  # characters
DEPTH_LIMIT: Final = 8  # folders in one another
COUNT_LIMIT: Final = 1_000


class Folder(msgspec.Struct, frozen=True, omit_defaults=True):
    """A folder of graphs. `parent`: the folder in which it lies, if any. `graphs`: how many graphs
    lie in it, without those in the folders inside of it. `restricted`: not everybody may see or
    edit the graphs in it."""

    id: str
    name: str
    parent: str | None = None
    graphs: int = 0
    restricted: bool = False


class Folders:
    """All folders of graphs. Its methods raise NotFound for an id that is unknown, Unavailable
    while the journal cannot be used."""

    def __init__(self, journal: Journal, rights: GraphRights) -> None:
        self._journal = journal
        self._rights = rights
        self._changing = asyncio.Lock()  # two moves at once could make a circle

    async def all(self) -> list[Folder]:
        """Return all folders, sorted by name."""
        folder, graph = editor_tables.folder.c, editor_tables.graph.c
        listed = graph.deleted_at.is_(None), graph.draft_of.is_(None), graph.folder.is_not(None)
        counts = select(graph.folder, func.count().label("graphs")).where(*listed)
        inside = {
            row.folder: row.graphs
            for row in await self._journal.query(counts.group_by(graph.folder))
        }
        rows = await self._journal.query(select(folder.id, folder.name, folder.parent))
        found = [Folder(row.id, row.name, row.parent, inside.get(row.id, 0)) for row in rows]
        return sorted(found, key=lambda each: (each.name.casefold(), each.name, each.id))

    async def seen_by(self, identity: Identity) -> list[Folder]:
        """Return the folders that an identity may see, with the counts of the graphs that it may
        see. A folder in one that it may not see is shown as in none."""
        sees = await self._rights.sight(identity)
        graph = editor_tables.graph.c
        listed = graph.deleted_at.is_(None), graph.draft_of.is_(None), graph.folder.is_not(None)
        rows = await self._journal.query(select(graph.id, graph.folder).where(*listed))
        counts = Counter(row.folder for row in rows if sees(row.id))
        shown = [each for each in await self.all() if self._rights.sees_folder(each.id, identity)]
        ids = {each.id for each in shown}
        return [
            replace(
                each,
                graphs=counts[each.id],
                parent=each.parent if each.parent in ids else None,
                restricted=self._rights.rule_in(each.id) != OPEN,
            )
            for each in shown
        ]

    async def require(self, folder: str) -> None:
        """Raise NotFound unless there is a folder with this id."""
        _one(await self._known(), folder)

    async def make(self, name: str, parent: str | None, author: str) -> Folder:
        """Make a folder in the folder `parent` (None: in no folder), and return it. Raise BadInput
        for a bad name, Conflict if the name is taken there, the folders would be too many or lie
        too deep."""
        name = fit_name(name)
        async with self._changing:
            known = await self._known()
            if len(known) >= COUNT_LIMIT:
                raise Conflict(f"There are {COUNT_LIMIT} folders already.")
            made = Folder(random_id(), name, parent)
            self._check_place(known, made)
            await self._append(h.FOLDER_MADE, author, h.FolderState(made.id, name, parent))
        return made

    async def rename(self, folder: str, name: str, author: str) -> Folder:
        """Give a folder another name, and return it. Raise BadInput for a bad name, Conflict if it
        is taken."""
        name = fit_name(name)
        async with self._changing:
            known = await self._known()
            return await self._change(known, replace(_one(known, folder), name=name), author)

    async def move(self, folder: str, parent: str | None, author: str) -> Folder:
        """Move a folder with its contents into the folder `parent` (None: out of all folders), and
        return it. Raise Conflict if it would lie in itself or too deep, or if its name is taken
        there."""
        async with self._changing:
            known = await self._known()
            moved = replace(_one(known, folder), parent=parent)
            await self._check_rule("folder", folder, parent, keeps=True)
            return await self._change(known, moved, author)

    async def remove(self, folder: str, author: str) -> None:
        """Remove a folder. Its graphs and folders move into the folder around it."""
        async with self._changing:
            gone = _one(await self._known(), folder)
            await self._check_rule("folder", folder, gone.parent)
            body = h.FolderRemoved(gone.id, gone.parent)
            await self._append(h.FOLDER_REMOVED, author, body)

    async def file(self, graph: str, folder: str | None, author: str) -> None:
        """Move a graph into a folder (None: out of all folders). Raise NotFound if there is no such
        graph or folder, Conflict if it is a draft or an action of the library."""
        table = editor_tables.graph.c
        columns = table.deleted_at, table.kind, table.draft_of, table.folder
        rows = await self._journal.query(select(*columns).where(table.id == graph))
        if not rows or rows[0].deleted_at is not None:
            raise NotFound(f"There is no graph {graph!r}.")
        if rows[0].kind != "graph":
            raise Conflict("Actions of the library lie in no folder.")
        if rows[0].draft_of is not None:
            raise Conflict("A draft stays with its graph; move that one.")
        async with self._changing:
            if folder is not None:
                await self.require(folder)
            if rows[0].folder != folder:
                await self._check_rule("graph", graph, folder, keeps=True)
                filed = h.draft(h.FILED, author, h.GraphFiled(folder))
                store = partial(self._journal.append, h.about_stream(graph), [filed])
                await self._rights.carry_out(store)

    async def _check_rule(
        self, kind: Literal["graph", "folder"], thing: str, into: str | None, *, keeps: bool = False
    ) -> None:
        """Raise Forbidden if a change of place would change who may see or edit something, since
        only owners decide that. `into`: the folder into which a thing, or the contents of a folder,
        go. `keeps`: the thing keeps its own rule, if it has one."""
        own, counts, _ = await self._rights.rules_of(kind, thing)
        after = self._rights.rule_in(into, own if keeps else None)
        if after != counts and not self._rights.caller_is_owner():
            raise Forbidden("Other people would then see or edit it. Ask an owner to do this.")

    def _check_place(self, known: Mapping[str, Folder], now: Folder) -> None:
        """Check that a folder may have this name and place. Raise NotFound if its parent does not
        exist, Conflict if it would lie in itself or too deep, or if a folder beside it that the
        person sees is called alike."""
        above = _way(known, now.parent)
        if now.id in above:
            raise Conflict("A folder cannot lie in itself.")
        if len(above) + _height(known, now.id) > DEPTH_LIMIT:
            raise Conflict(f"At most {DEPTH_LIMIT} folders lie in one another.")
        beside = (
            each for each in known.values() if each.parent == now.parent and each.id != now.id
        )
        alike = (each for each in beside if each.name.casefold() == now.name.casefold())
        if any(self._rights.caller_sees_folder(each.id) for each in alike):
            raise Conflict("A folder of this name is there already.", where={"path": "/name"})

    async def _change(self, known: Mapping[str, Folder], now: Folder, author: str) -> Folder:
        """Store the new name or place of a folder (`now`), if it differs from the present one;
        return the folder. `known`: all folders by id."""
        self._check_place(known, now)
        if known[now.id] != now:
            body = h.FolderState(now.id, now.name, now.parent)
            await self._append(h.FOLDER_CHANGED, author, body)
        return now

    async def _known(self) -> dict[str, Folder]:
        return {each.id: each for each in await self.all()}

    async def _append(self, kind: str, author: str, body: msgspec.Struct) -> None:
        drafts = [h.draft(kind, author, body)]
        await self._rights.carry_out(partial(self._journal.append, h.FOLDERS, drafts))


def fit_name(name: str) -> str:
    """Return the name of a folder with single spaces. Raise BadInput if it is empty or too long, or
    has control characters or a slash, which separates folders in paths."""
    name = " ".join(name.split())
    if not name or len(name) > NAME_LIMIT:
        raise BadInput(f"A name has 1 to {NAME_LIMIT} characters.", where={"path": "/name"})
    if not is_name(name):
        raise BadInput("A name has no control characters.", where={"path": "/name"})
    if "/" in name:
        raise BadInput("The name of a folder has no slash.", where={"path": "/name"})
    return name


def _one(known: Mapping[str, Folder], folder: str) -> Folder:
    if folder not in known:
        raise NotFound(f"There is no folder {folder!r}.")
    return known[folder]


def _way(known: Mapping[str, Folder], folder: str | None) -> list[str]:
    """Return the ids of a folder and of those around it, the outermost last; none for None.
    `known`: all folders by id."""
    way: list[str] = []
    while folder is not None and folder not in way:
        way.append(folder)
        folder = _one(known, folder).parent
    return way


def _height(known: Mapping[str, Folder], folder: str) -> int:
    """Return how many levels of folders there are from this one downwards, at least 1. `known`: all
    folders by id."""
    depths = Counter({folder: 0})
    for each in known:
        way = _way(known, each)
        if folder in way:
            depths[each] = way.index(folder)
    return max(depths.values()) + 1
