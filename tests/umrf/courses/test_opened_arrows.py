"""The arrows that a course takes while the sub-graphs of its graph are opened."""

from collections import Counter
from random import Random

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from action_assistant.umrf.courses.coverage import (
    TakenArrows,
    arrows_taken,
    arrows_taken_opened,
)
from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.hierarchy.flattening import Flattened, flattened
from action_assistant.umrf.model import Conditions
from action_assistant.umrf.semantics import Behaviour, Script, simulate
from action_assistant.umrf.semantics.trace import NodeResultEvent, Trace
from support.doses import examples, is_share
from umrf.hierarchy.hierarchies import Hierarchy, hierarchies, nested_names, outputs_of
from umrf.hierarchy.lines import inner
from umrf.semantics.traces import graph_of

RESULTS = ("on_true", "on_false", "on_error")


def played(hierarchy: Hierarchy, script: Script) -> list[Trace]:
    found = simulate(
        hierarchy.graph,
        script=script,
        library=hierarchy.graphs,
        facts=SIMULATED,
        until_ms=40_000,
        max_events=20_000,
    )
    return list(found)


def both(
    hierarchy: Hierarchy, found: Flattened, behaviours: dict[str, Behaviour]
) -> tuple[TakenArrows, TakenArrows] | None:
    """The arrows that the hierarchy takes, and those of its opened graph; None if two actions ended at one
    instant, so that their order is nobody's choice."""
    top = hierarchy.graph
    places = nested_names(found)
    deep = {f"{run}/{name}": (behaviours[flat],) for flat, (run, name) in places.items()}
    nested = played(hierarchy, Script(deep))
    wide = {f"{found.graph.name}/{flat}": (each,) for flat, each in behaviours.items()}
    flat = played(Hierarchy(found.graph, {}), Script(wide))
    ends = Counter(each.t_ms for each in flat if isinstance(each, NodeResultEvent))
    if any(count > 1 for count in ends.values()):
        return None
    tops = {each.action: each.levels[0].key for each in found.origins}
    return arrows_taken(top, nested), arrows_taken_opened(top, tops, found.graph, flat)


def test_an_opened_course_takes_the_arrows_that_the_whole_graph_takes() -> None:
    told = Counter[str]()

    @settings(
        max_examples=examples(150),
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )
    @given(hierarchy=hierarchies(), seed=st.integers(0, 2**32))
    def play(hierarchy: Hierarchy, seed: int) -> None:
        told["hierarchies"] += 1
        found = flattened(hierarchy.graph, hierarchy.graphs)
        if not isinstance(found, Flattened):
            return
        random = Random(seed)
        names = [each.action for each in found.origins]
        for _ in range(9):
            places = random.sample(range(len(names)), len(names))
            behaviours = {
                name: Behaviour(
                    after_s=random.choice((0.2, 1, 3, 7)) + 2.0**place / 1024,
                    result=random.choice(RESULTS),
                    outputs=outputs_of(found.graph, name, 0),
                )
                for name, place in zip(names, places, strict=True)
            }
            compared = both(hierarchy, found, behaviours)
            if compared is not None:
                told["compared"] += 1
                told["of graphs inside"] += any(len(each.levels) > 1 for each in found.origins)
                assert compared[1] == compared[0]

    play()
    assert is_share(told["of graphs inside"], told["compared"], 1 / 10)


def test_an_arrow_after_a_sub_graph_is_taken_with_the_outcome_of_the_last_that_ends_it() -> None:
    either = Conditions("run", "run", "run")
    whole = graph_of("entry>A", "A>S", "S>B", "B>exit", SB=either)
    inside = inner("entry>X", "entry>Y", "X>exit", "Y>exit", Xexit=either, Yexit=either)
    hierarchy = Hierarchy(whole, {"S": inside})
    found = flattened(hierarchy.graph, hierarchy.graphs)
    assert isinstance(found, Flattened)
    played = {each.action: Behaviour(after_s=1) for each in found.origins}
    last = next(each.action for each in found.origins if each.levels[-1].key == "Y")
    compared = both(hierarchy, found, played | {last: Behaviour(after_s=2, result="on_false")})
    assert compared is not None
    assert compared[1] == compared[0]
    assert {each.outcome for each in compared[1].arrows if each.parent == "S"} == {"on_false"}
    assert compared[1].actions == {"A", "S", "B"}
