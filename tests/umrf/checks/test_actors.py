"""Graphs of several actors: the actors change nothing of a course, and the check names what robots could not do."""

from itertools import pairwise
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from action_assistant.umrf.check import blocking, check
from action_assistant.umrf.checks.actors import led_problems
from action_assistant.umrf.courses.expected import check_expected
from action_assistant.umrf.facts import PINNED, SIMULATED
from action_assistant.umrf.hierarchy.flattening import Flattened, flattened
from action_assistant.umrf.model import Conditions, Graph, Problem
from action_assistant.umrf.pieces import obstacles
from action_assistant.umrf.problem_kinds import kind_of
from action_assistant.umrf.semantics import Behaviour, Script, simulate
from action_assistant.umrf.semantics.steps import steps_of
from support.doses import examples
from umrf.drawn import busy_graphs
from umrf.hierarchy.hierarchies import Hierarchy, hierarchies, leaf
from umrf.hierarchy.lines import changed, inner, with_values
from umrf.semantics.traces import graph_of, optional

KINDS = {
    "actors", "synchroniser", "values-across-robots", "two-at-once", "loaded-anew",
    "spontaneous-across", "stop-across", "subgraph-across", "pause-across", "values-across",
    "values-unreadable",
}  # fmt: skip
TEXT = leaf("string")
STOPS = Conditions("stop", "stop", "ignore", "ignore")
ACTORS = st.sampled_from(["", "Carrier", "Scout"])


def owned(graph: Graph, **actors: str) -> Graph:
    """The graph with these actors, by the names of actions."""
    for name, actor in actors.items():
        graph = changed(graph, name, actor=actor)
    return graph


def told(graph: Graph, *inside: Graph, facts: Any = PINNED) -> list[tuple[str, str]]:
    """The kinds that only graphs of several actors have, each with its place: action or arrow."""
    graphs = {each.name: each for each in inside}
    found = [p for p in check(graph, facts=facts, graphs=graphs) if p.code in KINDS]
    assert {p.severity for p in found} <= {"warning"}
    return sorted((p.code, p.where.relation or p.where.aid or "") for p in found)


def of_kind(graph: Graph, code: str, *inside: Graph) -> Problem:
    graphs = {each.name: each for each in inside}
    (found,) = (p for p in check(graph, graphs=graphs) if p.code == code)
    return found


CHAIN = graph_of("entry>A", "A>B", "B>exit")
VALUES = with_values(CHAIN, A=({}, {"p": TEXT, "q": TEXT}), B=({"p": TEXT}, {}))
FORK = graph_of("entry>A", "A>B", "A>C", "B>D", "C>D", "D>exit")
LOOP = optional(graph_of("entry>A", "A>B", "B>A", "B>exit"), "B>A")


def test_a_graph_of_several_actors_plays_and_cannot_be_started_on_one_robot() -> None:
    graph = owned(CHAIN, A="Carrier", B="Scout")
    assert told(graph) == [("actors", "")]
    assert [p.code for p in blocking(check(graph))] == ["actors"]
    assert blocking(check(graph), overridden=["actors"]) == []
    assert "the runner can lead several robots" in of_kind(graph, "actors").message
    assert "(Carrier, Scout)" in of_kind(graph, "actors").message
    assert told(graph, facts=SIMULATED) == []


@pytest.mark.parametrize(
    "actors",
    [{}, {"A": "Scout", "B": "Scout"}, {"A": "Scout"}],
    ids=["none", "one", "one and none"],
)
def test_a_graph_with_at_most_one_actor_has_no_problem_of_actors(actors: dict[str, str]) -> None:
    for graph in (VALUES, FORK, LOOP, changed(CHAIN, "A", type="spontaneous")):
        assert told(owned(graph, **actors)) == []
        assert told(owned(graph, **actors), facts=replace(PINNED, synchronises=True)) == []


