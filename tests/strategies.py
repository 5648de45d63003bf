"""Hypothesis strategies for UMRF graphs, and what makes two of them the same."""

import json
from collections import defaultdict
from operator import attrgetter
from typing import Any

import msgspec
from hypothesis import strategies as st

from action_assistant.umrf.files.writing import name_order
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    RESPONSES,
    Action,
    Conditions,
    Graph,
    Key,
    Parameter,
    Relation,
    Remap,
)

texts = st.text(st.characters(codec="utf-8", exclude_categories=("Cs",)), min_size=0, max_size=12)
names = st.one_of(st.sampled_from(["Go", "Look", "Go_1", "a>b|c", "Ünï code"]), texts.filter(bool))
numbers = st.one_of(
    st.sampled_from(["5", "5.0", "-0.0", "1e3", "12345678901234567890", "0.1"]),
    st.floats(allow_nan=False, allow_infinity=False).map(repr),
)
positions = st.none() | st.tuples(
    st.floats(-1e6, 1e6).map(lambda x: x + 0.0), st.floats(-1e6, 1e6).map(lambda x: x + 0.0)
)
scalars = st.one_of(
    numbers, texts.map(lambda t: json.dumps(t, ensure_ascii=False)), st.just("true")
)


@st.composite
def leaves(draw: st.DrawFn) -> str:
    """The JSON text of one parameter."""
    kind = draw(st.sampled_from(["string", "number", "numbers", "bool", "geometry_msgs/Pose"]))
    members = [f'"pvf_type":"{kind}"']
    if draw(st.booleans()):
        members.append(f'"pvf_value":{draw(scalars)}')
    if draw(st.booleans()):
        members.append('"pvf_required":false')
    return "{" + ",".join(members) + "}"


@st.composite
def parameters(draw: st.DrawFn) -> tuple[Parameter, ...]:
    """Parameters of one side, in groups; no path lies inside another."""
    found: list[Parameter] = []
    for group in draw(st.lists(texts, unique=True, max_size=3)):
        escaped = group.replace("~", "~0").replace("/", "~1")
        if draw(st.booleans()):
            found.append(Parameter(escaped, draw(leaves())))
            continue
        for inner in draw(st.lists(texts, unique=True, min_size=1, max_size=3)):
            key = inner.replace("~", "~0").replace("/", "~1")
            if inner != "pvf_type":
                found.append(Parameter(f"{escaped}/{key}", draw(leaves())))
    return tuple(found)


def extras(*taken: str) -> st.SearchStrategy[tuple[tuple[str, str], ...]]:
    """Unknown fields."""
    fields = st.sampled_from(["note", "effect", "id", "x y"]).filter(lambda f: f not in taken)
    return st.dictionaries(fields, scalars, max_size=2).map(lambda d: tuple(d.items()))


conditions = st.builds(Conditions, *[st.sampled_from(RESPONSES)] * 4)
remaps = st.dictionaries(texts, texts, max_size=2).map(
    lambda d: tuple(Remap(source, target) for source, target in d.items())
)


@st.composite
def actions(draw: st.DrawFn, key: Key, name: str, instance_id: int) -> Action:
    """One action with everything."""
    return Action(
        key=key,
        name=name,
        instance_id=instance_id,
        type=draw(st.sampled_from(["sync", "async", "spontaneous", "other"])),
        actor=draw(texts),
        description=draw(texts),
        inputs=draw(parameters()),
        outputs=draw(parameters()),
        position=draw(positions),
        extra=draw(extras()),
    )


#: Waypoints by response: mostly positions, sometimes the text of another program.
waypoints = st.dictionaries(
    st.sampled_from(RESPONSES),
    st.sampled_from(["[[12,-40]]", "[[0,0],[36,120]]", "[]", '{"x":1}', "7"]),
    max_size=2,
).map(lambda found: tuple((r, found[r]) for r in RESPONSES if r in found))


