"""A flat graph does what its hierarchy does, action by action."""

from collections import Counter
from itertools import product
from random import Random

import pytest
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st

from action_assistant.umrf.check import STRUCTURAL, check
from action_assistant.umrf.files import codec
from action_assistant.umrf.hierarchy.flattening import Flattened, Unflattenable, flattened
from action_assistant.umrf.semantics import Behaviour
from support.doses import examples, is_share
from umrf.hierarchy.hierarchies import Hierarchy, both, hierarchies, outputs_of

RESULTS = ("on_true", "on_false", "on_error")
#: Scripts that one flat graph is tried with: all combinations of results where there are no more.
MOST = 27
#: The probability that a call cannot be loaded, or never ends.
RARELY = 0.03


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
            after_s = random.choice((0.2, 1, 3, 7)) + 2.0**place / 1024
            calls = (result, random.choice(RESULTS), random.choice(RESULTS))
            behaviours[name] = tuple(
                Behaviour(
                    after_s=after_s,
                    result=each,
                    outputs=outputs_of(found.graph, name, call),
                    init_error=random.random() < RARELY,
                    never=random.random() < RARELY,
                )
                for call, each in enumerate(calls)
            )
        stop_ms = random.uniform(1, 20_000) if stop else None
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


@pytest.mark.timeout(900)
@pytest.mark.parametrize("wired", [False, True], ids=["any", "handing on values"])
def test_a_flat_graph_does_what_its_hierarchy_does(wired: bool) -> None:
    told = Counter[str]()

    @settings(
        max_examples=examples(600 if wired else 200), deadline=None,  # few wired ones are accepted
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )  # fmt: skip
    @given(hierarchy=hierarchies(wired=wired), seed=st.integers(0, 2**32), stop=st.booleans())
    def play(hierarchy: Hierarchy, seed: int, stop: bool) -> None:
        told["hierarchies"] += 1
        found = flattened(hierarchy.graph, hierarchy.graphs)
        if isinstance(found, Unflattenable):
            for code in {reason.code for reason in found.reasons}:
                event(f"refused: {code}")
            return
        told["accepted"] += 1
        event(f"accepted, levels: {max(len(origin.levels) for origin in found.origins)}")
        told["courses"] += agree(hierarchy, found, Random(seed), stop)

    play()
    assert is_share(told["accepted"], told["hierarchies"], 1 / 10)
    assert told["courses"] > told["accepted"]


def test_a_flat_graph_is_the_same_each_time_and_after_it_was_written() -> None:
    told = Counter[str]()

    @settings(max_examples=examples(100), deadline=None)
    @given(hierarchy=hierarchies())
    def write(hierarchy: Hierarchy) -> None:
        found = flattened(hierarchy.graph, hierarchy.graphs)
        if isinstance(found, Unflattenable):
            assert len(set(found.reasons)) == len(found.reasons)
            return
        told["accepted"] += 1
        text = codec.write(found.graph)
        again = flattened(hierarchy.graph, dict(reversed(hierarchy.graphs.items())))
        assert again == found
        back = codec.read(text).graph
        assert codec.write(back) == text
        names = [action.full_name for action in back.actions]
        assert len(set(names)) == len(names)
        assert names == [origin.action for origin in found.origins]
        assert not {action.name for action in back.actions} & hierarchy.graphs.keys()
        assert [p for p in check(back) if p.severity == "error" and p.code in STRUCTURAL] == []

    write()
    assert told["accepted"] > 0