def test_a_missing_action_names_no_actor() -> None:
    assert told(changed(owned(CHAIN, A="Carrier", B="Scout"), "B", missing=True)) == []


def test_a_profile_that_claims_to_synchronise_is_told_the_faults_of_that() -> None:
    graph = owned(VALUES, A="Carrier", B="Scout")
    claims = replace(PINNED, synchronises=True)
    assert told(graph, facts=claims) == [("synchroniser", "")]
    (problem,) = (p for p in check(graph, facts=claims) if p.code == "synchroniser")
    assert all(fault in problem.message for fault in ("S1", "S2", "S3"))
    assert blocking(check(graph, facts=claims)) == []


def test_an_arrow_that_hands_a_value_to_another_actor_is_named() -> None:
    graph = owned(VALUES, A="Carrier", B="Scout")
    assert told(graph) == [("actors", ""), ("values-across-robots", "A>B")]
    message = of_kind(graph, "values-across-robots").message
    assert "A_0 of Carrier hands p to B_0 of Scout" in message


@pytest.mark.parametrize(
    "graph",
    [
        owned(VALUES, A="Carrier", B="Carrier"),
        with_values(CHAIN, A=({}, {"q": TEXT}), B=({"p": TEXT}, {})),
        with_values(graph_of("entry>A", "A>B", "B>exit", AB=Conditions("ignore", "bypass")),
                    A=({}, {"p": TEXT}), B=({"p": TEXT}, {})),
    ],
    ids=["the same actor", "no input takes it", "ignored or bypassed"],
)  # fmt: skip
def test_an_arrow_that_hands_no_value_to_another_actor_is_not_named(graph: Graph) -> None:
    if all(not action.actor for action in graph.actions):
        graph = owned(graph, A="Carrier", B="Scout")
    assert "values-across-robots" not in {code for code, _ in told(graph)}


POSE = leaf("geometry_msgs/Pose")
STOPPED = Conditions("run", "run", "ignore", "run")


@pytest.mark.parametrize(
    ("graph", "arrow", "why"),
    [
        (with_values(CHAIN, A=({}, {"p": POSE}), B=({"p": POSE}, {})), "A>B", "no value of the type geometry"),
        (with_values(graph_of("entry>A", "A>B", "B>exit", "entry>C", "C>A", AB=STOPPED, CA=STOPS),
                     A=({}, {"p": TEXT}), B=({"p": TEXT}, {})), "A>B", "an arrow may have stopped A_0"),
        (with_values(CHAIN, A=({}, dict.fromkeys("!#abc", TEXT)), B=({"a": TEXT}, {})), "A>B", "under other names"),
    ],
    ids=["a type that is not native", "after a stop", "names that the engine loses"],
)  # fmt: skip
@pytest.mark.parametrize("actors", [{"A": "Carrier", "B": "Scout"}, {"B": "Scout", "A": "Scout"}])
def test_values_that_a_led_start_refuses_are_said_to_be_refused(
    graph: Graph, arrow: str, why: str, actors: dict[str, str]
) -> None:
    """The package takes no such value, so naming it would promise what no start keeps."""
    extra = replace(graph.actions[0], key="D", name="D", actor="Carrier")
    graph = owned(replace(graph, actions=(*graph.actions, extra)), **actors)
    assert [each for each in told(graph) if "values" in each[0]] == [("values-unreadable", arrow)]
    assert why in of_kind(graph, "values-unreadable").message
    (obstacle,) = (each for each in obstacles(graph) if each.code == "values-across")
    assert why in obstacle.text


@pytest.mark.parametrize("taken", [leaf("number"), leaf("string", extra=',"pvf_updatable":false')])
def test_an_arrow_that_gives_no_value_needs_no_package(taken: Any) -> None:
    graph = with_values(CHAIN, A=({}, {"p": TEXT}), B=({"p": taken}, {}))
    for second in ("Carrier", "Scout"):
        graph = owned(graph, A="Carrier", B=second)
        assert not [code for code, _ in told(graph) if "values" in code]


