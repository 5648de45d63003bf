"""The actions of the library's documents and of graphs, as a list tells of them: each name once. For
workers."""

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Final

import msgspec

from action_assistant.editor.documents.contents import GraphAtSeq, first_action, labels_of, read
from action_assistant.editor.log.graph_events import DocumentKind, when
from action_assistant.umrf.action_updates import is_like
from action_assistant.umrf.json.text import parse_small
from action_assistant.umrf.model import Action, Graph, JsonText, Parameter
from action_assistant.umrf.parameters import without_value
from action_assistant.umrf.signatures import action_of_graph


class LibraryParameter(msgspec.Struct, frozen=True):
    """One parameter. `path`: keys joined with `/` as in UMRF. `pvf_type`: missing if the file names
    none. `text`: the JSON with which a new use begins: with the value of a library document, but
    without values of graphs."""

    path: str
    pvf_type: str | None
    required: bool
    text: JsonText


class LibraryAction(msgspec.Struct, frozen=True, kw_only=True):
    """An action of the library, or one that graphs use.

    `document`: its document in the library, `seq` the last change of that document. Without a
    document, the parameters are those of all graphs together; where graphs differ, the graph
    changed last counts. `differs_in`: the graphs of `used_in` that use it with other parameters
    than the document has. `first_seen`: when the first document or graph with it was made.
    """

    name: str
    description: str
    type: str
    inputs: tuple[LibraryParameter, ...]
    outputs: tuple[LibraryParameter, ...]
    used_in: tuple[str, ...]
    first_seen: datetime
    document: str | None = None
    seq: int | None = None
    labels: tuple[str, ...] = ()
    differs_in: tuple[str, ...] = ()


class GraphAsAction(msgspec.Struct, frozen=True):
    """A graph as the action that stands for it in other graphs: its inputs are those that its first
    actions lack, its outputs those of its last action. A robot runs it if it has indexed the
    graph."""

    graph: str
    name: str
    description: str
    inputs: tuple[LibraryParameter, ...]
    outputs: tuple[LibraryParameter, ...]


class ActionSource(msgspec.Struct, frozen=True):
    """A document that has actions, and when it was made, in microseconds."""

    document: str
    made_at: int
    seq: int
    kind: DocumentKind


class FoundActions(msgspec.Struct, frozen=True):
    """The distinct actions of a document, and its labels. `whole`: the action that stands for a
    graph; None if the graph has no name or no actions."""

    actions: tuple[Action, ...] = ()
    labels: tuple[str, ...] = ()
    whole: Action | None = None


#: The entry of a document that cannot be read.
NOTHING: Final = msgspec.msgpack.encode(FoundActions())


def found(sight: GraphAtSeq, kind: DocumentKind) -> bytes:
    """Return the actions of a document at a change (`sight`), as msgpack of `FoundActions`. `kind`:
    a graph, or an action of the library."""
    graph = read(sight).moment.graph
    if kind == "graph":
        actions = _distinct(graph)
        whole = action_of_graph(graph) if graph.name and actions else None
        return msgspec.msgpack.encode(FoundActions(actions, whole=whole))
    action = first_action(graph)
    own = () if action is None or not action.name else (action,)
    return msgspec.msgpack.encode(FoundActions(own, labels_of(graph)))


def merged(sources: list[tuple[ActionSource, bytes]]) -> bytes:
    """Return all actions of the library's documents and of graphs as JSON: a list of
    `LibraryAction`, ordered by name. `sources` are documents, the last changed first, each with
    its actions as `found` encodes them."""
    uses: dict[str, list[tuple[ActionSource, Action]]] = {}
    known: list[tuple[ActionSource, Action, tuple[str, ...]]] = []
    for source, text in sources:
        of = msgspec.msgpack.decode(text, type=FoundActions)
        for action in of.actions:
            if source.kind == "action":
                known.append((source, action, of.labels))
            else:
                uses.setdefault(action.name, []).append((source, action))
    listed = [
        _of_document(source, action, labels, uses.get(action.name, []))
        for source, action, labels in known
    ]
    names = {action.name for _, action, _ in known}
    listed += [_of_uses(name, each) for name, each in uses.items() if name not in names]
    # Two documents of one name are possible, since people rename at the same time.
    return msgspec.json.encode(sorted(listed, key=lambda each: (each.name, each.first_seen)))


