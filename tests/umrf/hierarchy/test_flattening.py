"""A flat graph does what its hierarchy does, action by action."""

from collections import Counter
from itertools import product
from random import Random

from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st

from action_assistant.umrf.hierarchy.flattening import Flattened, Unflattenable, flattened
from action_assistant.umrf.semantics import Behaviour
from support.doses import examples
from umrf.hierarchy.hierarchies import Hierarchy, both, hierarchies, outputs_of

RESULTS = ("on_true", "on_false", "on_error")
#: Scripts that one flat graph is tried with: all combinations of results where there are no more.
MOST = 81


def agree(hierarchy: Hierarchy, found: Flattened, random: Random, stop: bool) -> int:
    """Plays both under many scripts; how many courses were compared."""
    names = [origin.action for origin in found.origins]
    every = list(product(RESULTS, repeat=len(names))) if 3 ** len(names) <= MOST else []
    combinations = every or [tuple(random.choices(RESULTS, k=len(names))) for _ in range(MOST)]
    compared = 0
    for results in combinations:
        places = random.sample(range(len(names)), len(names))
        behaviours = {}
        for name, result, place in zip(names, results, places, strict=True):
            after_s = 1 + 2.0**place / 64
            behaviours[name] = tuple(
                Behaviour(after_s=after_s, result=each, outputs=outputs_of(found.graph, name, call))
                for call, each in enumerate(
                    (result, random.choice(RESULTS), random.choice(RESULTS))
                )
            )
        stop_ms = random.uniform(1, 8_000) if stop else None
        nested, flat = both(hierarchy, found, behaviours, stop_ms)
        if nested.tied:
            continue
        compared += 1
        assert flat.own == nested.own
        assert flat.instants == nested.instants
        assert flat.hazards == nested.hazards
        assert flat.result == nested.result
        if stop:
            assert [state for _, state in flat.top] == [state for _, state in nested.top]
        else:
            assert flat.top == nested.top
    return compared


@settings(
    max_examples=examples(300), deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)  # fmt: skip
@given(hierarchy=hierarchies(), seed=st.integers(0, 2**32), stop=st.booleans())
def test_a_flat_graph_does_what_its_hierarchy_does(
    hierarchy: Hierarchy, seed: int, stop: bool
) -> None:
    found = flattened(hierarchy.graph, hierarchy.graphs)
    if isinstance(found, Unflattenable):
        for code in Counter(reason.code for reason in found.reasons):
            event(f"refused: {code}")
        event("refused")
        return
    event("accepted")
    event(f"accepted, levels: {max(len(origin.levels) for origin in found.origins)}")
    agree(hierarchy, found, Random(seed), stop)
