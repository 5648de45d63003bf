"""Repeated runs that the arrows exclude never happen in a simulation."""

import itertools
from collections import Counter

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.laps import laps
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    RESPONSES,
    Action,
    Conditions,
    Graph,
    Relation,
)
from action_assistant.umrf.semantics import NodeStateEvent, script_from, simulate
from support.doses import examples

ANSWERS = st.sampled_from(["run", "run", "run", "ignore", "bypass", *RESPONSES])
CONDITIONS = st.builds(
    Conditions, on_true=ANSWERS, on_false=ANSWERS, on_error=ANSWERS, on_stopped=ANSWERS
)


@st.composite
def graphs(draw: st.DrawFn) -> Graph:
    """Up to five actions with any arrows between them, loops too."""
    keys = [f"a{i}" for i in range(draw(st.integers(2, 5)))]
    pairs = draw(
        st.lists(st.tuples(st.sampled_from(keys), st.sampled_from([*keys, EXIT])), unique=True)
    )
    entries = draw(st.lists(st.sampled_from(keys), min_size=1, unique=True))
    relations = [Relation(parent=ENTRY, child=key, conditions=ENTRY_CONDITIONS) for key in entries]
    relations += [
        Relation(
            parent=parent, child=child, conditions=draw(CONDITIONS), required=draw(st.booleans())
        )
        for parent, child in pairs
    ]
    actions = tuple(
        Action(
            key=key,
            name="Work",
            instance_id=i,
            type=draw(st.sampled_from(["sync"] * 9 + ["spontaneous"])),
        )
        for i, key in enumerate(keys)
    )
    return Graph(name="any", actions=actions, relations=tuple(relations))


@settings(max_examples=examples(300), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    graph=graphs(),
    results=st.lists(st.sampled_from(["on_true", "on_false", "on_error"]), min_size=5, max_size=5),
    times=st.lists(st.sampled_from([0.1, 0.3, 0.7, 1.1]), min_size=5, max_size=5),
)
def test_an_action_runs_no_more_often_than_its_arrows_are_said_to_allow(
    graph: Graph, results: list[str], times: list[float]
) -> None:
    script = {
        f"Work_{i}": [{"result": result, "after_s": time}]
        for i, (result, time) in enumerate(zip(results, times, strict=True))
    }
    told = laps(graph)
    begun: Counter[str] = Counter()
    failed = False
    for trace in simulate(
        graph,
        script=script_from({"behaviours": script}),
        facts=SIMULATED,
        until_ms=20_000,
        max_events=2_000,
    ):
        if isinstance(trace, NodeStateEvent):
            failed = failed or trace.state == "ERROR"
            begun[trace.node] += trace.state == "RUNNING"
    sure = set(told.once) - (set(told.barring_errors) if failed else set())
    assert all(begun[name] <= 1 for name in sure), (sure, begun)
    for child, parent, besides in (*told.needs, *laps(graph, inside=True).needs):
        assert begun[child] <= begun[parent] + besides, (child, parent, begun)


def test_a_parent_that_outcomes_are_passed_on_past_is_not_needed() -> None:
    first, second, third = (Action(key=key, name=key.upper()) for key in "abc")
    past = Conditions(on_true="bypass", on_false="run")
    entry = Relation(parent=ENTRY, child="a", conditions=ENTRY_CONDITIONS)
    go = Conditions(on_true="run", on_false="ignore")
    for arrow, needed in ((go, ("C_0", "B_0", 0)), (past, ("B_0", "A_0", 0))):
        loop = (
            entry,
            Relation(parent="a", child="b", conditions=arrow),
            Relation(parent="b", child="c", conditions=go),
            Relation(parent="c", child="a", conditions=go, required=False),
        )
        needs = laps(Graph(name="g", actions=(first, second, third), relations=loop)).needs
        assert needed in needs
        assert (("C_0", "B_0", 0) in needs) == (arrow is go)


def test_a_line_and_a_join_run_once_and_a_loop_does_not() -> None:
    names = ("entry", "a", "b", "c")
    go = Conditions(on_true="run", on_false="run", on_error="bypass")
    actions = tuple(Action(key=key, name=key.upper()) for key in names[1:])
    line = tuple(
        Relation(parent=one, child=other, conditions=ENTRY_CONDITIONS if one == ENTRY else go)
        for one, other in itertools.pairwise(names)
    )
    graph = Graph(name="g", actions=actions, relations=line)
    assert laps(graph).once == ("A_0", "B_0", "C_0")
    assert laps(graph).barring_errors == ()
    back = Relation(parent="c", child="b", conditions=go, required=False)
    assert laps(Graph(name="g", actions=actions, relations=(*line, back))).once == ("A_0",)
    across = Relation(parent="a", child="c", conditions=go)
    joined = laps(Graph(name="g", actions=actions, relations=(*line, across)))
    assert joined.once == ("A_0", "B_0", "C_0")
    assert joined.barring_errors == ("C_0",)
