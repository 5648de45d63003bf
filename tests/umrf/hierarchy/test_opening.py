"""Breakpoints of a graph whose sub-graphs are opened."""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from random import Random

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from action_assistant.umrf.breakpoints import (
    TOLD,
    Breakpoint,
    NoSuchPlace,
    Told,
    ValueTest,
    pinned,
)
from action_assistant.umrf.hierarchy.flattening import Flattened, flattened
from action_assistant.umrf.hierarchy.opening import (
    CannotOpen,
    OpenedGraph,
    opened,
    opened_breakpoints,
)
from action_assistant.umrf.model import Conditions, Graph
from action_assistant.umrf.semantics import Behaviour, Script
from runner.execution.test_conducted_subgraphs import ALWAYS, going_on, named
from runner.harness import sequence
from support.doses import examples
from umrf.hierarchy.hierarchies import (
    BYPASS,
    Course,
    Hierarchy,
    course,
    hierarchies,
    nested_names,
    outputs_of,
)


def task(inside: int = 2) -> OpenedGraph:
    """`Work_0` → `Pick_0`, a graph of some actions, → `Work_2`."""
    graph = going_on(named(sequence("task", 3), "Work", "Pick"))
    return opened(graph, {"Pick": going_on(sequence("Pick", inside))})


INSIDE = {"Pick": going_on(sequence("Pick", 2))}


def translated(found: OpenedGraph, **place: object) -> list[tuple[str, str, tuple[Told, ...]]]:
    each = msgspec.convert(place, Breakpoint)
    return [(one.action, one.to, one.outcomes) for one in opened_breakpoints(found, [each], INSIDE)]


def test_the_opened_graph_keeps_its_name_and_says_where_its_actions_are() -> None:
    found = task()
    assert found.graph.name == "task"
    assert [each.full_name for each in found.graph.actions] == [
        "Work_0",
        *found.levels,
        "Work_2",
    ]
    assert set(found.levels.values()) == {("Pick_0",)}


def test_a_breakpoint_at_a_sub_graph_is_where_that_begins_or_ends() -> None:
    found = task()
    first, last = found.levels
    assert translated(found, action="Pick_0") == [(first, "", ())]
    assert translated(found, action="Pick_0", outcomes=("false",)) == [(last, "", ("false",))]
    assert translated(found, action="Work_0", to="Pick_0") == [("Work_0", first, ())]
    assert translated(found, action="Pick_0", to="Work_2") == [(last, "Work_2", ())]
    assert translated(found, action="Work_2") == [("Work_2", "", ())]
    assert translated(found, action="Work_2", to="exit") == [("Work_2", "exit", ())]


def test_a_value_that_the_first_action_inside_lacks_is_no_condition() -> None:
    test = ValueTest("nothing", "==", 1.0)
    (one,) = opened_breakpoints(task(), [Breakpoint(action="Pick_0", value=test)], INSIDE)
    assert one.value is None


def test_visits_of_a_sub_graph_are_no_visits_of_its_actions_and_a_place_that_has_two_waits_at_both() -> (
    None
):
    found = task()
    first, last = found.levels
    inside = opened_breakpoints(
        found,
        [
            Breakpoint(action=first, visit=7),
            Breakpoint(action="Pick_0", visit=1),
            Breakpoint(action="Pick_0", outcomes=("false",), visit=1),
            Breakpoint(action=last, outcomes=("true",), visit=2),
            Breakpoint(action="Work_0", to="Pick_0", visit=2),
            Breakpoint(action="Pick_0", to="Work_2", visit=1),
        ],
        INSIDE,
    )
    assert inside == (
        Breakpoint(action=first),
        Breakpoint(action=last, outcomes=("true", "false")),
        Breakpoint(action="Work_0", to=first, visit=2),
        Breakpoint(action=last, to="Work_2"),
    )


@pytest.mark.parametrize(("action", "to"), [("Pick_0", "Work_9"), ("Work_2", "Pick_0")])
def test_a_breakpoint_for_which_nothing_stands_is_refused(action: str, to: str) -> None:
    with pytest.raises(NoSuchPlace, match="no place for a breakpoint after"):
        opened_breakpoints(task(), [Breakpoint(action=action, to=to)], INSIDE)


