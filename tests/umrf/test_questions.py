"""Questions and waits in graphs: what a check finds wrong with them, and what may move after them."""

import itertools
from datetime import datetime
from typing import Any

import msgspec
import pytest

from action_assistant.umrf.check import check
from action_assistant.umrf.facts import PINNED, SIMULATED
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import ENTRY, EXIT, Action, Conditions, Graph, Parameter, Relation
from action_assistant.umrf.questions import (
    READY_MADE,
    Question,
    WrongAnswer,
    WrongQuestion,
    asked_in,
    checked_answer,
    moment_of,
    question_of,
)

_READY = {each.name: each for each in READY_MADE}
_NOW = datetime.fromisoformat("2026-11-29T15:00:00+02:00")
_RUN = Conditions(on_true="run", on_false="run", on_error="run")


def filled(name: str, key: str = "a", /, **values: Any) -> Action:
    """A ready-made action with values."""
    inputs = tuple(
        Parameter(
            each.path,
            msgspec.json.encode(
                {**msgspec.json.decode(each.text), "pvf_value": values[each.path]}
            ).decode(),
        )
        if each.path in values
        else each
        for each in _READY[name].inputs
    )
    return msgspec.structs.replace(_READY[name], key=key, inputs=inputs)


def alone(action: Action) -> Graph:
    arrows = (
        Relation(parent=ENTRY, child=action.key, conditions=Conditions(on_true="run")),
        Relation(parent=action.key, child=EXIT, conditions=_RUN),
    )
    return Graph(name="ask", actions=(action,), relations=arrows)


@pytest.mark.parametrize(
    ("action", "name", "said"),
    [
        (filled("AaConfirm", question="  "), "question", "no text"),
        (filled("AaConfirm", question="?", at_deadline="true"), "at_deadline", "never ends true"),
        (filled("AaConfirm", question="?", deadline_s=-1), "deadline_s", "from 0"),
        (filled("AaChoose", question="?", choices=[]), "choices", "nothing to choose"),
        (filled("AaChoose", question="?", choices=["a", "a"]), "choices", "the same"),
        (filled("AaAskNumber", question="?", at_least=5, at_most=2), "at_least", "at least"),
        (filled("AaWait", seconds=-3), "seconds", "from 0"),
        (filled("AaUntil", time="noon"), "time", "no time"),
        (filled("AaUntil", time="2026-11-29T14:30:00"), "time", "time zone"),
    ],
)
def test_a_check_names_the_place_of_a_wrong_question(action: Action, name: str, said: str) -> None:
    found = [each for each in check(alone(action), facts=SIMULATED) if each.code == "question"]
    assert [each.where.path for each in found] == [f"/actions/0/input_parameters/{name}/pvf_value"]
    assert said in found[0].message
    assert found[0].severity == "error"


def test_one_engine_refuses_a_graph_that_asks_people_and_the_simulator_plays_it() -> None:
    graph = alone(filled("AaConfirm", question="?"))
    assert "asks-people" in {each.code for each in check(graph, facts=PINNED)}
    assert check(graph, {}, SIMULATED) == []


def test_a_question_survives_being_written_and_read() -> None:
    graph = alone(filled("AaChoose", question="?", choices=["left", "right"]))
    again = codec.read(codec.write(graph)).graph.actions[0]
    assert again.inputs == graph.actions[0].inputs


def test_only_robots_that_come_before_another_question_move_next() -> None:
    names = ("first", "wait", "near", "second", "far")
    actions = (
        filled("AaConfirm", "first", question="?"),
        filled("AaWait", "wait", seconds=1),
        Action(key="near", name="Near"),
        msgspec.structs.replace(filled("AaConfirm", "second", question="?"), instance_id=1),
        Action(key="far", name="Far"),
    )
    arrows = [Relation(parent=ENTRY, child="first", conditions=Conditions(on_true="run"))]
    arrows += [
        Relation(parent=one, child=other, conditions=_RUN)
        for one, other in itertools.pairwise(names)
    ]
    graph = Graph(name="ask", actions=actions, relations=tuple(arrows))
    found = asked_in(graph, {}, {"Near_0": "David", "Far_0": "Carol"})
    assert found["AaConfirm_0"].moves == ("David",)
    assert found["AaConfirm_1"].moves == ("Carol",)
    assert found["AaWait_0"].by == "runner"


@pytest.mark.parametrize(
    ("text", "moment"),
    [
        ("15:30", "2026-11-29T15:30:00+02:00"),
        ("14:30", "2026-11-30T14:30:00+02:00"),
        ("15:00", "2026-11-30T15:00:00+02:00"),
        ("2026-11-29T14:30:00Z", "2026-11-29T14:30:00+00:00"),
        ("2020-01-01T00:00:00Z", "2020-01-01T00:00:00+00:00"),
    ],
)
def test_a_time_of_the_day_is_the_next_one(text: str, moment: str) -> None:
    assert moment_of(text, _NOW) == datetime.fromisoformat(moment)


def test_a_time_more_than_a_year_away_is_none() -> None:
    with pytest.raises(WrongQuestion, match="year"):
        moment_of("2030-01-01T00:00:00Z", _NOW)


@pytest.mark.parametrize(
    ("question", "value"),
    [
        (Question(kind="confirm", text="?"), "yes"),
        (Question(kind="choice", text="?", choices=("a",)), "b"),
        (Question(kind="number", text="?", at_most=3.0), 4.0),
        (Question(kind="number", text="?"), float("nan")),
        (Question(kind="number", text="?"), True),
        (Question(kind="text", text="?"), " "),
        (Question(kind="photo", text="?"), "0" * 32 + ".jpg"),
    ],
)
def test_an_answer_that_does_not_fit_is_refused(question: Question, value: Any) -> None:
    with pytest.raises(WrongAnswer):
        checked_answer(question, value)


def test_a_question_is_made_of_values_that_arrows_bring() -> None:
    found = question_of(
        "AaChoose", {"question": " Which? ", "choices": ["a", "b"], "deadline_s": 0.0}
    )
    assert found == Question(kind="choice", text="Which?", choices=("a", "b"))
    with pytest.raises(WrongQuestion):
        question_of("AaChoose", {"question": "Which?", "choices": "a"})
