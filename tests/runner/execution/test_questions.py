"""Questions to people in led runs: the first answer counts, for one question of one visit."""

from datetime import timedelta
from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import BadInput, Conflict, Forbidden
from action_assistant.runner.execution.question_commands import AnswerRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.question_events import (
    AnswerRefused,
    PauseBegan,
    QuestionAnswered,
    QuestionAsked,
    QuestionClosed,
)
from action_assistant.runner.runs.views import run_view, time
from action_assistant.runner.start.admission import WaitRequest
from action_assistant.umrf.model import Action, Graph, Parameter
from action_assistant.umrf.questions import READY_MADE
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Person
from runner.execution.test_conductor import Lab
from runner.execution.test_continued_runs import asked
from runner.execution.test_led_breakpoints import go_on
from runner.execution.test_led_steps import now
from runner.harness import ANN, BEN, Harness, clock_us, ended, order, sequence, until, virtual


def with_value(text: str, value: Any) -> str:
    """The text of a parameter with a value."""
    return msgspec.json.encode({**msgspec.json.decode(text), "pvf_value": value}).decode()


_READY = {each.name: each for each in READY_MADE}


def asking(name: str, number: int = 0, actor: str = "", **values: Any) -> Action:
    """A ready-made action with these values of its inputs."""
    return msgspec.structs.replace(
        _READY[name],
        instance_id=number,
        actor=actor,
        inputs=tuple(
            Parameter(each.path, with_value(each.text, values[each.path]))
            if each.path in values
            else each
            for each in _READY[name].inputs
        ),
    )


def line(*actions: Action | str) -> Graph:
    """The actions one after the other; a text is the actor of an action `Work`. Each goes on by true and
    by false."""
    graph = sequence("task", len(actions))
    nodes = [
        msgspec.structs.replace(graph.actions[n], actor=each)
        if isinstance(each, str)
        else msgspec.structs.replace(each, key=graph.actions[n].key)
        for n, each in enumerate(actions)
    ]
    return msgspec.structs.replace(graph, actions=tuple(nodes))


def asked_of(graph: Graph, **more: Any) -> Any:
    """A start of a led run in which David is David, if he plays anything."""
    named = {each.actor for each in graph.actions if each.name == "Work"}
    robots = {actor: "David" if actor else "simulator" for actor in named}
    return order(graph, engine="conducted", robots=robots, **more)


async def open_question(control: ExecutionService, run: str) -> QuestionAsked:
    """Wait until a question of a run is open, and return it."""
    await until(lambda: bool(now(control, run).questions), 3600)
    return next(iter(now(control, run).questions.values()))


def told(harness: Harness, run: str, kind: type[Any]) -> list[Any]:
    return [each for each in harness.journal.told(run) if isinstance(each, kind)]


CONFIRM = asking("AaConfirm", question="Is the door open?")


@virtual
async def test_the_answer_of_a_person_is_the_outcome_and_lets_a_robot_begin() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        run = (await control.start(asked_of(line(CONFIRM, "Scout")), ANN)).run.id
        asked = await open_question(control, run)
        assert (asked.asks.kind, asked.asks.text, asked.visit) == (
            "confirm",
            "Is the door open?",
            1,
        )
        assert asked.moves == ("David",)
        await anyio.sleep(20)
        assert lab.david.starts == []
        await control.questions.answer(run, asked.question, AnswerRequest(value=True), BEN)
        assert await ended(control, run) == "finished"
        found = lab.harness.journal.history(run)
        visit = run_view(found).actions["AaConfirm_0"].visits[-1]
        assert (visit.result, visit.robot) == ("true", "people")
        assert visit.answered
        assert (visit.answered.by.name, visit.answered.value) == ("Ben", True)
        assert len(lab.david.starts) == 1


@virtual
async def test_no_is_false_and_the_second_answer_is_told_who_was_first() -> None:
    harness = Harness()
    async with harness.runner() as control:
        run = (await control.start(asked_of(line(CONFIRM, CONFIRM_1)), ANN)).run.id
        asked = await open_question(control, run)
        await control.questions.answer(run, asked.question, AnswerRequest(value=False), ANN)
        with pytest.raises(Conflict) as refused:
            await control.questions.answer(run, asked.question, AnswerRequest(value=True), BEN)
        assert refused.value.where
        assert refused.value.where["answered_by"]["name"] == "Ann"
        assert refused.value.where["value"] is False
        other = await open_question(control, run)
        assert other.node == "AaConfirm_1"
        await control.questions.answer(run, other.question, AnswerRequest(value=True), BEN)
        assert await ended(control, run) == "finished"
        found = run_view(harness.journal.history(run)).actions
        assert found["AaConfirm_0"].visits[-1].result == "false"
        (late,) = told(harness, run, AnswerRefused)
        assert late.by == BEN