def test_actions_without_an_actor_are_like_one_more_actor_beside_several() -> None:
    graph = graph_of("entry>A", "A>B", "B>C", "C>exit")
    graph = with_values(graph, A=({}, {"p": TEXT}), B=({"p": TEXT}, {}))
    graph = owned(graph, A="Carrier", C="Scout")
    assert ("values-across-robots", "A>B") in told(graph)
    assert "B_0 without an actor" in of_kind(graph, "values-across-robots").message


def test_two_actions_of_one_actor_that_may_run_at_once_are_both_named() -> None:
    graph = owned(FORK, A="Scout", B="Carrier", C="Carrier", D="Scout")
    assert told(graph) == [("actors", ""), ("two-at-once", "B")]
    problem = of_kind(graph, "two-at-once")
    assert "B_0 may run at the same time as C_0, both of Carrier" in problem.message
    assert [place.aid for place in problem.also] == ["C"]
    assert told(owned(FORK, A="Scout", B="Carrier", C="Scout")) == [("actors", "")]


def test_an_action_that_can_run_more_than_once_is_loaded_anew() -> None:
    back, out = Conditions("ignore", "run"), Conditions("run", "ignore")
    loop = graph_of("entry>A", "A>B", "B>A", "B>C", "C>exit", AB=out, BA=back, BC=out)
    graph = owned(optional(loop, "B>A"), A="Carrier", B="Scout", C="Carrier")
    assert told(graph) == [("actors", ""), ("loaded-anew", "A"), ("loaded-anew", "B")]
    ended = owned(LOOP, A="Carrier", B="Scout")  # its first way back is its end, too
    assert told(ended) == [("actors", ""), ("loaded-anew", "A")]
    join = graph_of("entry>A", "A>B", "A>C", "B>D", "C>D", "D>exit", Dexit=out)
    assert ("loaded-anew", "D") in told(owned(optional(join, "B>D", "C>D"), A="Carrier", B="Scout"))


def test_a_stop_arrow_does_not_make_an_action_run_again() -> None:
    graph = graph_of("entry>A", "entry>B", "A>B", "B>A", "A>exit", AB=STOPS, BA=STOPS)
    graph = owned(optional(graph, "A>B", "B>A"), A="Carrier", B="Scout")
    assert told(graph) == [("actors", ""), ("stop-across", "A>B"), ("stop-across", "B>A")]
    assert "A_0 of Carrier stops B_0 of Scout" in next(
        p.message for p in check(graph) if p.where.relation == "A>B" and p.code == "stop-across"
    )


def test_a_spontaneous_action_that_leads_to_another_actor_is_named() -> None:
    graph = graph_of("entry>A", "A>B", "B>C", "C>exit")
    graph = changed(owned(graph, A="Carrier", B="Carrier", C="Scout"), "A", type="spontaneous")
    problem = of_kind(graph, "spontaneous-across")
    assert problem.where.aid == "A"
    assert "also C_0 of another actor" in problem.message
    alone = owned(graph, C="Carrier")
    assert told(alone) == []


