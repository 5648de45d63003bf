"""Items of the pre-flight that stand in the way of a start, or warn."""

from typing import Any

import msgspec
import pytest

from action_assistant.errors import Conflict
from action_assistant.runner.links.port import Answer, Standing
from action_assistant.runner.robots.engine import EngineIndex
from action_assistant.runner.start.admission import Admitted
from action_assistant.runner.start.preflight import (
    EngineView,
    Item,
    graph_item,
    refusal_item,
    robot_items,
    with_verdict,
)
from action_assistant.umrf.check import STRUCTURAL
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.model import Problem, Where
from action_assistant.umrf.semantics import Script
from runner.harness import sequence


def problem(code: str, severity: Any) -> Problem:
    return Problem(code=code, severity=severity, where=Where(), message="It is so.")


def admitted(*problems: Problem) -> Admitted:
    return Admitted(
        graph=sequence(),
        graph_id="g1",
        script=Script({}),
        script_text="",
        digest="d",
        problems=problems,
    )


def proof(**standing: Any) -> Item:
    """Return the item about the proof of a Stop for an engine of this standing."""
    fields = {"state": "answering", "generation": "current", "servers": 1} | standing
    sight = EngineView(
        name="David",
        facts=PINNED,
        standing=Standing(**fields),
        answer=Answer(asked_at=0, at=0, incarnation="life", graphs=()),
        index=EngineIndex(),
        took_ms=1.0,
    )
    (found,) = [each for each in robot_items(sight, sequence()) if each.code == "proof"]
    return found


@pytest.mark.parametrize(
    ("standing", "verdict", "overridable", "words"),
    [
        ({}, "passed", False, "one engine answers"),
        ({"generation": "older"}, "blocked", False, "would not understand a Stop"),
        ({"listeners": {"start": 1, "stop": 0}}, "blocked", False, "Nobody listens to stop"),
        ({"listeners": {"start": 0, "stop": 0}}, "blocked", False, "start and stop messages"),
        ({"servers": 2}, "blocked", True, "2 engines answer"),
        ({"servers": 0}, "blocked", True, "nobody who serves"),
        ({"ids_unknown": True}, "blocked", False, "no answer would prove a stop"),
        ({"generation": "unknown"}, "warned", False, "is not known"),
    ],
)
def test_a_start_needs_an_engine_whose_stop_could_be_proven(
    standing: dict[str, Any], verdict: str, overridable: bool, words: str
) -> None:
    found = proof(**standing)
    assert (found.verdict, found.overridable) == (verdict, overridable)
    assert words in found.text


def test_problems_of_a_graph_warn_and_overridden_ones_stay_named() -> None:
    assert graph_item(admitted()).verdict == "passed"
    possible = problem("loop", "warning")
    warned = graph_item(admitted(possible))
    assert (warned.verdict, warned.problems) == ("warned", (possible,))
    certain = problem("one-sided", "error")
    over = graph_item(admitted(certain, possible))
    assert over.verdict == "warned"
    assert over.problems == (certain, possible)
    assert "overridden" in over.text


def test_a_refusal_is_overridable_if_it_names_problems_of_which_none_is_structural() -> None:
    structural = min(STRUCTURAL)
    for codes, overridable in (((), False), (("x",), True), (("x", structural), False)):
        where = {"problems": msgspec.to_builtins([problem(code, "error") for code in codes])}
        item = refusal_item("graph", Conflict("No.", where=where if codes else None))
        assert (item.verdict, item.overridable) == ("blocked", overridable)
        assert set(item.codes) == set(codes)
        look = with_verdict("David", [item])
        assert look.never != overridable
        assert look.override == (item.codes if overridable else ())
