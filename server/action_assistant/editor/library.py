"""The actions that all graphs together know: each name once, with what is said of it."""

from collections.abc import Iterable
from datetime import datetime

import msgspec
from sqlalchemy import select

from action_assistant.editor import happenings as h
from action_assistant.editor.contents import Sight, read
from action_assistant.editor.sights import Sights
from action_assistant.journal import tables
from action_assistant.journal.journal import Journal
from action_assistant.umrf.jsontext import dump, parse_small
from action_assistant.umrf.model import Action, Graph, JsonText, Parameter


class Taking(msgspec.Struct, frozen=True):
    """One parameter. `path` joins keys with `/` as in UMRF; no `pvf_type`: the file names none.

    `text` is its JSON as a new use begins with it: without a value.
    """

    path: str
    pvf_type: str | None
    required: bool
    text: JsonText


class Known(msgspec.Struct, frozen=True):
    """An action of the library.

    Parameters are those of all graphs together; of what they say differently, and of descriptions
    and types, the graph changed last counts. `first_seen` is when the first of them was made.
    """

    name: str
    description: str
    type: str
    inputs: tuple[Taking, ...]
    outputs: tuple[Taking, ...]
    used_in: tuple[str, ...]
    first_seen: datetime


class Use(msgspec.Struct, frozen=True):
    """A graph that uses actions, and when it was made, in microseconds."""

    graph: str
    made_at: int


class Library:
    """Reads a graph again only when it has changed."""

    def __init__(self, journal: Journal, sights: Sights) -> None:
        self._journal = journal
        self._sights = sights
        self._read: dict[str, tuple[int, bytes]] = {}
        self._shown: tuple[dict[str, int], bytes] = {}, b"[]"

    async def all(self) -> bytes:
        """Every action that a graph uses, by name: JSON of a list of `Known`. Graphs that cannot be
        read are left out."""
        graph, event = tables.graph, tables.editor_event
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
                last.scalar_subquery().label("seq"),
                last.with_only_columns(event.c.at).scalar_subquery().label("at"),
            )
            .where(graph.c.deleted_at.is_(None))
            .order_by(graph.c.made_at, graph.c.id)
        )
        for row in rows:
            await self._refresh(row.id, row.seq)
        seqs = {row.id: self._read[row.id][0] for row in rows}
        if self._shown[0] != seqs:
            self._read = {row.id: self._read[row.id] for row in rows}
            newest_first = sorted(rows, key=lambda row: row.at, reverse=True)
            uses = [(Use(row.id, row.made_at), self._read[row.id][1]) for row in newest_first]
            self._shown = seqs, await self._sights.ask(merged, uses)
        return self._shown[1]

    async def _refresh(self, graph: str, seq: int) -> None:
        known = self._read.get(graph)
        if known is None or known[0] < seq:
            sight = await self._sights.now(graph)
            self._read[graph] = sight.seq, await self._sights.ask(used, sight)


def used(sight: Sight) -> bytes:
    """The actions of a graph that differ in what a library says of them. For workers."""
    return msgspec.msgpack.encode(_distinct(read(sight).moment.graph))


def merged(graphs: list[tuple[Use, bytes]]) -> bytes:
    """JSON of what several graphs know, the last changed first. For workers."""
    uses: dict[str, list[tuple[Use, Action]]] = {}
    for graph, actions in graphs:
        for action in msgspec.msgpack.decode(actions, type=tuple[Action, ...]):
            uses.setdefault(action.name, []).append((graph, action))
    return msgspec.json.encode([_known(name, uses[name]) for name in sorted(uses)])


def _known(name: str, uses: list[tuple[Use, Action]]) -> Known:
    by_age = sorted({(use.made_at, use.graph) for use, _ in uses})
    actions = [action for _, action in uses]
    return Known(
        name=name,
        description=next((a.description for a in actions if a.description), ""),
        type=actions[0].type,
        inputs=_together(action.inputs for action in actions),
        outputs=_together(action.outputs for action in actions),
        used_in=tuple(graph for _, graph in by_age),
        first_seen=h.when(by_age[0][0]),
    )


def _together(lists: Iterable[tuple[Parameter, ...]]) -> tuple[Taking, ...]:
    found: dict[str, Taking] = {}
    for parameters in lists:
        for parameter in parameters:
            if parameter.path not in found:
                found[parameter.path] = _taking(parameter)
    return tuple(found.values())


def _taking(parameter: Parameter) -> Taking:
    leaf = parse_small(parameter.text)
    if not isinstance(leaf, dict):
        return Taking(parameter.path, None, required=True, text=parameter.text)
    kind = leaf.get("pvf_type")
    return Taking(
        parameter.path,
        kind if isinstance(kind, str) else None,
        required=leaf.get("pvf_required") is not False,
        text=dump({name: value for name, value in leaf.items() if name != "pvf_value"}),
    )


def _distinct(graph: Graph) -> tuple[Action, ...]:
    """The actions that differ in what a library says of them; one that is only named is none."""
    found: dict[object, Action] = {}
    for action in graph.actions:
        if action.missing:
            continue
        sort = action.name, action.type, action.description, action.inputs, action.outputs
        found.setdefault(sort, action)
    return tuple(found.values())
