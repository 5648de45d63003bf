"""Checks graphs together with the graphs inside of them, and returns what lists show of each."""

import asyncio
import logging
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping
from contextlib import asynccontextmanager
from hashlib import sha256
from typing import Final

import msgspec

from action_assistant.editor.catalogue.graph_facts import CountsInside, Facts, GraphFacts
from action_assistant.editor.catalogue.graph_names import GraphNames, NamedGraph
from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.cluster.locks import Exclusively, alone
from action_assistant.editor.documents import contents
from action_assistant.editor.documents.contents import Counts, GraphAtSeq, GraphInfo, Inside
from action_assistant.editor.documents.thumbnails import digest_of
from action_assistant.editor.log.graph_events import DocumentKind, graph_stream
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import Forbidden, NotFound, Refused
from action_assistant.journal.journal import Journal
from action_assistant.kit.lru_cache import LruCache
from action_assistant.umrf.problem_kinds import ProblemCounts
from action_assistant.umrf.semantics.matching import BUDGET
from action_assistant.web.auth.caller import Caller, set_caller
from action_assistant.web.workers.lanes import HOPELESS, Crashed

log: Final = logging.getLogger(__name__)

_REMEMBERED: Final = 32  # moments of graphs
_COUNTED: Final = 5000
#: The caller for whom facts are computed in the background: its place in the queue of workers is its own.
_OURSELVES: Final = Caller("facts of graphs")
#: Graphs inside of one. More than that is told, and not looked at.
_INSIDE: Final = 200


class GraphSummary(msgspec.Struct, frozen=True):
    """The facts about a graph that lists show. `damaged`: the first change that cannot be read. `first`: name
    and description of its first action. `thumbnail`: the digest of its thumbnail. A field is None
    where finding it out would take too long, or where there is none."""

    seq: int
    name: str | None = None
    description: str | None = None
    actions: int | None = None
    problems: Counts | None = None
    told: ProblemCounts | None = None
    robots: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()
    damaged: int | None = None
    first: tuple[str, str] | None = None
    thumbnail: str | None = None

    def called(self, kind: DocumentKind) -> tuple[str | None, str | None]:
        """Return the name and the description of a document; for a library document those of its
        action. A value is None if it is not known."""
        return (self.name, self.description) if kind == "graph" or not self.first else self.first


class _Member(msgspec.Struct, frozen=True):
    """A graph inside of another one, by the name of the actions that stand for it."""

    name: str
    graph: str
    seq: int


class NamedInside(msgspec.Struct, frozen=True):
    """The graphs inside of a graph, by name, on which a check depends, too. `several`: names that
    several graphs have; `cut`: more graphs are inside than listed; `hidden`: names that an
    action of the library has, too; `unseen`: graphs are left out that the person may not see;
    `partial`: for somebody who sees every graph there is more to say."""

    members: tuple[_Member, ...] = ()
    several: tuple[str, ...] = ()
    cut: bool = False
    hidden: tuple[str, ...] = ()
    unseen: bool = False
    partial: bool = False

    def __bool__(self) -> bool:
        """Return whether a result depends on any graph inside."""
        return bool(self.members or self.hidden or self.unseen)

    def key(self) -> bytes:
        """Return a digest that is equal for equal graphs after equal changes; empty without any."""
        return sha256(msgspec.msgpack.encode(self)).digest() if self else b""


HIDDEN_INSIDE: Final = (
    "An action of this graph stands for a graph that you may not see. Ask somebody who may see it."
)


async def sees_every_graph(_: str) -> bool:
    """Return that the caller may see a graph, whichever it is."""
    return True