@st.composite
def relations(draw: st.DrawFn, parent: Key, child: Key) -> Relation:
    """One relation between two keys; ends say only what they can."""
    orders = st.floats(0, 100)
    relation = Relation(
        parent=parent,
        child=child,
        conditions=ENTRY_CONDITIONS if parent == ENTRY else draw(conditions),
        required=True if parent == ENTRY else draw(st.booleans()),
        remap=() if child == EXIT else draw(remaps),
        parent_order=0.0 if child == EXIT else draw(orders),
        child_order=0.0 if parent == ENTRY else draw(orders),
        parents_extra=() if parent == ENTRY else draw(extras()),
        children_extra=() if child == EXIT else draw(extras()),
        waypoints=draw(waypoints),
    )
    if ENTRY in (parent, child) or EXIT in (parent, child):
        return relation
    match draw(st.sampled_from([None, None, None, "parents", "children"])):
        case "parents":
            return msgspec.structs.replace(
                relation, only="parents", remap=(), children_extra=(), parent_order=0.0
            )
        case "children":
            return msgspec.structs.replace(
                relation,
                only="children",
                conditions=Conditions("run", "run", "bypass", "ignore"),
                required=True,
                parents_extra=(),
                child_order=0.0,
            )
        case _:
            return relation


@st.composite
def graphs(draw: st.DrawFn, max_actions: int = 6) -> Graph:
    """Any graph that a D3 file can say: loops, islands, one-sided relations, odd names."""
    named = draw(st.lists(st.tuples(names, st.integers(0, 3)), unique=True, max_size=max_actions))
    listed = [draw(actions(f"k{i}", name, n)) for i, (name, n) in enumerate(named)]
    keys = [action.key for action in listed]
    found: list[Relation] = []
    if keys:
        ends = st.sampled_from(keys)
        inner = st.tuples(ends, ends)
        outer = st.one_of(st.tuples(st.just(ENTRY), ends), st.tuples(ends, st.just(EXIT)))
        pairs = draw(st.lists(st.one_of(inner, outer), unique=True, max_size=2 * len(keys)))
        found = [draw(relations(parent, child)) for parent, child in pairs]
    return Graph(
        name=draw(texts),
        description=draw(texts),
        actions=tuple(listed),
        relations=tuple(found),
        entry_position=draw(positions),
        exit_position=draw(positions),
        direction=draw(st.sampled_from(["right", "down"])),
        notes=draw(st.dictionaries(texts, scalars, max_size=2).map(lambda d: tuple(d.items()))),
        extra=draw(extras()),
    )


def normal(graph: Graph) -> Any:
    """A graph with keys by place and orders by rank: what files can keep of it."""
    keys = {action.key: f"#{i}" for i, action in enumerate(graph.actions)} | {
        ENTRY: ENTRY,
        EXIT: EXIT,
    }
    ranks: dict[tuple[str, int], float] = {}
    for order, owner in (("parent_order", "parent"), ("child_order", "child")):
        groups: dict[Key, list[Relation]] = defaultdict(list)
        for relation in sorted(sorted(graph.relations, key=name_order), key=attrgetter(order)):
            if relation.only not in (None, "parents" if owner == "child" else "children"):
                continue
            if (relation.parent if owner == "child" else relation.child) in (ENTRY, EXIT):
                continue
            groups[getattr(relation, owner)].append(relation)
        for group in groups.values():
            for rank, relation in enumerate(group):
                ranks[order, id(relation)] = float(rank)
    changed = [
        msgspec.structs.replace(
            relation,
            parent=keys[relation.parent],
            child=keys[relation.child],
            parent_order=ranks.get(("parent_order", id(relation)), 0.0),
            child_order=ranks.get(("child_order", id(relation)), 0.0),
        )
        for relation in graph.relations
    ]
    return msgspec.structs.replace(
        graph,
        actions=tuple(msgspec.structs.replace(a, key=keys[a.key]) for a in graph.actions),
        relations=tuple(sorted(changed, key=lambda r: (r.parent, r.child, r.listing))),
    )
