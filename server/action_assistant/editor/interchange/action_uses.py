"""The actions of graphs as a library tells of them: each name once. For workers."""

from collections.abc import Iterable
from datetime import datetime
from typing import Final

import msgspec

from action_assistant.editor.documents.contents import GraphAtSeq, read
from action_assistant.editor.log.document_events import when
from action_assistant.umrf.json.text import dump, parse_small
from action_assistant.umrf.model import Action, Graph, JsonText, Parameter


class LibraryParameter(msgspec.Struct, frozen=True):
    """One parameter. `path` joins keys with `/` as in UMRF; no `pvf_type`: the file names none.

    `text` is its JSON as a new use begins with it: without a value.
    """

    path: str
    pvf_type: str | None
    required: bool
    text: JsonText


class LibraryAction(msgspec.Struct, frozen=True):
    """An action of the library.

    Parameters are those of all graphs together; of what they say differently, and of descriptions
    and types, the graph changed last counts. `first_seen` is when the first of them was made.
    """

    name: str
    description: str
    type: str
    inputs: tuple[LibraryParameter, ...]
    outputs: tuple[LibraryParameter, ...]
    used_in: tuple[str, ...]
    first_seen: datetime


class GraphUse(msgspec.Struct, frozen=True):
    """A graph that uses actions, and when it was made, in microseconds."""

    graph: str
    made_at: int


#: Of a graph that cannot be read.
NOTHING: Final = msgspec.msgpack.encode(())


def used(sight: GraphAtSeq) -> bytes:
    """The actions of a graph that differ in what a library says of them."""
    return msgspec.msgpack.encode(_distinct(read(sight).moment.graph))


def merged(graphs: list[tuple[GraphUse, bytes]]) -> bytes:
    """JSON of what several graphs know, the last changed first."""
    uses: dict[str, list[tuple[GraphUse, Action]]] = {}
    for graph, actions in graphs:
        for action in msgspec.msgpack.decode(actions, type=tuple[Action, ...]):
            uses.setdefault(action.name, []).append((graph, action))
    return msgspec.json.encode([_known(name, uses[name]) for name in sorted(uses)])


def _known(name: str, uses: list[tuple[GraphUse, Action]]) -> LibraryAction:
    by_age = sorted({(use.made_at, use.graph) for use, _ in uses})
    actions = [action for _, action in uses]
    return LibraryAction(
        name=name,
        description=next((a.description for a in actions if a.description), ""),
        type=actions[0].type,
        inputs=_together(action.inputs for action in actions),
        outputs=_together(action.outputs for action in actions),
        used_in=tuple(graph for _, graph in by_age),
        first_seen=when(by_age[0][0]),
    )


def _together(lists: Iterable[tuple[Parameter, ...]]) -> tuple[LibraryParameter, ...]:
    found: dict[str, LibraryParameter] = {}
    for parameters in lists:
        for parameter in parameters:
            if parameter.path not in found:
                found[parameter.path] = _taking(parameter)
    return tuple(found.values())


def _taking(parameter: Parameter) -> LibraryParameter:
    leaf = parse_small(parameter.text)
    if not isinstance(leaf, dict):
        return LibraryParameter(parameter.path, None, required=True, text=parameter.text)
    kind = leaf.get("pvf_type")
    return LibraryParameter(
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
