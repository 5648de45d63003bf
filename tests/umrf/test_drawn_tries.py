"""Tries that the page draws: an action is tried so often and no more, and all else goes as before.

`frontend/src/graph/edit/tries.test.ts` draws them into graphs of gestures, and keeps both graphs in
`tests/vectors/tries.json`, in the form of `test_drawn_graphs.py`.
"""

import json
import os
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import msgspec
import pytest

from action_assistant.umrf.semantics.script import Behaviour, Script
from action_assistant.umrf.semantics.simulate import simulate
from action_assistant.umrf.semantics.trace import GraphStateEvent, NodeStateEvent
from umrf.test_drawn_graphs import graph_of

VECTORS = Path(os.environ.get("TRIES_FILE", Path(__file__).parents[1] / "vectors" / "tries.json"))
#: Laps of a loop that never ends by itself: both graphs are compared until then.
_UNTIL_MS = 60_000.0


class Drawn(msgspec.Struct, frozen=True):
    """A graph before and after its first action of `tries` was drawn so that it is tried again
    after `failures`; `tries` are the actions that are tried, in their order."""

    before: list[str]
    after: list[str]
    tries: list[str]
    failures: list[str]


DRAWN = msgspec.json.decode(VECTORS.read_bytes(), type=list[Drawn])
_IDS = [f"{each.tries[0]} of {' · '.join(each.before)}"[:60] for each in DRAWN]
#: Each action takes a time of its own (exact in ms), so that no order of equal times matters.
_OTHERS = 128


def course(
    arrows: list[str], script: Mapping[str, tuple[Behaviour, ...]]
) -> list[tuple[float, str, str]]:
    """Return when which action or the graph (`""`) came to which state, in the simulator."""
    names = sorted({name for each in arrows for name in each.split()[:2] if "#" not in name})
    own = {
        f"{name}_0": (Behaviour(after_s=3 + number / _OTHERS),) for number, name in enumerate(names)
    }
    trace = simulate(
        graph_of(arrows), script=Script({**own, **script}), max_events=4_000, until_ms=_UNTIL_MS
    )
    found: list[tuple[float, str, str]] = []
    for each in trace:
        if isinstance(each, NodeStateEvent) and each.state != "INITIALIZED":
            found.append((round(each.t_ms, 3), each.node, each.state))
        elif isinstance(each, GraphStateEvent):
            found.append((round(each.t_ms, 3), "", each.state))
    return found


def without(
    course_: list[tuple[float, str, str]], names: list[str]
) -> list[tuple[float, str, str]]:
    own = {f"{name}_0" for name in names}
    return sorted(each for each in course_ if each[1] not in own)


@pytest.mark.parametrize("drawn", DRAWN, ids=_IDS)
def test_an_action_is_tried_so_often_and_no_more_and_all_else_goes_as_before(drawn: Drawn) -> None:
    tries = len(drawn.tries)
    for failure in drawn.failures:
        for failed in range(tries + 1):
            script = {
                f"{name}_0": (Behaviour(result=failure if number < failed else "on_true"),)
                for number, name in enumerate(drawn.tries)
            }
            began = min(failed + 1, tries)
            result = failure if failed == tries else "on_true"
            one = {f"{drawn.tries[0]}_0": (Behaviour(after_s=began, result=result),)}
            before, after = course(drawn.before, one), course(drawn.after, script)
            assert without(after, drawn.tries) == without(before, drawn.tries)
            starts = [
                [at for at, node, state in after if node == f"{name}_0" and state == "RUNNING"]
                for name in drawn.tries
            ]
            visits = [
                at
                for at, node, state in before
                if node == f"{drawn.tries[0]}_0" and state == "RUNNING"
            ]
            assert starts[0] == visits
            for earlier, later in pairwise(starts[:began]):
                due = [at + 1000 for at in earlier]
                assert later == [at for at in due if at in later]
                assert len(due) - len(later) <= ended_early(before)
            assert all(not each for each in starts[began:])


def ended_early(before: list[tuple[float, str, str]]) -> int:
    """Return 1 if the graph may have ended while the action was tried, else 0."""
    return int(any(node == "" and state != "RUNNING" for _, node, state in before[1:]))


@pytest.mark.parametrize("drawn", DRAWN, ids=_IDS)
def test_what_is_drawn_ends_when_every_action_ends_true(drawn: Drawn) -> None:
    states = [state for _, node, state in course(drawn.after, {}) if node == ""]
    assert states[-1] == "FINISHED"


def test_tries_are_drawn_into_graphs_of_many_kinds() -> None:
    assert {len(each.tries) for each in DRAWN} == {2, 3, 4, 5}
    assert any("on_false" in each.failures for each in DRAWN)
    lines = [line for each in DRAWN for line in each.before]
    assert any("error" in line for line in lines)
    assert json.loads(VECTORS.read_text())
