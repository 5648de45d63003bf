"""The two graphs of an extraction: names, drawing, unknown fields and interface."""

import pytest
from msgspec.structs import replace

from action_assistant.umrf.hierarchy.extraction import Extracted, Unextractable, extracted
from umrf.hierarchy.hierarchies import leaf
from umrf.hierarchy.lines import with_values
from umrf.hierarchy.test_extraction import CHAIN, SAFE, TEXT, with_arrows


@pytest.mark.parametrize("name", ["", "  ", "g", "A", "graph_exit"])
def test_a_name_that_would_stand_for_something_else_is_refused(name: str) -> None:
    found = extracted(CHAIN, {"B"}, name, "new")
    assert isinstance(found, Unextractable)
    assert [reason.code for reason in found.reasons] == ["name"]


def test_layout_labels_and_unknown_fields_are_kept() -> None:
    at = {"A": (0.0, 0.0), "B": (0.0, 200.0), "C": (100.0, 400.0), "D": (0.0, 600.0)}
    graph = replace(
        CHAIN,
        actions=tuple(
            replace(a, position=at[a.name], extra=(("mark", "1"),)) for a in CHAIN.actions
        ),
        relations=tuple(
            replace(r, waypoints=(("run", "[[5,5]]"),), parents_extra=(("why", '"x"'),))
            for r in CHAIN.relations
        ),
        extra=(("gui_attributes", '{"labels":["night"],"zoom":2}'), ("team", '"red"')),
        notes=(("n", '{"kind":"note","at":[5,1]}'),),
    )  # fmt: skip
    found = extracted(graph, {"B", "C"}, "S", "new")
    assert isinstance(found, Extracted)
    assert [(a.name, a.position, a.extra) for a in found.inner.actions] == [
        ("B", (0.0, 200.0), (("mark", "1"),)), ("C", (100.0, 400.0), (("mark", "1"),)),
    ]  # fmt: skip
    assert dict(found.inner.extra) == {"gui_attributes": '{"labels":["night"]}'}
    assert [(a.name, a.position) for a in found.outer.actions] == [
        ("A", (0.0, 0.0)), ("S", (50.0, 300.0)), ("D", (0.0, 600.0)),
    ]  # fmt: skip
    assert (found.outer.extra, found.outer.notes) == (graph.extra, graph.notes)
    arrows = {(r.parent, r.child): r for r in (*found.inner.relations, *found.outer.relations)}
    assert arrows["B", "C"].waypoints == (("run", "[[5,5]]"),)
    assert arrows["A", "new"].parents_extra == (("why", '"x"'),)
    assert arrows["entry", "A"].waypoints == (("run", "[[5,5]]"),)


def test_the_interface_has_values_that_cross_the_border_and_missing_ones() -> None:
    graph = with_values(
        CHAIN,
        A=({}, {"p": TEXT}),
        B=({"p": leaf("string", '"x"'), "own": leaf("number", "5"), "open": TEXT}, {"q": TEXT}),
        C=({"q": TEXT}, {"r": TEXT}),
        D=({"r": TEXT}, {}),
    )
    found = extracted(with_arrows(graph, SAFE), {"B", "C"}, "S", "new")
    assert isinstance(found, Extracted)
    action = next(a for a in found.outer.actions if a.key == "new")
    assert [(p.path, p.text) for p in action.inputs] == [
        ("p", leaf("string", '"x"')), ("open", TEXT),
    ]  # fmt: skip
    assert [p.path for p in action.outputs] == ["r"]
    inputs = {p.path: p.text for p in found.inner.actions[0].inputs}
    assert inputs == {"p": TEXT, "own": leaf("number", "5"), "open": TEXT}
