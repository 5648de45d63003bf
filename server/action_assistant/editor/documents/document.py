"""The shared document: a graph as root maps with flat string keys (docs/contracts.md 1).

This module and `frontend/src/graph/document-keys.ts` are the only places that know the keys. Flat keys let
two people fill in different things of one action without replacing each other's container, and let
an undone delete bring back what a colleague changed meanwhile. Reading a graph is total: it derives and
never repairs; its twins are `read.ts` and `assemble.ts` beside that file, and the vectors in
`tests/vectors/document` hold for both.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import Final, TypeAlias, cast

from msgspec import json
from msgspec.structs import replace
from pycrdt import Doc, Map

from action_assistant.editor.documents import values as values
from action_assistant.editor.documents.values import (
    ROOTS,
    Ends,
    Root,
    by_text,
    ends_of,
    is_aid,
    relation_id,
)
from action_assistant.random_ids import random_id
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    PRECONDITIONS,
    RESPONSES,
    Action,
    Conditions,
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

Fields: TypeAlias = Mapping[str, object]
_Extra: TypeAlias = tuple[tuple[str, JsonText], ...]
_NOTHING: Fields = {}
#: root → flat key → plain value
Maps: TypeAlias = dict[str, dict[str, object]]
SCHEMA: Final = 1.0
#: The types of values of a key; nested shared types, which no client of ours writes, are not among them.
PLAIN: Final = (str, float, int, bool, list, dict, bytes, bytearray, type(None))


def read_maps(maps: Mapping[str, Mapping[str, object]]) -> Graph:
    """Return the graph that the maps of a document show. Entries that make no part of a graph are
    ignored, and no content raises an error."""
    meta = maps.get("meta", _NOTHING)
    positions = maps.get("positions", _NOTHING)
    actions = _numbered(_actions(maps.get("actions", _NOTHING), positions))
    taken_up = _ghosts_taken_up(actions)
    alive = {ENTRY, EXIT, *(action.key for action in actions)}
    relations = [
        relation
        for relation in _relations(maps.get("relations", _NOTHING), positions)
        if relation.parent in alive and relation.child in alive
    ]
    return Graph(
        name=values.text(meta.get("name")) or "",
        description=values.text(meta.get("description")) or "",
        actions=tuple(action for action in actions if action.key not in taken_up),
        relations=tuple(sorted(_redirected(relations, taken_up), key=_ends)),
        entry_position=values.position(positions.get(ENTRY)),
        exit_position=values.position(positions.get(EXIT)),
        direction=values.direction(meta.get("direction")),
        notes=_under(positions, "g/"),
        extra=_extra(meta, "x"),
    )


def _owners(fields: Fields) -> dict[str, dict[str, object]]:
    """Return fields grouped by the part of their key before the first `|`; the inner keys are the
    parts after it."""
    owners: dict[str, dict[str, object]] = defaultdict(dict)
    for key, value in fields.items():
        head, bar, rest = key.partition("|")
        owners[head][rest if rest or not bar else "|"] = value
    return owners


def _under(fields: Fields, prefix: str) -> _Extra:
    """Return the fields whose keys have this prefix and whose values are JSON texts, without the
    prefix, sorted by name."""
    found = (
        (key.removeprefix(prefix), value)
        for key, value in fields.items()
        if key.startswith(prefix) and isinstance(value, str) and values.json_text(value) is not None
    )
    return tuple(sorted(found, key=lambda pair: by_text(pair[0])))


def _extra(fields: Fields, head: str) -> _Extra:
    """Return the unknown fields stored under `head`, in the stored order; fields that it lacks
    follow, sorted by name."""
    texts = dict(_under(fields, f"{head}/"))
    return tuple((field, texts[field]) for field in _listed(texts, fields.get(head)))


# Actions


def _actions(fields: Fields, positions: Fields) -> list[Action]:
    """Return the actions in the maps of actions and positions, in the order of the file."""
    found: list[tuple[float, Key, Action]] = []
    for key, own in _owners(fields).items():
        name = values.text(own.get(""))
        if name is None or not is_aid(key):
            continue
        action = _action(key, name, own, positions.get(key))
        found.append((values.number(own.get("order")) or 0.0, key, action))
    return [action for _, _, action in sorted(found, key=lambda item: item[:2])]


def _action(key: Key, name: str, own: Fields, position: object) -> Action:
    kind = values.text(own.get("type"))
    return Action(
        key=key,
        name=name,
        instance_id=values.instance_id(own.get("instance_id")) or 0,
        type="sync" if kind is None else kind,
        actor=values.text(own.get("actor")) or "",
        description=values.text(own.get("description")) or "",
        inputs=_parameters(own, "in"),
        outputs=_parameters(own, "out"),
        position=values.position(position),
        missing=own.get("missing") is True,
        twin=own.get("twin") is True,
        extra=_extra(own, "x"),
        asks=_under(own, "ask/"),
        breakpoint=_breakpoint(own),
    )


def _parameters(own: Fields, side: str) -> tuple[Parameter, ...]:
    texts = dict(_under(own, f"{side}/"))
    return tuple(Parameter(path, texts[path]) for path in _listed(texts, own.get(side)))


def _listed(names: Iterable[str], order: object) -> list[str]:
    """Return the names in the order of the list `order`; names that the list lacks follow in the
    order of `names`."""
    known = dict.fromkeys(names)
    first = [name for name in dict.fromkeys(values.text_list(order) or ()) if name in known]
    return list(dict.fromkeys([*first, *known]))


def _numbered(actions: list[Action]) -> list[Action]:
    """Return the actions, with a new number for each whose full name is taken: of equal names the
    first by (instance_id, key) keeps its number, the others get the lowest free one. Twins and
    ghosts keep theirs."""
    groups: dict[str, list[Action]] = defaultdict(list)
    for action in actions:
        groups[action.name].append(action)
    numbers: dict[Key, int] = {}
    for group in groups.values():
        if len(group) > 1:
            numbers.update(_shared_out(group))
    return [
        replace(action, instance_id=numbers[action.key]) if action.key in numbers else action
        for action in actions
    ]


def _shared_out(group: list[Action]) -> dict[Key, int]:
    """Return new numbers, by key, for the actions of a group with one name whose number another one
    has."""
    fixed = [action.instance_id for action in group if action.twin or action.missing]
    taken: set[int] = set()
    rest: list[Key] = []
    free = [action for action in group if not (action.twin or action.missing)]
    for action in sorted(free, key=lambda action: (action.instance_id, action.key)):
        if action.instance_id in taken:
            rest.append(action.key)
        else:
            taken.add(action.instance_id)
    taken.update(fixed)
    numbers: dict[Key, int] = {}
    lowest = 0
    for key in rest:
        while lowest in taken:
            lowest += 1
        taken.add(lowest)
        numbers[key] = lowest
    return numbers


def _ghosts_taken_up(actions: list[Action]) -> dict[Key, Key]:
    """Return the ghosts whose full name a real action has by now, each with that action."""
    real: dict[str, Key] = {}
    for action in actions:
        if not action.missing:
            real.setdefault(action.full_name, action.key)
    return {
        action.key: real[action.full_name]
        for action in actions
        if action.missing and action.full_name in real
    }


# Relations


def _relations(fields: Fields, positions: Fields) -> list[Relation]:
    led = _waypoints(positions)
    found: list[Relation] = []
    for head, own in _owners(fields).items():
        ends = ends_of(head)
        relation = _relation(ends, own, led.get(head, {})) if ends is not None else None
        if relation is not None:
            found.append(relation)
    return found


def _waypoints(positions: Fields) -> dict[str, dict[str, JsonText]]:
    """Return the waypoints of arrows in the map of positions, as JSON texts: by id of the relation
    and by response."""
    found: dict[str, dict[str, JsonText]] = defaultdict(dict)
    for line, text in _under(positions, "w/"):
        relation, _, response = line.partition("|")
        found[relation][response] = text
    return found


def _relation(ends: Ends, own: Fields, led: Mapping[str, JsonText]) -> Relation | None:
    answers = {outcome: values.response(own.get(outcome)) for outcome in PRECONDITIONS}
    said = {outcome: answer for outcome, answer in answers.items() if answer is not None}
    if ends.parent == ENTRY:
        if said.get("on_true") != "run":
            return None
        conditions = ENTRY_CONDITIONS
    else:
        if not said:
            return None
        conditions = Conditions(**said)
    only = own.get("only")
    return Relation(
        parent=ends.parent,
        child=ends.child,
        listing=ends.listing,
        conditions=conditions,
        required=own.get("required") is not False,
        remap=_remaps(own),
        only="parents" if only == "parents" else "children" if only == "children" else None,
        parent_order=values.number(own.get("po")) or 0.0,
        child_order=values.number(own.get("co")) or 0.0,
        parents_extra=_extra(own, "x/parents"),
        children_extra=_extra(own, "x/children"),
        waypoints=tuple((response, led[response]) for response in RESPONSES if response in led),
        breakpoint=_breakpoint(own),
    )


def _breakpoint(own: Fields) -> JsonText:
    """Return the text of the breakpoint of an action or relation; "" for none."""
    return values.json_text(own.get("breakpoint")) or ""


def _remaps(own: Fields) -> tuple[Remap, ...]:
    targets = {
        key.removeprefix("remap/"): value
        for key, value in own.items()
        if key.startswith("remap/") and isinstance(value, str)
    }
    sources = _listed(sorted(targets, key=by_text), own.get("remap"))
    return tuple(Remap(source, targets[source]) for source in sources)


def _ends(relation: Relation) -> Ends:
    return Ends(relation.parent, relation.child, relation.listing)


def _redirected(relations: list[Relation], taken_up: Mapping[Key, Key]) -> list[Relation]:
    """Return the arrows, with each arrow at a replaced ghost moved to the real action (`taken_up`).
    If there is an arrow between its ends already, it gets the next free listing number."""
    touching = [r for r in relations if r.parent in taken_up or r.child in taken_up]
    arrows = [r for r in relations if r.parent not in taken_up and r.child not in taken_up]
    taken = {relation_id(relation) for relation in arrows}
    for relation in sorted(touching, key=_ends):
        parent = taken_up.get(relation.parent, relation.parent)
        child = taken_up.get(relation.child, relation.child)
        listing = relation.listing
        if relation_id(Ends(parent, child, listing)) in taken:
            listing = 0
            while relation_id(Ends(parent, child, listing)) in taken:
                listing += 1
        taken.add(relation_id(Ends(parent, child, listing)))
        arrows.append(replace(relation, parent=parent, child=child, listing=listing))
    return arrows


def new_aid() -> Key:
    """Return a new random key for an action in a document."""
    return random_id()


def read(doc: Doc) -> Graph:  # type: ignore[type-arg]
    """Return the graph that the content of a document describes. The document is not changed, and
    no content of it raises an error."""
    return read_maps(maps_of(doc))


def maps_of(doc: Doc) -> Maps:  # type: ignore[type-arg]
    """Return the root maps of a document as plain values, without nested shared types, which the
    page never writes."""
    return {
        root: {key: value for key, value in _root(doc, root).items() if isinstance(value, PLAIN)}
        for root in ROOTS
    }


def name_of(doc: Doc) -> str:  # type: ignore[type-arg]
    """Return the name of the graph in a document; "" if there is none. All else in the document is
    not read."""
    name = _root(doc, "meta").get("name")
    return name if isinstance(name, str) else ""


def fill(doc: Doc, graph: Graph) -> None:  # type: ignore[type-arg]
    """Write a graph into an empty document. Keys of actions that a document cannot have are
    replaced by new random keys."""
    with doc.transaction():
        for root, fields in flatten(with_aids(graph)).items():
            _root(doc, cast(Root, root)).update(fields)


def change(doc: Doc, target: Mapping[str, Mapping[str, object]]) -> None:  # type: ignore[type-arg]
    """Make the root maps of the document equal to `target`, in one transaction. Keys that `target`
    does not have are deleted; keys that have the wanted value already are not touched."""
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
    """Return the root maps of the document of a graph; a missing key means the default. Raise
    ValueError if the key of an action is no aid (key of a document), since it could be mistaken for
    a field."""
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
    fields.update({f"{key}|ask/{path}": mark for path, mark in action.asks})
    if action.breakpoint:
        fields[f"{key}|breakpoint"] = action.breakpoint
    return fields


def _extra_fields(head: str, extra: tuple[tuple[str, JsonText], ...]) -> dict[str, object]:
    """Return the entries of a document for unknown fields under `head`, and one with their order
    unless they are sorted by name."""
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
    if relation.breakpoint:
        fields[f"{head}|breakpoint"] = relation.breakpoint
    return fields


def _remap_fields(head: str, remap: tuple[Remap, ...]) -> dict[str, object]:
    """Return the entries of a document for renamings under `head`, and one with their order unless
    they are sorted by name."""
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
    """Return whether two plain values are equal. Unlike in Python, `True` is not equal to 1."""
    return a == b and isinstance(a, bool) == isinstance(b, bool)


def _plain(value: object) -> object:
    """Return a value in a form that the library accepts: bytes, which it returns as bytearray,
    become bytes again."""
    return bytes(value) if isinstance(value, bytearray) else value