def test_what_a_led_start_would_refuse_or_needs_is_said_and_forbids_no_other_start() -> None:
    """In a graph of several actors, also within one of them; a graph of one is handed over."""
    pause = Conditions("run", "pause", "ignore", "ignore")
    graph = graph_of("entry>A", "A>B", "B>C", "C>exit", AB=pause)
    graph = with_values(
        graph, A=({}, {"p": TEXT}), B=({"p": TEXT}, {"q": TEXT}), C=({"q": TEXT}, {})
    )
    graph = changed(graph, "C", type="spontaneous")
    shared = graph_of("D>exit", "entry>D").actions[0]
    shared = replace(shared, actor="Scout")
    for each in (graph, owned(graph, A="Carrier", B="Carrier", C="Carrier")):
        assert told(each) == []
        several = replace(each, actions=(*each.actions, shared))
        if each is graph:  # beside one that is named, actions without an actor are no second one
            assert told(several) == []
            continue
        assert told(several) == [
            ("actors", ""),
            ("loaded-anew", "C"),
            ("pause-across", "A>B"),
            ("spontaneous-across", "C"),
            ("values-across", "A>B"),
        ]
        problems = check(several)
        assert {p.code for p in blocking(problems)} & KINDS == {"actors"}
        (pauses,) = (p for p in problems if p.code == "pause-across")
        assert pauses.message.startswith("A_0 pauses B_0.")
        (alone,) = (p for p in problems if p.code == "spontaneous-across")
        assert "C_0 of Carrier is spontaneous: it begins again by itself" in alone.message
        (values,) = (p for p in problems if p.code == "values-across")
        assert "A_0 hands p to B_0" in values.message
        assert "1 more arrow of this kind" in values.message
        assert [place.relation for place in values.also] == ["B>C"]
        assert kind_of(values) == "note"


def test_led_robots_are_named_and_two_actors_on_one_of_them_are_one() -> None:
    fork = graph_of("entry>A", "entry>B", "A>C", "B>D", "C>exit", "D>exit", CD=STOPS)
    found = led_problems(owned(fork, A="David", B="David", C="Carol", D="Carol"), PINNED)
    texts = {p.message for p in found if p.code == "two-at-once"}
    assert any(
        "A_0 may run at the same time as B_0" in each and "on David" in each for each in texts
    )
    stop = graph_of("entry>A", "A>B", "A>exit", AB=STOPS)
    for actors, words in (
        ({"A": "David", "B": "David"}, "A_0 on David stops B_0 on David"),
        ({"A": "", "B": "David"}, "A_0 in the simulator stops B_0 on David"),
    ):
        (problem,) = (
            p for p in led_problems(owned(stop, **actors), PINNED) if p.code == "stop-across"
        )
        assert words in problem.message
    loop = led_problems(owned(LOOP, A="Carol", B=""), PINNED)
    assert [p.code for p in loop] == ["loaded-anew"]
    assert "On Carol it is loaded anew" in loop[0].message
    assert led_problems(owned(fork, A="", B="", C="", D=""), PINNED) == []
    assert led_problems(owned(stop, A="David", B=""), PINNED) == []


def test_an_action_that_never_runs_is_told_nothing_of() -> None:
    graph = graph_of("entry>A", "A>exit", "B>C", "C>B", "B>A", BA=STOPS)
    graph = owned(optional(graph, "B>A"), A="Carrier", B="Scout", C="Scout")
    assert told(graph) == [("actors", "")]


# Sub-graphs


def test_actors_count_at_any_depth_and_the_action_around_lends_its_own() -> None:
    deepest = inner("entry>X", "X>Y", "Y>exit", name="T")
    deepest = with_values(deepest, X=({}, {"p": TEXT}), Y=({"p": TEXT}, {}))
    middle = inner("entry>T", "T>exit")
    outer = graph_of("entry>A", "A>S", "S>exit")
    assert told(outer, middle, deepest) == []
    shared = owned(deepest, Y="Scout")
    assert told(owned(outer, S="Scout"), middle, shared) == []
    found = told(owned(outer, A="Carrier", S="Scout"), middle, shared)
    assert found == [("actors", "")]
    found = told(owned(outer, A="Carrier"), owned(middle, T="Carrier"), shared)
    assert found == [("actors", ""), ("subgraph-across", "S"), ("values-across-robots", "S")]
    problem = of_kind(owned(outer, S="Carrier"), "values-across-robots", middle, shared)
    place = problem.inside
    assert place is not None
    assert (place.levels, place.aids, place.graph) == (("S_0", "T_0"), ("S", "T"), "T")
    assert place.where.relation == "X>Y"
    assert "X_0 of Carrier hands p to Y_0 of Scout" in problem.message


