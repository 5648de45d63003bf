"""The search for an arrow agrees with an engine in which every end of every action is tried."""

from collections.abc import Iterator, Mapping
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings

from action_assistant.umrf.courses.arrow_search import (
    ArrowReached,
    ArrowUndecided,
    ArrowUnreachable,
    search_arrow,
)
from action_assistant.umrf.courses.coverage import OutcomeArrow, arrows_of, arrows_taken, coverage
from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    Action,
    Conditions,
    Graph,
    Precondition,
    Relation,
)
from action_assistant.umrf.semantics import Call, Engine, Returned, Trace
from action_assistant.umrf.semantics.graphs import GraphRefused
from action_assistant.umrf.semantics.simulate import simulate
from support.doses import examples
from umrf.drawn import busy_graphs

RESULTS = ("on_true", "on_false", "on_error")
DEPTH = 4


class EveryCall:
    """Carries out all actions, none of which ends by itself."""

    takes_graphs = False

    def __init__(self) -> None:
        self.going: dict[int, Call] = {}

    def performs(self, action: Action, *, inside: bool) -> bool:
        return True

    def begin(self, call: Call) -> None:
        self.going[call.number] = call

    def stop(self, number: int) -> None: ...

    def pause(self, number: int) -> None: ...

    def resume(self, number: int) -> None: ...

    def give_up(self, number: int) -> str | None:
        self.going.pop(number, None)
        return None

    def ended(self, number: int, result: Precondition, outputs: Mapping[str, Any]) -> None: ...


def played(graph: Graph, ends: tuple[tuple[int, str], ...]) -> tuple[list[Trace], list[int]]:
    """Return the trace when calls end like this, one after the other, and the calls that are open
    then."""
    performer = EveryCall()
    engine = Engine(facts=SIMULATED, performer=performer)
    try:
        traces = engine.start(graph, 0.0)
    except GraphRefused:
        return [], []
    for step, (number, result) in enumerate(ends, 1):
        performer.going.pop(number)
        traces += engine.returned(Returned(number=number, result=result), step * 10.0)
    is_over = engine.crashed or engine.locked or engine.graphs[graph.name].state != "RUNNING"
    return traces, [] if is_over else list(performer.going)


def every_arrow(graph: Graph, depth: int) -> set[OutcomeArrow]:
    """Return all arrows that any results in any order take, up to `depth` ends, by trying all of
    them."""
    found: set[OutcomeArrow] = set()
    border: list[tuple[tuple[int, str], ...]] = [()]
    for _ in range(depth + 1):
        then = []
        for ends in border:
            traces, going = played(graph, ends)
            found |= arrows_taken(graph, traces).arrows
            then += [(*ends, (number, result)) for number in going for result in RESULTS]
        border = then
    return found


@given(busy_graphs(4))
@settings(max_examples=examples(60), deadline=None, suppress_health_check=list(HealthCheck))
def test_every_arrow_that_some_ends_take_is_found_and_no_other(
    graph: Graph,
) -> None:
    possible = every_arrow(graph, DEPTH)
    for arrow in arrows_of(graph):
        found = search_arrow(graph, arrow)
        if isinstance(found, ArrowReached):
            traces = list(simulate(graph, script=found.script, max_events=2_000))
            assert arrow in arrows_taken(graph, traces).arrows
        elif arrow in possible:
            assert isinstance(found, ArrowUndecided), (arrow, found)


def chain(*conditions: Conditions) -> Graph:
    """One after the other, the first from the entry, each child answering so."""
    keys = [f"k{n}" for n in range(len(conditions) + 1)]
    arrows = [Relation(parent=ENTRY, child="k0", conditions=ENTRY_CONDITIONS)]
    arrows += [
        Relation(parent=keys[n], child=keys[n + 1], conditions=each)
        for n, each in enumerate(conditions)
    ]
    arrows.append(Relation(parent=keys[-1], child=EXIT, conditions=Conditions("run")))
    actions = tuple(Action(key=key, name=f"A{n}") for n, key in enumerate(keys))
    return Graph(name="g", actions=actions, relations=tuple(arrows))


def script_of(found: object) -> dict[str, list[str]]:
    assert isinstance(found, ArrowReached), found
    return {
        name: [call.result for call in calls] for name, calls in found.script.behaviours.items()
    }