def test_the_end_of_a_sub_graph_is_also_where_its_last_action_is_bypassed() -> None:
    inner = going_on(sequence("Pick", 2))
    skips = Conditions("run", "bypass", "bypass")
    relations = tuple(
        replace(each, conditions=skips) if each.parent != "entry" and each.child != "exit" else each
        for each in inner.relations
    )
    graph = going_on(named(sequence("task", 3), "Work", "Pick"))
    found = opened(graph, {"Pick": replace(inner, relations=relations)})
    first, last = found.levels
    ends = TOLD
    assert translated(found, action="Pick_0", outcomes=ends) == [
        (last, "", ends),
        (first, "", ("false", "error")),
    ]
    assert translated(found, action="Pick_0", to="Work_2", outcomes=("false",)) == [
        (last, "Work_2", ("false",)),
        (first, "", ("false",)),
    ]


def test_a_breakpoint_of_a_sub_graph_counts_wherever_that_stands() -> None:
    """`Pick` stands twice, once inside of `Fetch`; its `to="exit"` is no end of the graph itself."""
    pick = INSIDE["Pick"]
    first, last = (each.full_name for each in pick.actions)
    graphs = {"Pick": pick, "Fetch": going_on(named(sequence("Fetch", 2), "Pick", "Work"))}
    found = opened(going_on(named(sequence("task", 3), "Pick", "Fetch", "Work")), graphs)
    here = {each: path[-1].action for each, path in found.paths.items() if path[-1].graph == "Pick"}
    firsts = {each for each, name in here.items() if name == first}
    lasts = set(here) - firsts
    assert len(firsts) == len(lasts) == 2

    def placed(**place: object) -> list[Breakpoint]:
        return list(opened_breakpoints(found, [msgspec.convert(place, Breakpoint)], graphs))

    assert {each.action for each in placed(action=first, inside="Pick", visit=7)} == firsts
    assert {each.visit for each in placed(action=first, inside="Pick", visit=7)} == {0}
    ends = placed(action=last, to="exit", inside="Pick")
    assert {each.action for each in ends} == lasts
    assert {(each.to, each.outcomes) for each in ends} == {("", TOLD)}
    between = placed(action=first, to=last, inside="Pick")
    assert {(each.action, each.to) for each in between} == {
        (one, other)
        for one in firsts
        for other in lasts
        if found.paths[one][:-1] == found.paths[other][:-1]
    }
    (around,) = placed(action="Pick_0", inside="Fetch")
    assert around.action in firsts


@pytest.mark.parametrize(
    ("place", "why"),
    [
        ({"action": "Work_9", "inside": "Pick"}, "In Pick: There is no action Work_9."),
        ({"action": "Work_0", "inside": "Drop"}, "There is no sub-graph Drop."),
        ({"action": "Work_0", "to": "exit", "inside": "Pick"}, "There is no arrow from Work_0"),
    ],
)
def test_a_breakpoint_that_the_sub_graph_has_no_place_for_is_refused(
    place: dict[str, str], why: str
) -> None:
    with pytest.raises(NoSuchPlace, match=why):
        opened_breakpoints(task(), [msgspec.convert(place, Breakpoint)], INSIDE)


def test_what_is_not_known_to_do_the_same_is_not_opened() -> None:
    graph = going_on(named(sequence("task", 2), "Pick"))
    with pytest.raises(CannotOpen, match="one by one"):
        opened(graph, {"Pick": going_on(named(sequence("Pick", 2), "Pick"))})


# Against the courses of the graph itself


def waits(
    own: Mapping[str, list[tuple[float, str]]],
    breakpoints: Iterable[Breakpoint],
    standing: Mapping[tuple[str, str], Collection[str]],
) -> set[float]:
    """Return when a run with this course would wait at breakpoints without values. `standing`: the places
    of the actions of sub-graphs, by graph and full name there."""
    found = set[float]()
    for each in breakpoints:
        for name in standing.get((each.inside, each.action), (each.action,)):
            visit, runs = 0, False
            for at, what in own.get(name, ()):
                if what == "RUNNING":
                    visit, runs = visit + 1, True
                    is_here = not each.is_at_end
                elif what.startswith("ends"):
                    is_here = runs and what.removeprefix("ends on_") in each.outcomes
                    runs = False
                else:
                    continue
                if is_here and each.visit in {0, visit}:
                    found.add(at)
    return found


def places_of(found: Flattened) -> dict[tuple[str, str], str]:
    """Return a name for each action at each level of a hierarchy, by running graph and full name there."""
    names = dict[tuple[str, str], str]()
    for origin in found.origins:
        running, path = found.graph.name, ""
        for level in origin.levels:
            path += f"/{level.action}"
            names[running, level.action] = path
            action, _, number = level.action.rpartition("_")
            running += f"__{action}__{number}"
    return names


