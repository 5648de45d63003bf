"""Python and TypeScript read what the other wrote, byte for byte over real Yjs."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pycrdt import Doc, Map

from action_assistant.editor.documents import document
from action_assistant.umrf.check import check
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Action, Graph, Parameter, Position, Relation
from action_assistant.umrf.semantics import (
    Behaviour,
    GraphStateEvent,
    NotReady,
    Script,
    Trace,
    simulate,
)
from support.doses import examples
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
        direction=draw(st.sampled_from(["right", "down"])),
    )


@settings(max_examples=examples(40))
@given(graph=graphs())
def test_any_graph_crosses_the_wire(page: Page, graph: Graph) -> None:
    doc = Doc()
    document.fill(doc, graph)
    assert page.read(doc.get_update()) == graph


def test_every_real_file_looks_the_same_to_the_page(page: Page, graph_files: list[Path]) -> None:
    for path in graph_files:
        try:
            reading = codec.read(path.read_bytes())
        except codec.Unreadable:
            continue
        doc = Doc()
        document.fill(doc, reading.graph)
        seen = page.read(doc.get_update())
        assert seen == document.read(doc), path
        assert digest(seen) == digest(reading.graph), path


TEXT = '{"pvf_type": "string"}'
WORK = [
    {"path": "delay", "text": '{"pvf_type": "number", "pvf_value": 0.2}'},
    {"path": "result", "text": '{"pvf_type": "string", "pvf_value": "on_true"}'},
]
ECHO = [{"path": "text", "text": '{"pvf_type": "string", "pvf_value": "x"}'}]


def drawn(page: Page, *edits: list[object]) -> Graph:
    """A new graph after these edits on the page."""
    doc = Doc()
    document.fill(doc, Graph(name="drawn"))
    edited = page("edit", update=doc.get_update().hex(), edits=list(edits))
    doc.apply_update(bytes.fromhex(edited["update"]))
    return document.read(doc)


def decision(page: Page) -> Graph:
    """One action decides between one without outputs and one that has some; either is led to the
    end, with nothing else said."""
    return drawn(
        page,
        ["addAction", {"name": "OxWork", "inputs": WORK}],
        ["addAction", {"name": "OxWork", "inputs": WORK}],
        ["addAction", {"name": "OxEcho", "inputs": ECHO}],
        ["addParameter", "$2", "out", "text", TEXT],
        ["setEntry", "$0"],
        ["connect", "$0", "$1", "on_true"],
        ["connect", "$0", "$2", "on_false"],
        ["setExit", "$1"],
        ["setExit", "$2"],
    )


@pytest.mark.parametrize("decided", ["on_true", "on_false"])
def test_a_decision_that_is_drawn_into_the_end_ends_either_way(page: Page, decided: str) -> None:
    graph = codec.read(codec.write(decision(page))).graph
    assert check(graph) == []
    script = Script({"OxWork_0": (Behaviour(result=decided),)})
    states = [t.state for t in simulate(graph, script=script) if isinstance(t, GraphStateEvent)]
    assert states[-1] == "FINISHED"


arrows = st.lists(
    st.tuples(
        st.integers(0, 3), st.integers(1, 4), st.sampled_from(["on_true", "on_false", "on_error"])
    ),
    min_size=2, max_size=9, unique_by=lambda arrow: (arrow[0], arrow[2]),
)  # fmt: skip


@settings(deadline=None, max_examples=examples(60))
@given(arrows, st.sets(st.integers(0, 3)), st.lists(st.sampled_from(["on_true", "on_false", "on_error"]), max_size=4))  # fmt: skip
def test_a_drawn_sequence_never_waits_at_its_end(
    page: Page, arrows: list[tuple[int, int, str]], giving: set[int], ends: list[str]
) -> None:
    forward = [(a, b, outcome) for a, b, outcome in arrows if a < b]
    edits: list[list[object]] = [["addAction", {"name": name}] for name in "ABCD"]
    edits += [["addParameter", f"${place}", "out", f"o{place}", TEXT] for place in sorted(giving)]
    edits.append(["setEntry", "$0"])
    for parent, child, outcome in forward:
        to = ["setExit", f"${parent}"] if child == 4 else ["connect", f"${parent}", f"${child}"]
        edits.append([*to, outcome])
    graph = drawn(page, *edits)
    calls = {f"{name}_0": (Behaviour(result=end),) for name, end in zip("ABCD", ends, strict=False)}
    traces = list(simulate(graph, script=Script(calls)))
    waiting = [t for t in traces if isinstance(t, NotReady) and t.node == "graph_exit_0"]
    begun = {0}
    for parent, child, _ in sorted(forward):
        begun |= {child} & {1, 2, 3} if parent in begun else set()
    leading = {parent for parent, child, _ in forward if child == 4}
    if len(leading) > 1 and leading <= begun and not waiting_elsewhere(traces):
        assert waiting == []


def waiting_elsewhere(traces: list[Trace]) -> bool:
    return any(isinstance(t, NotReady) and t.node != "graph_exit_0" for t in traces)
