"""Stores the facts that lists show of each graph, so that after a restart no document is read for them.

The table is a cache: a row that is missing, or that another version of this program wrote, is
computed again from the document.
"""

import asyncio
import logging
import re
import sys
import unicodedata
from collections.abc import AsyncIterator, Collection, Sequence
from contextlib import asynccontextmanager
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any, Final, NamedTuple

import msgspec
from sqlalchemy import Connection, Row, delete, func, insert, select, update

from action_assistant.editor.cluster.locks import Exclusively, alone
from action_assistant.editor.documents.contents import Counts, GraphInfo
from action_assistant.errors import Refused
from action_assistant.journal.journal import Journal
from action_assistant.kit.lru_cache import LruCache
from action_assistant.schema.editor_tables import editor_event, graph_facts, graph_label
from action_assistant.umrf.problem_kinds import ProblemCounts

log: Final = logging.getLogger(__name__)

_REMEMBERED: Final = 20_000  # graphs
_NAMES: Final = 500_000  # of actions, over all graphs that are remembered
_AS_A_NAME: Final = 64  # bytes of a thumbnail that count as one name
_ROWS: Final = 200  # in one query or transaction
_PERIOD: Final = 1.0  # seconds between two transactions
#: The code on which the facts depend.
_SOURCES: Final = ("umrf", "editor/documents", "editor/crdt")
_WORDS: Final = 20_000  # characters of a graph that are searched
_MOST: Final = (1 << 15) - 1  # of each kind of problem in `worst`
_DIGITS: Final = re.compile("[0-9]+")
#: The form of a row that is known to be older than its document.
_OUTDATED: Final = b""


class CountsInside(msgspec.Struct, frozen=True):
    """The problems of a graph together with the graphs inside of it, of which `key` is the digest."""

    key: bytes
    problems: Counts
    told: ProblemCounts


class Facts(msgspec.Struct, frozen=True):
    """The facts about a graph after its change `seq`, the last one that can be read. `newest`: its
    last change when they were computed. `is_current`: this version of the program computed them;
    the problems of others may be counted in another way."""

    seq: int
    newest: int
    info: GraphInfo
    inside: CountsInside | None = None
    is_current: bool = True


#: The name of work on the table.
_TABLE: Final = "facts of graphs"


class ChangedGraph(NamedTuple):
    """A graph after its newest change, `seq`. `name`, `description`: as its catalogue has them."""

    id: str
    seq: int
    name: str
    description: str


class GraphFacts:
    """Remembers the facts about graphs: in memory, and in a table for lists and for the next
    start."""

    def __init__(self, journal: Journal, exclusively: Exclusively = alone) -> None:
        self._journal = journal
        self._exclusively = exclusively
        self._known = LruCache[str, Facts](_REMEMBERED, _NAMES)
        self._unwritten: dict[str, Facts] = {}
        self._changed = asyncio.Event()

    def get(self, graph: str) -> Facts | None:
        """Return what is in memory about the graph with this id; None if that is nothing."""
        return self._known.get(graph)

    def put(self, graph: str, facts: Facts) -> Facts:
        """Remember facts that were computed now, and return them."""
        self._unwritten[graph] = facts
        self._changed.set()
        return self._put(graph, facts)

    async def recall(self, graphs: Collection[str]) -> None:
        """Load the stored facts about the graphs with these ids into memory, except where memory
        has facts about a graph already. Raise Unavailable if the journal cannot be read."""
        missing = [graph for graph in graphs if self._known.get(graph) is None]
        for start in range(0, len(missing), _ROWS):
            some = missing[start : start + _ROWS]
            rows = await self._journal.query(
                select(graph_facts).where(graph_facts.c.graph.in_(some))
            )
            for row in rows:
                found = _stored(row)
                if (
                    found is not None and self._known.get(row.graph) is None
                ):  # an edit may have come first
                    self._put(row.graph, found)

    async def note_changes(self, changed: Sequence[ChangedGraph]) -> None:
        """Store when graphs changed last, before the facts about them are computed: until then
        lists find them by what was known before. Raise Unavailable if the journal cannot be
        written."""
        for start in range(0, len(changed), _ROWS):
            some = changed[start : start + _ROWS]
            async with self._exclusively(_TABLE):
                await self._journal.derive(partial(_note_changes, some))

    async def write(self) -> None:
        """Write the facts that are in memory only, so that queries of the table find them."""
        if self._unwritten:
            await self._write()

    @asynccontextmanager
    async def kept_up(self) -> AsyncIterator[None]:
        """Return a context while which new facts are written in the background, and at its end."""
        writing = asyncio.create_task(self._keep_writing(), name="facts of graphs")
        try:
            yield
        finally:
            writing.cancel()
            await asyncio.wait([writing])
            await self._write()

    async def _keep_writing(self) -> None:
        while True:
            await self._changed.wait()
            await asyncio.sleep(_PERIOD)  # of many edits only the last one counts
            await self._write()

    async def _write(self) -> None:
        self._changed.clear()
        unwritten, self._unwritten = self._unwritten, {}
        graphs = list(unwritten)
        for start in range(0, len(graphs), _ROWS):
            some = [(graph, unwritten[graph]) for graph in graphs[start : start + _ROWS]]
            try:
                async with self._exclusively(_TABLE):
                    await self._journal.derive(partial(_store, some))
            except Refused as error:  # the next start computes them again
                log.warning("facts of %d graphs are not stored: %s", len(some), error.detail)

    def _put(self, graph: str, facts: Facts) -> Facts:
        uses = tuple(map(sys.intern, facts.info.uses))  # most graphs use the same actions
        info = msgspec.structs.replace(facts.info, uses=uses)
        weight = len(uses) + len(info.thumbnail) // _AS_A_NAME
        return self._known.put(graph, msgspec.structs.replace(facts, info=info), weight)