def as_actions(sources: list[tuple[ActionSource, bytes]]) -> bytes:
    """Return the JSON of a list of `GraphAsAction`, sorted by name; of equal names the oldest
    first, for which actions of that name stand. `sources`: documents, each with its actions as
    `found` encodes them."""
    aged = sorted(sources, key=lambda each: (each[0].made_at, each[0].document))
    listed = [
        GraphAsAction(
            source.document,
            whole.name,
            whole.description,
            tuple(map(_described, whole.inputs)),
            tuple(map(_described, whole.outputs)),
        )
        for source, text in aged
        if (whole := msgspec.msgpack.decode(text, type=FoundActions).whole) is not None
    ]
    return msgspec.json.encode(sorted(listed, key=lambda each: each.name))


def _by_age(uses: list[tuple[ActionSource, Action]]) -> tuple[str, ...]:
    """Return the ids of the graphs in `uses`, the oldest first, each once."""
    ordered = sorted(uses, key=lambda use: (use[0].made_at, use[0].document))
    return tuple(dict.fromkeys(source.document for source, _ in ordered))


def _of_document(
    source: ActionSource,
    action: Action,
    labels: tuple[str, ...],
    uses: list[tuple[ActionSource, Action]],
) -> LibraryAction:
    differing = {use.document for use, its in uses if not is_like(its, action)}
    used_in = _by_age(uses)
    return LibraryAction(
        name=action.name,
        description=action.description,
        type=action.type,
        inputs=tuple(map(_described, action.inputs)),
        outputs=tuple(map(_described, action.outputs)),
        used_in=used_in,
        first_seen=when(min([source.made_at, *(use.made_at for use, _ in uses)])),
        document=source.document,
        seq=source.seq,
        labels=labels,
        differs_in=tuple(graph for graph in used_in if graph in differing),
    )


def _of_uses(name: str, uses: list[tuple[ActionSource, Action]]) -> LibraryAction:
    action = together(name, [action for _, action in uses])
    return LibraryAction(
        name=name,
        description=action.description,
        type=action.type,
        inputs=tuple(map(_described, action.inputs)),
        outputs=tuple(map(_described, action.outputs)),
        used_in=_by_age(uses),
        first_seen=when(min(source.made_at for source, _ in uses)),
    )


def together(name: str, uses: Sequence[Action]) -> Action:
    """Return one action with this name and without values in place of several uses; where they
    differ, the first use counts."""
    return Action(
        key="",
        name=name,
        description=next((a.description for a in uses if a.description), ""),
        type=uses[0].type,
        inputs=_together(action.inputs for action in uses),
        outputs=_together(action.outputs for action in uses),
    )


def _together(lists: Iterable[tuple[Parameter, ...]]) -> tuple[Parameter, ...]:
    found: dict[str, Parameter] = {}
    for parameters in lists:
        for parameter in parameters:
            if parameter.path not in found:
                found[parameter.path] = without_value(parameter)
    return tuple(found.values())


def _described(parameter: Parameter) -> LibraryParameter:
    text = parameter.text
    leaf = parse_small(text)
    if not isinstance(leaf, dict):
        return LibraryParameter(parameter.path, None, required=True, text=text)
    kind = leaf.get("pvf_type")
    return LibraryParameter(
        parameter.path,
        kind if isinstance(kind, str) else None,
        required=leaf.get("pvf_required") is not False,
        text=text,
    )


def _distinct(graph: Graph) -> tuple[Action, ...]:
    """Return one action of a graph for each different combination of the fields that a library
    stores (name, type, description, inputs and outputs). An action that exists only because a
    relation refers to it is skipped."""
    found: dict[object, Action] = {}
    for action in graph.actions:
        if action.missing:
            continue
        sort = action.name, action.type, action.description, action.inputs, action.outputs
        found.setdefault(sort, action)
    return tuple(found.values())