def test_an_arrow_to_a_sub_graph_leads_to_the_actor_of_its_first_action() -> None:
    outer = graph_of("entry>A", "A>S", "S>B", "B>exit")
    outer = with_values(outer, A=({}, {"p": TEXT}), S=({"p": TEXT}, {}))
    sub = with_values(inner("entry>X", "X>Y", "Y>exit"), X=({"p": TEXT}, {}))
    sub = owned(sub, X="Carrier", Y="Scout")
    found = told(owned(outer, A="Carrier"), sub)
    assert found == [("actors", ""), ("subgraph-across", "S"), ("values-across", "A>S")]
    found = told(owned(outer, A="Scout"), sub)
    assert found == [("actors", ""), ("subgraph-across", "S"), ("values-across-robots", "A>S")]


def test_a_sub_graph_of_several_actors_is_named_once_and_one_of_one_actor_is_not() -> None:
    middle, deepest = inner("entry>T", "T>exit"), inner("entry>X", "X>Y", "Y>exit", name="T")
    outer = owned(graph_of("entry>A", "A>S", "S>exit"), A="Carrier")
    alone = owned(deepest, X="Scout", Y="Scout")
    assert "subgraph-across" not in {code for code, _ in told(outer, middle, alone)}
    problem = of_kind(outer, "subgraph-across", middle, owned(deepest, X="Scout"))
    assert problem.where.aid == "S"
    assert "S_0 stands for a graph of several actors (Scout; some name none)" in problem.message


def test_levels_that_double_are_looked_at_for_a_moment_only() -> None:
    library = {
        f"{side}{level}": owned(
            inner(f"entry>L{level + 1}", f"L{level + 1}>R{level + 1}", f"R{level + 1}>exit", name=f"{side}{level}"),
            **{f"L{level + 1}": "Carrier", f"R{level + 1}": "Scout"},
        )
        for level in range(60)
        for side in "LR"
    }  # fmt: skip
    found = check(graph_of("entry>L0", "L0>R0", "R0>exit"), graphs=library)
    assert "actors" in {problem.code for problem in found}


def test_an_expected_course_holds_for_any_actors() -> None:
    shared, alone = owned(VALUES, A="Carrier", B="Scout"), owned(VALUES, A="Scout", B="Scout")
    steps = steps_of(simulate(shared))
    assert ("result", "on_true") in {(step.what, step.how) for step in steps if step.node == "B_0"}
    script = Script({})
    for was, now in ((shared, shared), (shared, alone), (alone, shared)):
        assert check_expected(was, steps, script, now).apart is None


# Any graph


@st.composite
def scripts(draw: st.DrawFn) -> Script:
    names = draw(st.sets(st.sampled_from(["*", *(f"A{n}_0" for n in range(12))]), max_size=6))
    calls = st.builds(
        Behaviour,
        after_s=st.sampled_from([0.2, 1.0, 3.0]),
        result=st.sampled_from(["on_true", "on_true", "on_false", "on_error"]),
        load_s=st.sampled_from([0.0, 0.5]),
    )
    return Script({name: tuple(draw(st.lists(calls, min_size=1, max_size=3))) for name in names})


def with_actors(data: st.DataObject, graph: Graph) -> Graph:
    return replace(
        graph, actions=tuple(replace(each, actor=data.draw(ACTORS)) for each in graph.actions)
    )


def without_actors(graph: Graph) -> Graph:
    return replace(graph, actions=tuple(replace(each, actor="") for each in graph.actions))


def course(graph: Graph, script: Script, graphs: Any, commands: Any = ()) -> list[Any]:
    traces = simulate(graph, script=script, library=graphs, commands=commands, max_events=2_000)
    return [replace(t, actor="") if hasattr(t, "actor") else t for t in traces]


