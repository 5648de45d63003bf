"""The shared document: a graph as root maps with flat string keys (docs/contracts.md 1).

This module and `frontend/src/graph/document-keys.ts` are the only places that know the keys. Flat keys let
two people fill in different things of one action without replacing each other's container, and let
an undone delete bring back what a colleague changed meanwhile.
"""

from collections.abc import Iterable, Mapping
from typing import Final, TypeAlias, cast

from msgspec import json
from msgspec.structs import replace
from pycrdt import Doc, Map

from action_assistant.editor.documents.reading import read_maps
from action_assistant.editor.documents.values import ROOTS, Root, by_text, is_aid, relation_id
from action_assistant.random_ids import random_id
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    PRECONDITIONS,
    Action,
    Graph,
    JsonText,
    Key,
    Parameter,
    Position,
    Relation,
    Remap,
)

__all__ = [
    "PLAIN",
    "Maps",
    "change",
    "fill",
    "flatten",
    "is_same",
    "maps_of",
    "name_of",
    "new_aid",
    "read",
    "read_maps",
]

#: root → flat key → plain value
Maps: TypeAlias = dict[str, dict[str, object]]

SCHEMA: Final = 1.0
#: The types of values of a key; nested shared types, which no client of ours writes, are not among them.
PLAIN: Final = (str, float, int, bool, list, dict, bytes, bytearray, type(None))


def new_aid() -> Key:
    """Return a new random key for an action."""
    return random_id()


def read(doc: Doc) -> Graph:  # type: ignore[type-arg]
    """Return the graph that a document shows. The document is not changed, and no content of it
    raises an error."""
    return read_maps(maps_of(doc))


def maps_of(doc: Doc) -> Maps:  # type: ignore[type-arg]
    """Return the maps of a document as plain values, without nested shared types, which our page
    never writes."""
    return {
        root: {key: value for key, value in _root(doc, root).items() if isinstance(value, PLAIN)}
        for root in ROOTS
    }


def name_of(doc: Doc) -> str:  # type: ignore[type-arg]
    """Return the name of the graph that a document shows. The rest of the document is not read."""
    name = _root(doc, "meta").get("name")
    return name if isinstance(name, str) else ""


def fill(doc: Doc, graph: Graph) -> None:  # type: ignore[type-arg]
    """Write a graph into an empty document. Keys of actions that are no aids are replaced by new
    random keys."""
    with doc.transaction():
        for root, fields in flatten(with_aids(graph)).items():
            _root(doc, cast(Root, root)).update(fields)


def change(doc: Doc, target: Mapping[str, Mapping[str, object]]) -> None:  # type: ignore[type-arg]
    """Edit the document until its maps equal `target`. Keys whose values are equal already are not
    touched."""
    with doc.transaction():
        now = maps_of(doc)
        for root in ROOTS:
            shared, wanted = _root(doc, root), target.get(root, {})
            for key in now[root].keys() - wanted.keys():
                del shared[key]
            for key, value in wanted.items():
                if key not in now[root] or not is_same(now[root][key], value):
                    shared[key] = _plain(value)


def flatten(graph: Graph) -> Maps:
    """Return the document's maps for a graph whose keys are aids; a missing key means the default.
    Raise ValueError for other keys, which could look like fields."""
    meta: dict[str, object] = {"schema": SCHEMA, "name": graph.name}
    if graph.description:
        meta["description"] = graph.description
    if graph.direction != "down":
        meta["direction"] = graph.direction
    meta.update(_extra_fields("x", graph.extra))
    maps: Maps = {"meta": meta, "actions": {}, "relations": {}, "positions": {}, "comments": {}}
    positions = maps["positions"]
    for index, action in enumerate(graph.actions):
        if not is_aid(action.key):
            raise ValueError(f"{action.key!r} cannot be the key of an action in a document")
        maps["actions"].update(_action_fields(action, float(index)))
        _place(positions, action.key, action.position)
    for relation in graph.relations:
        maps["relations"].update(_relation_fields(relation))
        head = f"w/{relation_id(relation)}"
        positions.update({f"{head}|{response}": text for response, text in relation.waypoints})
    _place(positions, ENTRY, graph.entry_position)
    _place(positions, EXIT, graph.exit_position)
    positions.update({f"g/{note}": text for note, text in graph.notes})
    return maps