def test_the_script_that_is_found_says_how_each_action_ends() -> None:
    graph = chain(Conditions("ignore", "run"), Conditions("ignore", "ignore", "run"))
    found = search_arrow(graph, OutcomeArrow("k2", EXIT, "on_true"))
    said = script_of(found)
    assert said["A0_0"][0] == "on_false"
    assert said["A1_0"][0] == "on_error"


def test_an_arrow_of_a_stopped_action_is_reached_by_having_it_stopped() -> None:
    stops = Relation(parent="k1", child="k0", conditions=Conditions("stop"), required=False)
    after = Relation(
        parent="k0", child=EXIT, conditions=Conditions(on_stopped="run"), required=False
    )
    both = [Relation(parent=ENTRY, child=key, conditions=ENTRY_CONDITIONS) for key in ("k0", "k1")]
    actions = tuple(Action(key=f"k{n}", name=f"A{n}") for n in range(2))
    graph = Graph(name="g", actions=actions, relations=(*both, stops, after))
    found = search_arrow(graph, OutcomeArrow("k0", EXIT, "on_stopped"))
    assert isinstance(found, ArrowReached)
    assert found.script.behaviours["A0_0"][0].never


def test_an_arrow_that_a_bypass_takes_on_its_way_to_the_exit_is_reached() -> None:
    """Found by chance: A0 bypasses itself and A1 when it fails, and so the graph ends at once."""
    usual = Conditions("run", "run", "bypass")
    arrows = (
        Relation(parent=ENTRY, child="k0", conditions=ENTRY_CONDITIONS),
        Relation(parent="k0", child="k0", conditions=usual, required=False),
        Relation(parent="k0", child="k1", conditions=usual, required=False),
        Relation(parent="k1", child=EXIT, conditions=usual, required=False),
    )
    actions = tuple(Action(key=f"k{n}", name=f"A{n}") for n in range(2))
    graph = Graph(name="g", actions=actions, relations=arrows)
    found = search_arrow(graph, OutcomeArrow("k1", EXIT, "on_error"))
    assert not isinstance(found, ArrowUnreachable), found


def test_an_arrow_behind_something_that_waits_for_ever_is_unreachable() -> None:
    """A2 wants to hear of A3, which only A2 begins."""
    graph = chain(Conditions("run"), Conditions("run"))
    graph = Graph(
        name="g",
        actions=(*graph.actions, Action(key="k3", name="A3")),
        relations=(
            *graph.relations,
            Relation(parent="k3", child="k2", conditions=Conditions("run")),
            Relation(parent="k2", child="k3", conditions=Conditions("run")),
        ),
    )
    for arrow in (OutcomeArrow("k2", EXIT, "on_true"), OutcomeArrow("k2", "k3", "on_true")):
        assert isinstance(search_arrow(graph, arrow), ArrowUnreachable)
    assert isinstance(search_arrow(graph, OutcomeArrow("k1", "k2", "on_true")), ArrowReached)


def test_a_search_that_may_not_go_on_says_that_it_does_not_know() -> None:
    graph = chain(*[Conditions("run", "run", "run")] * 6)
    found = search_arrow(graph, OutcomeArrow("k6", EXIT, "on_true"), budget=20)
    assert isinstance(found, ArrowUndecided)


@pytest.mark.parametrize("size", [10, 100, 400])
def test_the_last_arrow_of_a_long_way_is_found(size: int) -> None:
    graph = chain(*[Conditions("ignore", "run", "run")] * size)
    assert isinstance(search_arrow(graph, OutcomeArrow(f"k{size}", EXIT, "on_true")), ArrowReached)


def found_untaken(graph: Graph) -> Iterator[OutcomeArrow]:
    for arrow in arrows_of(graph):
        if not isinstance(search_arrow(graph, arrow), ArrowReached):
            yield arrow


@given(busy_graphs(4))
@settings(max_examples=examples(40), deadline=None, suppress_health_check=list(HealthCheck))
def test_the_tests_that_are_proposed_cover_all_that_can_be_covered(graph: Graph) -> None:
    courses = []
    for arrow in arrows_of(graph):
        found = search_arrow(graph, arrow)
        if isinstance(found, ArrowReached):
            traces = list(simulate(graph, script=found.script, max_events=2_000))
            courses.append(arrows_taken(graph, traces))
    together = coverage(graph, courses)
    assert set(together.untaken) <= set(found_untaken(graph))
    assert together.taken + len(together.untaken) == together.arrows