def same_but_for_actors(graph: Graph, plain: Graph, graphs: Any = None, bare: Any = None) -> None:
    found = [p for p in check(graph, graphs=graphs) if p.code not in KINDS]
    assert found == check(plain, graphs=bare)
    told = check(graph, facts=SIMULATED, graphs=graphs)
    assert told == check(plain, facts=SIMULATED, graphs=bare)


@pytest.mark.timeout(900)
@given(st.data(), busy_graphs(), scripts(), st.none() | st.integers(1, 5_000))
@settings(max_examples=examples(150), deadline=None, suppress_health_check=list(HealthCheck))
def test_actors_change_nothing_of_a_course(
    data: st.DataObject, plain: Graph, script: Script, stop_ms: int | None
) -> None:
    lively = data.draw(st.sets(st.sampled_from([a.key for a in plain.actions]), max_size=1))
    kinds = (replace(a, type="spontaneous") if a.key in lively else a for a in plain.actions)
    plain = replace(plain, actions=tuple(kinds))
    graph = with_actors(data, plain)
    commands = [] if stop_ms is None else [(float(stop_ms), "stop", None)]
    assert course(graph, script, {}, commands) == course(plain, script, {}, commands)
    same_but_for_actors(graph, plain)


@pytest.mark.timeout(900)
@given(st.data(), hierarchies(wired=True), scripts())
@settings(max_examples=examples(100), deadline=None, suppress_health_check=list(HealthCheck))
def test_actors_change_nothing_of_a_hierarchy_and_stay_in_the_flat_graph(
    data: st.DataObject, hierarchy: Hierarchy, script: Script
) -> None:
    plain, bare = hierarchy.graph, hierarchy.graphs
    bare = {name: without_actors(each) for name, each in bare.items()}
    graph = with_actors(data, plain)
    graphs = {name: with_actors(data, each) for name, each in bare.items()}
    assert course(graph, script, graphs) == course(plain, script, bare)
    same_but_for_actors(graph, plain, graphs, bare)
    flat, other = flattened(graph, graphs), flattened(plain, bare)
    if not isinstance(flat, Flattened) or not isinstance(other, Flattened):
        assert flat == other
        return
    assert without_actors(flat.graph) == other.graph
    assert flat.origins == other.origins
    for action, origin in zip(flat.graph.actions, flat.origins, strict=True):
        around = [graph, *(graphs[level.action.rpartition("_")[0]] for level in origin.levels[:-1])]
        named = [
            next(a.actor for a in each.actions if a.key == level.key)
            for each, level in zip(around, origin.levels, strict=True)
        ]
        assert action.actor == next((name for name in reversed(named) if name), "")


def test_each_event_of_an_action_names_its_actor() -> None:
    sub = inner("entry>X", "X>Y", "Y>exit")
    outer = owned(graph_of("entry>A", "A>S", "S>exit"), A="Carrier", S="Scout")
    sub = owned(sub, Y="Arm")
    found = {
        (trace.node, trace.actor)
        for trace in simulate(outer, library={"S": sub})
        if hasattr(trace, "actor")
    }
    assert found == {("A_0", "Carrier"), ("S_0", "Scout"), ("X_0", "Scout"), ("Y_0", "Arm")}
    assert not any(b"actor" in msgspec.json.encode(trace) for trace in simulate(CHAIN))


def test_a_graph_of_many_spontaneous_actions_is_looked_at_for_a_moment_only() -> None:
    names = [f"A{n}" for n in range(300)]
    graph = graph_of(
        "entry>A0", *(f"{one}>{two}" for one, two in pairwise(names)), f"{names[-1]}>exit"
    )
    kinds = (replace(a, type="spontaneous", actor=f"R{n % 3}") for n, a in enumerate(graph.actions))
    found = check(replace(graph, actions=tuple(kinds)))
    across = [p for p in found if p.code == "spontaneous-across"]
    assert len(across) == 300
    assert max(len(problem.also) for problem in found if problem.code in KINDS) == 20