class GraphChecks:
    """Checks graphs, with the graphs inside of them. All that it stores is a cache. Its methods raise
    Unavailable while the journal cannot be read."""

    def __init__(
        self,
        journal: Journal,
        rooms: Rooms,
        reader: GraphReader,
        caller_sees: Callable[[str], Awaitable[bool]] = sees_every_graph,
        exclusively: Exclusively = alone,
    ) -> None:
        self.caller_sees: Final = caller_sees
        self._rooms = rooms
        self._reader = reader
        self.facts: Final = GraphFacts(journal, exclusively)
        self._later: dict[str, int] = {}  # the newest change by graph
        self._wanted = asyncio.Event()
        self._idle = asyncio.Event()
        self._idle.set()
        self.names: Final = GraphNames(journal, self._name, self._known_names)
        self._hopeless = LruCache[str, tuple[int, Refused]](_COUNTED)
        self._problems = LruCache[tuple[str, int, bytes], bytes](_REMEMBERED)
        #: What persons are told who do not see all that is inside.
        self._partial = LruCache[tuple[str, int, bytes], CountsInside](_COUNTED)
        self._digests = LruCache[tuple[str, int], str](_COUNTED)
        self._uses = LruCache[tuple[str, int], tuple[str, tuple[str, ...]]](_REMEMBERED)

    async def problems(self, sight: GraphAtSeq) -> bytes:
        """Return the JSON of the problems of a graph at a change (`sight`), checked with the
        present state of the graphs inside."""
        await self.names.refresh()
        named = await self._resolved(*await self._names_at(sight))
        key = sight.graph, sight.seq, named.key()
        found = self._problems.get(key)
        if found is None:
            inside = await self._seen(named, partly=True)
            found = await self._reader.ask(contents.problems, sight, inside)
            self._problems.put(key, found)
        return found

    async def inside(
        self, *moments: GraphAtSeq, more: Iterable[str] = (), partly: bool = False
    ) -> Inside:
        """Return the graphs inside of a graph, in their present state. The names of its actions are
        read from the graph at each of `moments`, and the names in `more` are added. Raise Forbidden
        if the person may not see one of the graphs; with `partly` these are left out."""
        await self.names.refresh()
        known = [await self._names_at(each) for each in moments]
        uses = [name for _, each in known for name in each]
        named = await self._resolved(known[0][0], (*uses, *more))
        return await self._seen(named, partly=partly)

    async def inside_of(self, graph: str, uses: Iterable[str], *, partly: bool = False) -> Inside:
        """Return the graphs inside of a graph with the name `graph`, whose actions have the names
        `uses`. Raise Forbidden as `inside` does."""
        await self.names.refresh()
        return await self._seen(await self._resolved(graph, uses), partly=partly)

    async def is_taken(self, name: str) -> bool:
        """Return whether an action of the library, or a graph that the person may see, has this
        name."""
        await self.names.refresh()
        graphs = self.names.called(name)
        if not graphs or self.names.is_hidden(name):
            return self.names.is_taken(name)
        return any([await self.caller_sees(graph) for graph in graphs])

    async def named(self, name: str) -> NamedGraph | None:
        """Return the graph that an action of this name stands for; None if there is none that the
        person may see."""
        await self.names.refresh()
        known = self.names.graph(name)
        return known if known is not None and await self.caller_sees(known.graph) else None

    async def digest(self, name: str) -> str | None:
        """Return the digest of the graph that an action of this name stands for now. Return None if
        the name stands for no graph, or if the graph cannot be read."""
        await self.names.refresh()
        known = await self._standing_for(name)
        if known is None or not await self.caller_sees(known[0].graph):
            return None
        key = known[0].graph, known[0].seq
        found = self._digests.get(key)
        if found is None:
            sight = await self._sight(*key)
            found = self._digests.put(key, await self._reader.ask(contents.digest_at, sight))
        return found

    def made(self, graph: str, state: bytes, info: GraphInfo) -> None:
        """Remember the state of a new graph and its facts (`info`), so that neither has to be
        computed again."""
        self._reader.made(graph, state)
        self.facts.put(graph, Facts(1, 1, info))

    async def summary(self, graph: str, newest: int) -> GraphSummary:
        """Return what lists show of a graph, up to its newest change (`newest`: its number). The
        graphs inside are found by the names as of the last refresh. A graph that cannot be read
        gives a summary with that number only."""
        try:
            about = await self._about(graph, newest)
            named = await self._resolved(about.info.name, about.info.uses)
            counts, told = about.info.problems, about.info.told
            if named:
                inside = await self._counted(graph, about, named)
                counts, told = inside.problems, inside.told
        except HOPELESS as error:  # others are in the list too
            log.error("%s: nothing can be said of change %d: %s", graph, newest, error.detail)
            return GraphSummary(newest)
        except Refused:
            raise
        except Exception:  # neither may a document whose contents no worker expected
            log.exception("%s: nothing can be said of change %d", graph, newest)
            return GraphSummary(newest)
        return _summary(about, newest, counts, told)

    def is_known(self, graph: str, newest: int) -> bool:
        """Return whether facts about a graph after its newest change are in memory, so that a
        summary needs no document; also True if that document cannot be read."""
        known = self.facts.get(graph)
        if known is not None and known.is_current and known.newest >= newest:
            return True
        hopeless = self._hopeless.get(graph)
        return hopeless is not None and hopeless[0] >= newest

    def compute_later(self, newest: Mapping[str, int]) -> None:
        """Have the facts about graphs computed in the background. `newest`: the number of the
        newest change of each of these graphs, by the id of the graph."""
        if newest:
            self._later |= newest
            self._idle.clear()
            self._wanted.set()

    @asynccontextmanager
    async def kept_up(self) -> AsyncIterator[None]:
        """Return a context while which names are read ahead, and facts are computed and stored in
        the background."""
        computing = asyncio.create_task(self._compute(), name="facts of graphs")
        try:
            async with self.facts.kept_up(), self.names.read_ahead():
                yield
        finally:
            computing.cancel()
            await asyncio.wait([computing])

    async def computed(self) -> None:
        """Wait until no facts are left to be computed in the background."""
        await self._idle.wait()

    async def _compute(self) -> None:
        set_caller(_OURSELVES)
        while True:
            await self._wanted.wait()
            self._wanted.clear()
            try:
                await self.names.refresh()
            except Refused as error:  # the names that are known serve
                log.warning("the names of graphs are not read: %s", error.detail)
            while self._later:
                graph, newest = self._later.popitem()
                try:
                    await self.summary(graph, newest)
                except Refused as error:
                    log.warning("%s: its facts are not computed: %s", graph, error.detail)
                except Exception:  # whatever one document holds, the others are computed
                    log.exception("%s: its facts cannot be computed", graph)
            self._idle.set()

    def known_summary(self, graph: str, newest: int) -> GraphSummary:
        """Return what is in memory for lists about a graph, without its problems. Without facts
        after its newest change the summary has the number of that change only."""
        known = self.facts.get(graph)
        if known is None or known.newest < newest:
            return GraphSummary(newest)
        return _summary(known, newest, None, None)

    def last_summary(self, graph: str, newest: int) -> GraphSummary:
        """Return what is in memory for lists about a graph, with the problems that were counted last;
        the graphs inside may have changed since."""
        known = self.facts.get(graph)
        if known is None or known.newest < newest:
            return GraphSummary(newest)
        if not known.is_current:
            return _summary(known, newest, None, None)
        counted = known.info if known.inside is None else known.inside
        return _summary(known, newest, counted.problems, counted.told)

    async def _counted(self, graph: str, about: Facts, named: NamedInside) -> CountsInside:
        key = named.key()
        place = graph, about.seq, key
        known = self._partial.get(place) if named.partial else about.inside
        if known is not None and known.key == key:
            return known
        sight = await self._sight(graph, about.seq)
        inside = await self._seen(named, partly=True)
        counted = CountsInside(key, *await self._reader.ask(contents.counted, sight, inside))
        if named.partial:  # lists are sorted by what is true for those who see everything
            return self._partial.put(place, counted)
        now = self.facts.get(graph)
        if now is not None and now.seq == about.seq:  # else an edit came in between
            self.facts.put(graph, msgspec.structs.replace(about, inside=counted))
        return counted

    async def _about(self, graph: str, newest: int, *, of_any_version: bool = False) -> Facts:
        """Return the facts about a graph, without those inside, from the cache or a worker.
        `newest`: the number of its newest change. `of_any_version`: also take facts that another
        version of this program computed. Raise Unavailable if it cannot be read, TooLarge if it
        needs too much memory."""
        known = self.facts.get(graph)
        if known is not None and known.newest >= newest and (known.is_current or of_any_version):
            return known
        hopeless = self._hopeless.get(graph)
        if hopeless is not None and hopeless[0] >= newest:
            raise hopeless[1]
        sight = await self._reader.now(graph)
        try:
            info = await self._reader.ask(contents.info, sight)
        except HOPELESS as error:
            if not isinstance(error, Crashed):  # a worker that died may have held up others
                self._hopeless.put(graph, (newest, error))
            raise
        return self.facts.put(graph, Facts(sight.seq, max(newest, sight.seq), info))

    async def _name(self, graph: str, newest: int, kind: DocumentKind) -> str:
        """Return the name of a document of this kind; of a library document that of its action.
        `newest`: the number of its newest change. Raise Unavailable if it cannot be read, TooLarge
        if it needs too much memory."""
        room = self._rooms.open_room(graph_stream(graph))
        if room is not None and kind == "graph":
            return await room.name()
        return _name_in((await self._about(graph, newest, of_any_version=True)).info, kind)

    async def _known_names(
        self, documents: Mapping[str, tuple[int, DocumentKind]]
    ) -> dict[str, str]:
        """Return the names that are known without reading the documents, by id. `documents`: the
        newest change and the kind of each document. Raise Unavailable if the journal cannot be
        read."""
        await self.facts.recall(documents)
        found: dict[str, str] = {}
        for graph, (newest, kind) in documents.items():
            known = self.facts.get(graph)
            is_open = self._rooms.open_room(graph_stream(graph)) is not None
            if known is not None and known.newest >= newest and not is_open:
                found[graph] = _name_in(known.info, kind)
        return found

    async def _names_at(self, sight: GraphAtSeq) -> tuple[str, tuple[str, ...]]:
        """Return the name of a graph at a change (`sight`), and the names of its actions."""
        key = sight.graph, sight.seq
        found = self._uses.get(key)
        return found or self._uses.put(key, await self._reader.ask(contents.names, sight))

    async def _resolved(self, own: str, uses: Iterable[str]) -> NamedInside:
        """Return the graphs inside of the graph called `own`, which are found level by level by the
        names of its actions (`uses`). An action with the name of the graph that contains it is an
        ordinary action, since no engine runs a graph inside itself."""
        found: dict[str, _Member] = {}
        hidden: set[str] = set()
        level, actions, cut, unseen = [(own, uses)], 0, False, False
        partial = False
        while level:
            below: list[tuple[str, Iterable[str]]] = []
            for graph, names in level:
                for name in self.names.of_graphs(names):
                    if name != graph and self.names.is_hidden(name):
                        hidden.add(name)
                    if name == graph or name in found or not self.names.graph(name):
                        continue
                    about = await self._standing_for(name)
                    if about is None:
                        continue
                    if not await self.caller_sees(about[0].graph):
                        unseen = True
                        continue
                    if len(found) >= _INSIDE or actions + about[1].actions > BUDGET:
                        cut = True
                        continue
                    found[name], info = about
                    actions += info.actions
                    below.append((name, info.uses))
            level = below
        members = tuple(found[name] for name in sorted(found))
        several: list[str] = []
        for each in members:
            graphs = self.names.called(each.name)
            seen = [await self.caller_sees(graph) for graph in graphs] if len(graphs) > 1 else []
            if sum(seen) > 1:  # of those out of sight nothing tells
                several.append(each.name)
            partial = partial or not all(seen)
        listed = members, tuple(several), cut, tuple(sorted(hidden)), unseen
        return NamedInside(*listed, partial or unseen)

    async def _standing_for(self, name: str) -> tuple[_Member, GraphInfo] | None:
        known = self.names.graph(name)
        if known is None:
            return None
        try:
            about = await self._about(known.graph, known.seq, of_any_version=True)
        except (*HOPELESS, NotFound):
            return None
        if about.info.name != name:  # renamed meanwhile; the next call has the new name
            return None
        return _Member(name, known.graph, about.seq), about.info

    async def _seen(self, named: NamedInside, *, partly: bool = False) -> Inside:
        if named.unseen and not partly:
            raise Forbidden(HIDDEN_INSIDE)
        graphs = [(each.name, await self._sight(each.graph, each.seq)) for each in named.members]
        return Inside(tuple(graphs), named.several, named.cut, named.hidden, named.unseen)

    async def _sight(self, graph: str, seq: int) -> GraphAtSeq:
        """Return a graph after its change `seq`, or in its newest readable state if its history is
        damaged before that. Raise Unavailable if the journal cannot be read."""
        try:
            return await self._reader.at(graph, seq)
        except Refused:  # its history is damaged after that
            return await self._reader.now(graph)


def _name_in(info: GraphInfo, kind: DocumentKind) -> str:
    if kind == "graph":
        return info.name
    return info.first[0] if info.first is not None else ""


def _summary(
    about: Facts, newest: int, problems: Counts | None, told: ProblemCounts | None
) -> GraphSummary:
    info = about.info
    return GraphSummary(
        about.seq,
        info.name,
        info.description,
        info.actions,
        problems,
        told,
        info.robots,
        info.labels,
        about.seq + 1 if about.seq < newest else None,
        info.first,
        digest_of(info.thumbnail),
    )
