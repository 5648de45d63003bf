"""Python and TypeScript read what the other wrote, byte for byte over real Yjs."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pycrdt import Doc, Map

from action_assistant.editor import document
from action_assistant.umrf import codec
from action_assistant.umrf.digest import digest
from action_assistant.umrf.model import Action, Graph, Parameter, Position, Relation
from support.page import Page, graph_of, open_page

VECTORS = sorted((Path(__file__).parent / "vectors" / "document").glob("*.json"))


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with open_page() as page:
        yield page


@pytest.mark.parametrize("path", VECTORS, ids=lambda path: path.stem)
def test_the_page_reads_what_python_wrote(page: Page, path: Path) -> None:
    vector = json.loads(path.read_text())
    doc = Doc()
    for root, fields in vector["maps"].items():
        doc.get(root, type=Map).update(fields)
    assert page.read(doc.get_update()) == graph_of(vector["graph"])


@pytest.mark.parametrize("path", VECTORS, ids=lambda path: path.stem)
def test_python_reads_what_the_page_wrote(page: Page, path: Path) -> None:
    vector = json.loads(path.read_text())
    written = page("write", maps=vector["maps"])
    doc = Doc()
    doc.apply_update(bytes.fromhex(written["update"]))
    assert document.read(doc) == graph_of(vector["graph"])


def test_python_sees_the_page_s_edits_as_the_page_does(page: Page) -> None:
    doc = Doc()
    document.fill(doc, Graph(name="before", actions=(Action(key="Z" * 12, name="Wait"),)))
    parameters = [{"path": "pose/x", "text": '{"pvf_type":"number","pvf_value":5.0}'}]
    edited = page(
        "edit",
        update=doc.get_update().hex(),
        edits=[
            ["addAction", {"name": "Wait", "inputs": parameters, "position": [10, 20.5]}],
            ["connect", "Z" * 12, "$0", "on_false"],
            ["setEntry", "Z" * 12],
            ["setExit", "$0", "on_error"],
            ["setRequired", "$1", False],
            ["setRemap", "$1", "found::x", "pose::x"],
            ["setGraphName", "after"],
            ["setField", "$0", "instanceId", 7],
        ],
    )
    doc.apply_update(bytes.fromhex(edited["update"]))
    graph = document.read(doc)
    assert graph == graph_of(edited["graph"])
    assert [action.full_name for action in graph.actions] == ["Wait_0", "Wait_7"]
    assert graph.actions[1].inputs == (
        Parameter("pose/x", '{"pvf_type":"number","pvf_value":5.0}'),
    )
    assert codec.read(codec.write(graph)).problems == ()


words = st.text(max_size=6)


@st.composite
def graphs(draw: st.DrawFn) -> Graph:
    """Graphs with names in any script and numbers of any size."""
    keys = draw(st.lists(st.text("aZ09", min_size=12, max_size=12), unique=True, max_size=4))
    places: st.SearchStrategy[Position] = st.tuples(
        st.floats(-1e9, 1e9, width=32), st.floats(-1e9, 1e9, width=32)
    )
    actions = [
        Action(
            key=key,
            name=draw(words) + str(n),
            instance_id=draw(st.integers(0, 2**32 - 1)),
            description=draw(words),
            inputs=tuple(Parameter(path, "1.0") for path in draw(st.lists(words, unique=True))),
            position=draw(st.none() | places),
            twin=draw(st.booleans()),
        )
        for n, key in enumerate(keys)
    ]
    pairs = draw(st.sets(st.tuples(st.sampled_from(keys), st.sampled_from(keys)))) if keys else ()
    relations = [Relation(parent=p, child=c, child_order=draw(st.floats(-9, 9))) for p, c in pairs]
    return Graph(
        name=draw(words),
        actions=tuple(actions),
        relations=tuple(sorted(relations, key=lambda r: (r.parent, r.child))),
    )


@settings(max_examples=40)
@given(graph=graphs())
def test_any_graph_crosses_the_wire(page: Page, graph: Graph) -> None:
    doc = Doc()
    document.fill(doc, graph)
    assert page.read(doc.get_update()) == graph


def test_every_real_file_looks_the_same_to_the_page(page: Page, shared: Path) -> None:
    for path in sorted((shared / "umrf" / "corpus" / "graphs").rglob("*.json")):
        try:
            reading = codec.read(path.read_bytes())
        except codec.Unreadable:
            continue
        doc = Doc()
        document.fill(doc, reading.graph)
        seen = page.read(doc.get_update())
        assert seen == document.read(doc), path
        assert digest(seen) == digest(reading.graph), path