CONFIRM_1 = asking("AaConfirm", 1, question="And now?")


@virtual
async def test_a_repeated_request_counts_once() -> None:
    harness = Harness()
    async with harness.runner() as control:
        run = (await control.start(asked_of(line(CONFIRM, CONFIRM_1)), ANN)).run.id
        asked = await open_question(control, run)
        press = AnswerRequest(value=True, request_id="press 1")
        await control.questions.answer(run, asked.question, press, ANN)
        await control.questions.answer(run, asked.question, press, ANN)
        assert len(told(harness, run, QuestionAnswered)) == 1
        with pytest.raises(Conflict, match="another request"):
            await control.questions.answer(run, asked.question, press, BEN)


@virtual
async def test_a_confirmation_that_moves_a_robot_is_asked_again_after_60_s() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        run = (await control.start(asked_of(line(CONFIRM, "Scout")), ANN)).run.id
        first = await open_question(control, run)
        assert first.lapses_at - first.at == 60_000_000
        await until(lambda: first.question not in now(control, run).questions, 120)
        second = await open_question(control, run)
        assert second.again == first.question
        with pytest.raises(Conflict, match="asked again after 60 s"):
            await control.questions.answer(run, first.question, AnswerRequest(value=True), BEN)
        await control.questions.answer(run, second.question, AnswerRequest(value=True), BEN)
        assert await ended(control, run) == "finished"
        closed = told(lab.harness, run, QuestionClosed)
        assert [each.why for each in closed] == ["lapsed"]


@virtual
async def test_a_confirmation_lapses_at_a_wait_and_is_asked_again_after_go_on() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        run = (await control.start(asked_of(line(CONFIRM, "Scout")), ANN)).run.id
        first = await open_question(control, run)
        await control.wait(run, WaitRequest("Look."), BEN)
        assert now(control, run).questions == {}
        with pytest.raises(Conflict, match="The run waited meanwhile"):
            await control.questions.answer(run, first.question, AnswerRequest(value=True), BEN)
        await anyio.sleep(100)
        assert now(control, run).questions == {}
        await go_on(control, run)
        second = await open_question(control, run)
        assert second.question != first.question
        assert lab.david.starts == []
        await control.questions.answer(run, second.question, AnswerRequest(value=True), BEN)
        assert await ended(control, run) == "finished"
        visits = run_view(lab.harness.journal.history(run)).actions["AaConfirm_0"].visits
        assert len(visits) == 1


@virtual
async def test_a_question_that_moves_nothing_stays_open_while_the_run_waits() -> None:
    harness = Harness()
    async with harness.runner() as control:
        run = (await control.start(asked_of(line(CONFIRM, CONFIRM_1)), ANN)).run.id
        asked = await open_question(control, run)
        await control.wait(run, WaitRequest(), BEN)
        await anyio.sleep(300)
        await control.questions.answer(run, asked.question, AnswerRequest(value=True), BEN)
        await anyio.sleep(5)
        assert now(control, run).questions == {}  # the next one waits before the gate
        await go_on(control, run)
        assert (await open_question(control, run)).node == "AaConfirm_1"


@pytest.mark.parametrize(
    ("outcome", "result"), [("false", "false"), ("error", "error"), ("stopped", "stopped")]
)
def test_a_deadline_has_an_outcome_of_its_own(outcome: str, result: str) -> None:
    @virtual
    async def lived() -> None:
        harness = Harness()
        async with harness.runner() as control:
            late = asking("AaConfirm", question="?", deadline_s=30, at_deadline=outcome)
            run = (await control.start(asked_of(line(late)), ANN)).run.id
            asked = await open_question(control, run)
            assert asked.until - asked.at == 30_000_000
            await ended(control, run)
            found = run_view(harness.journal.history(run)).actions["AaConfirm_0"]
            assert found.visits[-1].result == result
            assert [each.why for each in told(harness, run, QuestionClosed)] == ["deadline"]
            with pytest.raises(Conflict, match="deadline"):
                await control.questions.answer(run, asked.question, AnswerRequest(value=True), BEN)

    lived()


@virtual
async def test_a_stop_ends_a_question_and_the_run_is_stopped() -> None:
    lab = Lab()
    async with lab.runner() as control:
        run = (await control.start(asked_of(line(CONFIRM, "Scout")), ANN)).run.id
        asked = await open_question(control, run)
        await control.stop(run, BEN)
        with pytest.raises(Conflict):
            await control.questions.answer(run, asked.question, AnswerRequest(value=True), ANN)
        assert await ended(control, run) == "stopped"
        assert lab.david.starts == []
        assert [each.why for each in told(lab.harness, run, QuestionClosed)] == ["stopped"]