def _action_fields(action: Action, order: float) -> dict[str, object]:
    key = action.key
    fields: dict[str, object] = {key: action.name, f"{key}|order": order}
    if action.instance_id:
        fields[f"{key}|instance_id"] = float(action.instance_id)
    if action.type != "sync":
        fields[f"{key}|type"] = action.type
    texts = {"actor": action.actor, "description": action.description}
    fields.update({f"{key}|{field}": text for field, text in texts.items() if text})
    marks = {"missing": action.missing, "twin": action.twin}
    fields.update({f"{key}|{field}": True for field, mark in marks.items() if mark})
    for side, parameters in (("in", action.inputs), ("out", action.outputs)):
        fields.update(_parameter_fields(f"{key}|{side}", parameters))
    fields.update(_extra_fields(f"{key}|x", action.extra))
    return fields


def _extra_fields(head: str, extra: tuple[tuple[str, JsonText], ...]) -> dict[str, object]:
    """Return keys for unknown fields, and a key with their order unless they are sorted by name."""
    fields: dict[str, object] = {f"{head}/{field}": text for field, text in extra}
    names = [field for field, _ in extra]
    if names != sorted(names, key=by_text):
        fields[head] = _list_text(names)
    return fields


def _parameter_fields(head: str, parameters: Iterable[Parameter]) -> dict[str, object]:
    fields: dict[str, object] = {f"{head}/{p.path}": p.text for p in parameters}
    if fields:
        fields[head] = _list_text(p.path for p in parameters)
    return fields


def _relation_fields(relation: Relation) -> dict[str, object]:
    head = relation_id(relation)
    fields: dict[str, object] = {}
    if relation.parent == ENTRY:
        fields[f"{head}|on_true"] = "run"
    else:
        # All four, so that a relation which only ignores exists too.
        fields.update({f"{head}|{o}": relation.conditions.answer(o) for o in PRECONDITIONS})
    fields[f"{head}|po"] = relation.parent_order
    fields[f"{head}|co"] = relation.child_order
    if not relation.required:
        fields[f"{head}|required"] = False
    if relation.only is not None:
        fields[f"{head}|only"] = relation.only
    fields.update(_remap_fields(head, relation.remap))
    extras = {"parents": relation.parents_extra, "children": relation.children_extra}
    for side, extra in extras.items():
        fields.update(_extra_fields(f"{head}|x/{side}", extra))
    return fields


def _remap_fields(head: str, remap: tuple[Remap, ...]) -> dict[str, object]:
    """Return keys for renamings, and a key with their order unless they are sorted by name."""
    fields: dict[str, object] = {f"{head}|remap/{r.source}": r.target for r in remap}
    sources = [r.source for r in remap]
    if sources != sorted(sources, key=by_text):
        fields[f"{head}|remap"] = _list_text(sources)
    return fields


def _list_text(names: Iterable[str]) -> JsonText:
    return json.encode(list(names)).decode()


def _place(positions: dict[str, object], key: Key, position: Position | None) -> None:
    if position is not None:
        positions[key] = [float(position[0]), float(position[1])]


def with_aids(graph: Graph) -> Graph:
    """Return the graph with a new random key for every action whose key is no aid or occurs twice."""
    seen: set[Key] = set()
    actions: list[Action] = []
    renamed: dict[Key, Key] = {}
    for action in graph.actions:
        key = action.key if is_aid(action.key) and action.key not in seen else new_aid()
        seen.add(key)
        renamed.setdefault(action.key, key)
        actions.append(action if key == action.key else replace(action, key=key))
    relations = [
        replace(
            relation,
            parent=renamed.get(relation.parent, relation.parent),
            child=renamed.get(relation.child, relation.child),
        )
        for relation in graph.relations
    ]
    return replace(graph, actions=tuple(actions), relations=tuple(relations))


def _root(doc: Doc, root: Root) -> Map:  # type: ignore[type-arg]
    shared: Map = doc.get(root, type=Map)  # type: ignore[type-arg]
    return shared


def is_same(a: object, b: object) -> bool:
    """Compare two plain values. Unlike in Python, `True` is not equal to 1."""
    return a == b and isinstance(a, bool) == isinstance(b, bool)


def _plain(value: object) -> object:
    """Return a value as it may be set: bytes come back from the library as bytearray."""
    return bytes(value) if isinstance(value, bytearray) else value