def standing_in(found: Flattened) -> dict[tuple[str, str], set[str]]:
    """Return the names of `places_of` by graph and full name there; by "" and full name for the top graph."""
    standing = dict[tuple[str, str], set[str]]()
    for origin in found.origins:
        path = ""
        for depth, level in enumerate(origin.levels):
            path += f"/{level.action}"
            standing.setdefault((level.graph if depth else "", level.action), set()).add(path)
    return standing


def played(
    hierarchy: Hierarchy, found: Flattened, behaviours: Mapping[str, tuple[Behaviour, ...]]
) -> tuple[Course, Course]:
    """The courses of the hierarchy, with its sub-graphs as actions, and of the flat graph."""
    places = nested_names(found)
    deep = Script({f"{run}/{name}": behaviours[flat] for flat, (run, name) in places.items()})
    wide = Script({f"{found.graph.name}/{flat}": calls for flat, calls in behaviours.items()})
    alike = {(found.graph.name, flat): flat for flat in places}
    return (
        course(hierarchy.graph, hierarchy.graphs, deep, places_of(found)),
        course(found.graph, {}, wide, alike),
    )


def marks(draw: st.DrawFn, graph: Graph, chosen: Collection[str]) -> list[Breakpoint]:
    """A few breakpoints at actions with these names that a run of the graph could have."""
    places: list[tuple[str, str, bool]] = []
    names = {each.key: each.full_name for each in graph.actions} | {"exit": "exit"}
    subs = {each.key for each in graph.actions if each.name in chosen}
    places += [(names[key], "", is_at_end) for key in subs for is_at_end in (False, True)]
    places += [
        (names[each.parent], names[each.child], True)
        for each in graph.relations
        if each.parent != "entry" and subs & {each.parent, each.child}
    ]
    if not places:
        return []
    told = st.sets(st.sampled_from(TOLD), min_size=1).map(lambda d: tuple(sorted(d)))
    return [
        Breakpoint(
            action=action, to=to, visit=draw(st.integers(0, 2)), outcomes=draw(told) if end else ()
        )
        for action, to, end in draw(
            st.lists(st.sampled_from(places), min_size=1, max_size=3, unique=True)
        )
    ]


@st.composite
def marked(draw: st.DrawFn) -> tuple[Hierarchy, tuple[Breakpoint, ...]]:
    """A hierarchy in whose sub-graphs actions are often bypassed, with breakpoints."""
    drawn = draw(hierarchies())
    said = st.sampled_from([None, None, BYPASS, ALWAYS])
    graphs = {
        name: replace(
            graph,
            relations=tuple(
                replace(each, conditions=draw(said) or each.conditions)
                if each.parent != "entry"
                else each
                for each in graph.relations
            ),
        )
        for name, graph in drawn.graphs.items()
    }
    try:
        own = pinned(drawn.graph, marks(draw, drawn.graph, drawn.graphs))
        inner = [
            replace(each, inside=name)
            for name, graph in graphs.items()
            if draw(st.booleans())
            for each in pinned(graph, marks(draw, graph, {action.name for action in graph.actions}))
        ]
    except NoSuchPlace:
        return drawn, ()
    return Hierarchy(drawn.graph, graphs), (*own, *inner)


def test_an_opened_run_waits_wherever_the_graph_itself_would_or_its_breakpoints_are_refused() -> (
    None
):
    told = Counter[str]()

    @settings(
        max_examples=examples(300), deadline=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )  # fmt: skip
    @given(drawn=marked(), seed=st.integers(0, 2**32))
    def play(drawn: tuple[Hierarchy, tuple[Breakpoint, ...]], seed: int) -> None:
        hierarchy, breakpoints = drawn
        flat = flattened(hierarchy.graph, hierarchy.graphs)
        if not isinstance(flat, Flattened) or not breakpoints:
            return
        found = opened(hierarchy.graph, hierarchy.graphs)
        try:
            inside = pinned(found.graph, opened_breakpoints(found, breakpoints, hierarchy.graphs))
        except NoSuchPlace:
            told["refused"] += 1
            return
        random = Random(seed)
        for _ in range(12):
            results = {
                each.action: tuple(
                    Behaviour(
                        after_s=random.choice((0.2, 1, 3)) + 2.0**place / 1024,
                        result=random.choice(("on_true", "on_false", "on_error")),
                        outputs=outputs_of(flat.graph, each.action, call),
                    )
                    for call in range(3)
                )
                for place, each in enumerate(flat.origins)
            }
            nested, opens = played(hierarchy, flat, results)
            before = waits(nested.own, breakpoints, standing_in(flat))
            after = waits(opens.own, inside, {})
            told["waits"] += len(before)
            told["inside"] += any(each.inside for each in breakpoints) and len(before)
            assert before <= after

    play()
    assert told["waits"] > told["inside"] > told["refused"]