@pytest.mark.parametrize(
    ("action", "value", "output"),
    [
        (asking("AaAskText", question="?"), "in box 4", ("text", '"in box 4"')),
        (asking("AaAskNumber", question="?", at_most=9.0), 4.5, ("number", "4.5")),
        (asking("AaChoose", question="?", choices=["left", "right"]), "left", ("choice", '"left"')),
    ],
)
def test_an_answer_stands_in_the_outputs(
    action: Action, value: Any, output: tuple[str, str]
) -> None:
    @virtual
    async def lived() -> None:
        harness = Harness()
        async with harness.runner() as control:
            run = (await control.start(asked_of(line(action)), ANN)).run.id
            asked = await open_question(control, run)
            with pytest.raises(BadInput):
                await control.questions.answer(run, asked.question, AnswerRequest(value=True), ANN)
            await control.questions.answer(run, asked.question, AnswerRequest(value=value), ANN)
            assert await ended(control, run) == "finished"
            found = run_view(harness.journal.history(run)).actions[action.full_name]
            assert found.visits[-1].outputs == dict([output])

    lived()


@virtual
async def test_only_people_of_the_group_may_answer() -> None:
    nurse = asking("AaConfirm", actor="Nurse", question="?")
    async with Harness().runner() as control:
        with pytest.raises(BadInput, match="who answers for Nurse"):
            await control.start(asked_of(line(nurse)), ANN)
        run = (await control.start(asked_of(line(nurse), people={"Nurse": "g7"}), ANN)).run.id
        asked = await open_question(control, run)
        ben = Identity(Person("ben", "Ben", "operator"))
        yes = AnswerRequest(value=True)
        with pytest.raises(Forbidden, match="Nurse is asked"):
            await control.questions.answer(run, asked.question, yes, BEN, ben)
        member = msgspec.structs.replace(ben, groups=frozenset({"g7"}))
        await control.questions.answer(run, asked.question, yes, BEN, member)
        assert await ended(control, run) == "finished"


@pytest.mark.parametrize("engine", ["David", "simulator"])
def test_a_graph_that_asks_people_is_not_handed_over_whole(engine: str) -> None:
    @virtual
    async def lived() -> None:
        lab = Lab()
        async with lab.runner() as control:
            with pytest.raises(Conflict, match="lead"):
                await control.start(order(line(CONFIRM), engine=engine), ANN)
            assert lab.david.starts == []

    lived()


@virtual
async def test_the_look_before_a_start_says_who_is_asked() -> None:
    lab = Lab()
    async with lab.runner() as control:
        graph = line(CONFIRM, "Scout", asking("AaWait", 2, seconds=5.0))
        (look, _) = await control.look(asked(asked_of(graph)), "ann")
        texts = {each.code: each.text for each in look.items}
        assert texts["asks"] == "People answer Confirm. The runner waits for Wait 2."
        assert "simulator" not in texts["moves"]


@virtual
async def test_a_wait_lasts_its_seconds() -> None:
    harness = Harness()
    async with harness.runner() as control:
        wait = asking("AaWait", seconds=90.0)
        run = (await control.start(asked_of(line(wait)), ANN)).run.id
        began = anyio.current_time()
        assert await ended(control, run) == "finished"
        assert 89 < anyio.current_time() - began < 95
        (pause,) = told(harness, run, PauseBegan)
        assert pause.until - pause.at == 90_000_000


@virtual
async def test_the_runner_waits_until_a_time() -> None:
    harness = Harness()
    async with harness.runner() as control:
        moment = time(clock_us()) + timedelta(seconds=100)
        until_then = asking("AaUntil", time=moment.isoformat())
        run = (await control.start(asked_of(line(until_then)), ANN)).run.id
        assert await ended(control, run) == "finished"
        assert time(clock_us()) >= moment


@virtual
async def test_a_script_answers_where_nothing_moves() -> None:
    harness = Harness()
    async with harness.runner() as control:
        preset = {"AaConfirm_0": [{"after_s": 2, "result": "on_false"}]}
        run = (await control.start(asked_of(line(CONFIRM), script=preset), ANN)).run.id
        assert await ended(control, run) == "finished"
        found = run_view(harness.journal.history(run)).actions["AaConfirm_0"]
        assert found.visits[-1].result == "false"
        assert told(harness, run, QuestionAsked) == []
