"""People are asked between the actions of real engines: the code of the actions writes down what has begun
before and after an answer, a lapse and a Stop.

Needs ENGINE_LAB, the folder of a built engine, and UMRF_SHARED, which has the program that starts it.
`TEST_LED_DOMAIN` is the first domain.
"""

import os
from collections import Counter
from pathlib import Path

import anyio
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.errors import Conflict, Refused
from action_assistant.runner.execution.question_commands import AnswerRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.question_events import QuestionAsked
from action_assistant.runner.runs.views import time as as_text
from action_assistant.runner.start.admission import GoOnRequest, StartRequest, WaitRequest
from action_assistant.umrf.model import Action
from ros.led_engines import PLAYERS, Engines, over, relay
from runner.execution.test_questions import asking
from runner.harness import ANN, BEN, order, until
from support.real_engine import needs_engine

DOMAIN = int(os.environ.get("TEST_LED_DOMAIN", "175"))

pytestmark = [needs_engine, pytest.mark.timeout(0)]


@pytest.fixture
def engines(tmp_path: Path) -> Engines:
    return Engines(tmp_path, DOMAIN)


def task(between: Action) -> StartRequest:
    """Return the start of an action on Ann, then `between`, then one on Bob."""
    graph = relay("asking", [(0.1, "on_true")] * 3)
    first, middle, last = graph.actions
    between = msgspec.structs.replace(between, key=middle.key)
    last = msgspec.structs.replace(last, actor="Carrier")
    graph = msgspec.structs.replace(graph, actions=(first, between, last))
    robots = {actor: PLAYERS[actor] for actor in ("Scout", "Carrier")}
    return order(graph, engine="conducted", graph=None, robots=robots)


def begun(engines: Engines) -> Counter[str]:
    """Return how often the code of each action has begun."""
    return Counter(line.action for line in engines.lines() if line.what == "begin")


BEFORE = {"OxWork_0": 1}
BOTH = {"OxWork_0": 1, "OxWork_2": 1}
YES = AnswerRequest(value=True)
CONFIRM = asking("AaConfirm", question="Is the door open?")


async def open_question(control: ExecutionService, run: str, after: str = "") -> QuestionAsked:
    """Wait for a question of a run, another one than `after`; return it."""

    def found() -> list[QuestionAsked]:
        asked = control.open[run].run.questions.values()
        return [each for each in asked if each.question != after]

    await until(lambda: bool(found()), 20)
    return found()[0]


def test_no_code_begins_before_the_answer_and_of_three_answers_it_begins_once(
    engines: Engines,
) -> None:
    refused: list[str] = []

    async def main() -> None:
        async with engines.led() as (control, _):
            run = (await control.start(task(CONFIRM), ANN)).run.id
            asked = await open_question(control, run)
            await anyio.sleep(2)
            assert begun(engines) == BEFORE

            async def answer() -> None:
                try:
                    await control.questions.answer(run, asked.question, YES, BEN)
                except Conflict as why:
                    refused.append(str(why))

            async with anyio.create_task_group() as people:
                for _ in range(3):
                    people.start_soon(answer)
            assert await over(control, run, 30) == "finished"
            assert begun(engines) == BOTH
            assert len(refused) == 2

    anyio.run(main)


def test_no_code_begins_after_a_stop_while_a_question_is_open(engines: Engines) -> None:
    async def main() -> None:
        async with engines.led() as (control, _):
            run = (await control.start(task(CONFIRM), ANN)).run.id
            asked = await open_question(control, run)
            await control.stop(run, BEN)
            assert await over(control, run, 20) == "stopped"
            with pytest.raises(Refused):
                await control.questions.answer(run, asked.question, YES, ANN)
            await anyio.sleep(2)
            assert begun(engines) == BEFORE

    anyio.run(main)


def test_a_yes_to_a_question_from_before_a_wait_begins_nothing(engines: Engines) -> None:
    async def main() -> None:
        async with engines.led() as (control, _):
            run = (await control.start(task(CONFIRM), ANN)).run.id
            asked = await open_question(control, run)
            await control.wait(run, WaitRequest(), ANN)
            with pytest.raises(Conflict):
                await control.questions.answer(run, asked.question, YES, BEN)
            await anyio.sleep(1)
            assert begun(engines) == BEFORE
            held = control.open[run].run.held
            assert held is not None
            await control.go_on(run, GoOnRequest(as_text(held.at)), ANN)
            again = await open_question(control, run, asked.question)
            await control.questions.answer(run, again.question, YES, BEN)
            assert await over(control, run, 30) == "finished"
            assert begun(engines) == BOTH

    anyio.run(main)
