"""The shared document: what its keys mean, and that nothing in it can make a reader fail."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace
from pycrdt import Array, Doc, Map

from action_assistant.editor.documents import document
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    PRECONDITIONS,
    RESPONSES,
    Action,
    Conditions,
    Graph,
    Parameter,
    Relation,
    Remap,
)

VECTORS = sorted((Path(__file__).parents[2] / "vectors" / "document").glob("*.json"))


def snake(value: Any) -> Any:
    """The vectors are written with the names of the page."""
    match value:
        case dict():
            return {
                re.sub("[A-Z]", lambda m: "_" + m[0].lower(), k): snake(v) for k, v in value.items()
            }
        case list():
            return [snake(item) for item in value]
        case _:
            return value


@pytest.mark.parametrize("path", VECTORS, ids=lambda path: path.stem)
def test_the_document_reads_as_the_vectors_say(path: Path) -> None:
    vector = json.loads(path.read_text())
    wanted = msgspec.convert(snake(vector["graph"]), Graph, strict=True)
    assert document.read_maps(vector["maps"]) == wanted, vector["about"]


@pytest.mark.parametrize("path", VECTORS, ids=lambda path: path.stem)
def test_a_graph_read_and_written_again_reads_the_same(path: Path) -> None:
    graph = document.read_maps(json.loads(path.read_text())["maps"])
    again = document.read_maps(document.flatten(graph))
    assert again == graph
    doc = Doc()
    document.fill(doc, graph)
    assert document.read(doc) == graph


aids = st.text("ABCabc019", min_size=12, max_size=12)
words = st.text(max_size=8)
json_texts = st.recursive(
    st.none() | st.booleans() | st.integers() | words,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(words, inner, max_size=3),
    max_leaves=5,
).map(json.dumps)
# On the wire whole numbers are doubles, and half of a character pair does not exist.
numbers = st.floats(allow_nan=False, allow_infinity=False, width=32)
extras = st.dictionaries(words, json_texts, max_size=3).map(lambda found: tuple(found.items()))
notes = extras.map(lambda found: tuple(sorted(found, key=lambda n: n[0].encode("utf-16-be"))))
parameters = st.dictionaries(words, json_texts, max_size=3).map(
    lambda found: tuple(Parameter(path, text) for path, text in found.items())
)


waypoints = st.dictionaries(st.sampled_from(RESPONSES), json_texts, max_size=2).map(
    lambda found: tuple((r, found[r]) for r in RESPONSES if r in found)
)


@st.composite
def graphs(draw: st.DrawFn) -> Graph:
    """Any graph that a file can say: each real action with a number of its own, ghosts without a
    real action of their name."""
    keys = draw(st.lists(aids, unique=True, max_size=5))
    actions = tuple(
        Action(
            key=key,
            name=draw(words) + str(index),  # full names differ
            instance_id=draw(st.integers(0, 2**32 - 1)),
            type=draw(words),
            actor=draw(words),
            description=draw(words),
            inputs=draw(parameters),
            outputs=draw(parameters),
            position=draw(st.none() | st.tuples(numbers, numbers)),
            missing=draw(st.booleans()),
            twin=draw(st.booleans()),
            extra=draw(extras),
        )
        for index, key in enumerate(keys)
    )
    return Graph(
        name=draw(words),
        description=draw(words),
        actions=actions,
        relations=draw(relations_between(keys)),
        entry_position=draw(st.none() | st.tuples(numbers, numbers)),
        exit_position=draw(st.none() | st.tuples(numbers, numbers)),
        direction=draw(st.sampled_from(["right", "down"])),
        notes=draw(notes),
        extra=draw(extras),
    )


@st.composite
def relations_between(draw: st.DrawFn, keys: list[str]) -> tuple[Relation, ...]:
    pairs = [(parent, child) for parent in [*keys, ENTRY] for child in [*keys, EXIT]]
    pairs.remove((ENTRY, EXIT))
    if not pairs:
        return ()
    places = draw(st.sets(st.tuples(st.sampled_from(pairs), st.integers(0, 2)), max_size=6))
    return tuple(
        Relation(
            parent=parent,
            child=child,
            listing=listing,
            conditions=ENTRY_CONDITIONS
            if parent == ENTRY
            else Conditions(**{o: draw(st.sampled_from(RESPONSES)) for o in PRECONDITIONS}),
            required=draw(st.booleans()),
            remap=tuple(
                Remap(s, t) for s, t in draw(st.dictionaries(words, words, max_size=2)).items()
            ),
            only=draw(st.sampled_from(("parents", "children", None))),
            parent_order=draw(numbers),
            child_order=draw(numbers),
            parents_extra=draw(extras),
            children_extra=draw(extras),
            waypoints=draw(waypoints),
        )
        for (parent, child), listing in sorted(places, key=lambda p: (p[0], p[1]))
    )


@given(graphs())
def test_any_graph_comes_out_of_a_document_as_it_went_in(graph: Graph) -> None:
    doc = Doc()
    document.fill(doc, graph)
    other = Doc()
    other.apply_update(doc.get_update())
    assert document.read(other) == graph


plain = st.recursive(
    st.none()
    | st.booleans()
    | st.floats()
    | st.integers(-(2**63), 2**63 - 1)
    | st.text(max_size=5)
    | st.sampled_from(["run", "ignore", "[]", '["a"]', "{", "1"])
    | st.binary(max_size=3),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=2)
    ),
    max_leaves=4,
)
heads = st.sampled_from(["A" * 12, "B" * 12, "entry", "exit", "short", ""])
ids = st.builds(
    "{}{}{}{}".format,
    heads,
    st.sampled_from([">", "", ">>"]),
    heads,
    st.sampled_from(["", ";1", ";x"]),
)
fields = st.sampled_from(
    ["type", "actor", "instance_id", "description", "order", "missing", "twin", "in", "out", "in/a",
     "out/", "x/name", "on_true", "on_false", "po", "co", "required", "only", "remap", "remap/a",
     "x/parents/p", "x/children/c", ""]
)  # fmt: skip
keys = heads | ids | st.builds("{}|{}".format, heads | ids, fields) | st.text(max_size=4)


@given(st.dictionaries(st.sampled_from(document.ROOTS), st.dictionaries(keys, plain, max_size=12)))
def test_no_content_of_a_document_makes_reading_fail(maps: dict[str, dict[str, object]]) -> None:
    graph = document.read_maps(maps)
    assert document.read_maps(document.flatten(graph)) == graph
    codec.write(graph)
    digest(graph)


def test_nested_shared_types_are_left_alone() -> None:
    doc = Doc()
    actions = doc.get("actions", type=Map)
    actions["A" * 12] = "Wait"
    actions["A" * 12 + "|type"] = Array(["async"])
    doc.get("positions", type=Map)["A" * 12] = Array([1, 2])
    (action,) = document.read(doc).actions
    assert (action.type, action.position) == ("sync", None)
    document.change(doc, document.maps_of(doc))
    assert isinstance(actions["A" * 12 + "|type"], Array)


def test_keys_that_are_no_aids_are_replaced_when_a_document_is_filled() -> None:
    graph = Graph(
        name="g",
        actions=(Action(key="a1", name="A"), Action(key="a2", name="B")),
        relations=(
            Relation(parent="a1", child="a2"),
            Relation(parent=ENTRY, child="a1", conditions=ENTRY_CONDITIONS),
        ),
    )
    doc = Doc()
    document.fill(doc, graph)
    first, second = document.read(doc).actions
    assert re.fullmatch("[A-Za-z0-9]{12}", first.key)
    assert {(r.parent, r.child) for r in document.read(doc).relations} == {
        (first.key, second.key),
        (ENTRY, first.key),
    }
    with pytest.raises(ValueError, match="a1"):
        document.flatten(graph)


def test_ids_are_random_and_long_enough() -> None:
    some = {document.new_aid() for _ in range(1000)}
    assert len(some) == 1000
    assert all(re.fullmatch("[A-Za-z0-9]{12}", aid) for aid in some)


@given(graphs(), graphs())
def test_a_change_makes_a_document_equal_its_target_and_touches_nothing_else(
    before: Graph, after: Graph
) -> None:
    doc = Doc()
    document.fill(doc, before)
    target = document.flatten(after)
    document.change(doc, target)
    assert document.maps_of(doc) == target
    updates: list[bytes] = []
    subscription = doc.observe(lambda event: updates.append(event.update))
    document.change(doc, target)
    doc.unobserve(subscription)
    assert updates == []


def test_a_change_tells_true_from_one() -> None:
    doc = Doc()
    doc.get("meta", type=Map)["x"] = 1.0
    document.change(doc, {"meta": {"x": True}})
    assert document.maps_of(doc)["meta"] == {"x": True}


def test_a_change_keeps_what_a_colleague_wrote_meanwhile_elsewhere() -> None:
    old = Graph(
        name="g", actions=(Action(key="A" * 12, name="Old"), Action(key="B" * 12, name="B"))
    )
    doc, colleague = Doc(), Doc()
    document.fill(doc, old)
    colleague.apply_update(doc.get_update())
    colleague.get("actions", type=Map)["B" * 12 + "|description"] = "written meanwhile"
    document.change(doc, document.flatten(replace(old, name="restored")))
    doc.apply_update(colleague.get_update(doc.get_state()))
    graph = document.read(doc)
    assert (graph.name, graph.actions[1].description) == ("restored", "written meanwhile")


def readable(paths: list[Path]) -> Iterator[tuple[Path, codec.Reading]]:
    for path in paths:
        try:
            yield path, codec.read(path.read_bytes())
        except codec.Unreadable:
            continue


def test_every_real_file_goes_through_a_document_with_the_same_meaning(
    graph_files: list[Path],
) -> None:
    checked = 0
    for path, reading in readable(graph_files):
        doc = Doc()
        document.fill(doc, reading.graph)
        graph = document.read(doc)
        assert digest(graph) == digest(reading.graph), path
        sides = [sorted(r.only or "" for r in g.relations) for g in (graph, reading.graph)]
        assert sides[0] == sides[1], path
        checked += 1
    assert checked > 100


def through(text: str | bytes) -> tuple[str, str]:
    """The canonical text of a file, and that of the same by way of a document."""
    graph = codec.read(text).graph
    first: Doc[Any] = Doc()
    document.fill(first, graph)
    second: Doc[Any] = Doc()
    second.apply_update(first.get_update())
    return codec.write(graph), codec.write(document.read(second))


def test_unknown_keys_keep_their_order_through_the_document() -> None:
    text = """{"graph_name": "g", "zeta": 1, "beta": 2, "alpha": {"y": 1, "x": 2},
      "graph_entry": [{"name": "A", "up": 1, "down": 2, "at": 3}], "graph_exit": [{"name": "B"}],
      "actions": [
        {"name": "A", "type": "sync", "package": "p", "effect": "e", "id": 3, "Zoo": 1,
         "children": [{"name": "B", "q": 1, "p": 2}]},
        {"name": "B", "type": "sync", "parents": [{"name": "A", "n": 1, "m": 2, "o": 3}]}]}"""
    direct, by_document = through(text)
    assert by_document == direct
    written = json.loads(direct)
    assert [key for key in written if key in text and len(key) < 6] == ["zeta", "beta", "alpha"]
    first, second = written["actions"]
    assert list(first)[-4:] == ["package", "effect", "id", "Zoo"]
    assert list(first["children"][0])[-2:] == ["q", "p"]
    assert list(second["parents"][0])[-3:] == ["n", "m", "o"]
    assert list(written["graph_entry"][0])[-3:] == ["up", "down", "at"]


def test_fields_that_stand_by_name_need_no_list() -> None:
    action = Action(key="A" * 12, name="A", extra=(("a", "1"), ("b", "2")))
    assert f"{'A' * 12}|x" not in document.flatten(Graph(name="g", actions=(action,)))["actions"]


def test_every_graph_of_the_corpus_is_written_the_same_by_way_of_the_document(
    graph_files: list[Path],
) -> None:
    for path, _ in readable(graph_files):
        direct, by_document = through(path.read_bytes())
        assert by_document == direct, path.name