@cache
def form() -> bytes:
    """Return a digest of the code that computes the facts, in bytes. Facts of another version have another one."""
    package = Path(__file__).resolve().parents[2]
    files = sorted(path for each in _SOURCES for path in (package / each).rglob("*.py"))
    return sha256(b"".join(sha256(path.read_bytes()).digest() for path in files)).digest()


def name_key(name: str) -> bytes:
    """Return a key by which names are sorted as people do: without regard to case and accents, and
    numbers by their size."""
    plain = unicodedata.normalize("NFKD", name).casefold()
    letters = "".join(each for each in plain if not unicodedata.combining(each))
    return _DIGITS.sub(_number_key, letters).encode(errors="replace")


def _number_key(found: re.Match[str]) -> str:
    digits = found[0].lstrip("0")
    return f"0{len(digits):06}{digits}"


def _row(graph: str, facts: Facts, seq: int, stamp: bytes) -> dict[str, Any]:
    """Return the row of a graph, known to be right up to its change `seq` if `stamp` is that of
    this program."""
    listed = _listed(facts.info, facts.inside)
    return {
        "graph": graph,
        "form": stamp,
        "facts": msgspec.msgpack.encode(facts),
        "seq": seq,
        "labels": facts.info.labels,
        **listed,
    }


def _listed(info: GraphInfo, inside: CountsInside | None) -> dict[str, object]:
    """Return by what lists sort and search a graph, by column."""
    alone = _worst(info.problems, info.told)
    return {
        "actions": info.actions,
        "worst": alone if inside is None else _worst(inside.problems, inside.told),
        "worst_alone": alone,
        **_called(info.name, (info.name, info.description, *info.robots, *info.labels)),
    }


def _called(name: str, texts: Sequence[str]) -> dict[str, object]:
    words = _storable(" ".join(texts).lower())[:_WORDS]
    return {"name": _storable(name), "name_key": name_key(name), "words": words}


def _storable(text: str) -> str:
    """Return text as Postgres stores it: without characters that are none."""
    return text.encode(errors="replace").decode().replace("\0", " ")


def _worst(problems: Counts, told: ProblemCounts) -> int:
    """Return counts as one number: mistakes come before what is to fill in, both before the rest."""
    number = 0
    for count in (told.wrong, told.to_fill_in, problems.error, problems.warning):
        number = number << 15 | min(count, _MOST)
    return number


def _stored(row: Row[Any]) -> Facts | None:
    """Return the facts in a row of the table; None if it has none that can be read."""
    if not row.facts:
        return None
    try:
        found = msgspec.msgpack.decode(row.facts, type=Facts)
    except msgspec.DecodeError as error:
        log.warning("%s: the stored facts cannot be read: %s", row.graph, error)
        return None
    return msgspec.structs.replace(found, is_current=row.form == form())


def _store(some: Sequence[tuple[str, Facts]], connection: Connection) -> None:
    """Write facts, unless a later change of their graph is known already."""
    found = select(graph_facts.c.graph, graph_facts.c.seq)
    rows = connection.execute(found.where(graph_facts.c.graph.in_([graph for graph, _ in some])))
    known = {row.graph: row.seq for row in rows}
    _replace(
        [
            _row(graph, facts, facts.newest, form())
            for graph, facts in some
            if facts.newest >= known.get(graph, 0)
        ],
        connection,
    )


def _note_changes(changed: Sequence[ChangedGraph], connection: Connection) -> None:
    chosen = select(graph_facts).where(graph_facts.c.graph.in_([each.id for each in changed]))
    stored = {row.graph: row for row in connection.execute(chosen)}
    rows: list[dict[str, Any]] = []
    for graph in changed:
        row = stored.get(graph.id)
        facts = None if row is None else _stored(row)
        if facts is not None:
            is_right = facts.is_current and facts.newest >= graph.seq
            rows.append(_row(graph.id, facts, graph.seq, form() if is_right else _OUTDATED))
        else:
            called = _called(graph.name, (graph.name, graph.description))
            counts = {"actions": 0, "worst": 0, "worst_alone": 0}
            rest = {"form": _OUTDATED, "facts": b"", "seq": graph.seq, "labels": ()}
            rows.append({"graph": graph.id, **rest, **counts, **called})
    _replace(rows, connection)


def _replace(rows: Sequence[dict[str, Any]], connection: Connection) -> None:
    """Replace rows of graphs with their labels."""
    graphs = [row["graph"] for row in rows]
    if not graphs:
        return
    is_one = graph_facts.c.graph.in_(graphs)
    connection.execute(delete(graph_facts).where(is_one))
    connection.execute(delete(graph_label).where(graph_label.c.graph.in_(graphs)))
    columns = [{key: row[key] for key in row if key != "labels"} for row in rows]
    connection.execute(insert(graph_facts), columns)
    labels = [
        {"graph": row["graph"], "label": label}
        for row in rows
        for label in dict.fromkeys(map(_storable, row["labels"]))
    ]
    if labels:
        connection.execute(insert(graph_label), labels)
    at = select(editor_event.c.at).where(
        editor_event.c.stream == "graph/" + graph_facts.c.graph,
        editor_event.c.seq == graph_facts.c.seq,
    )
    connection.execute(
        update(graph_facts).where(is_one).values(changed_at=func.coalesce(at.scalar_subquery(), 0))
    )
