"""Random histories of led runs that ask people: answers that race, come late or again, waits, steps,
restarts, a journal that fails, and Stops, in virtual time. Seeds that failed are kept as examples."""

import random
from collections import Counter
from contextlib import suppress

import anyio
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some

from action_assistant.errors import Conflict, NotFound, Refused
from action_assistant.runner.execution.question_commands import AnswerRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.events import (
    Author,
    Held,
    PieceBegan,
    PieceEnded,
    Released,
    RunEvent,
    StopRequested,
)
from action_assistant.runner.runs.question_events import (
    QuestionAnswered,
    QuestionAsked,
    QuestionClosed,
)
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest, StepRequest, WaitRequest
from runner.execution.test_conductor import Lab
from runner.execution.test_questions import asked_of, asking, line
from runner.harness import ANN, BEN, run_in_virtual_time
from support.doses import examples

_PRESSES = (
    "answer", "answer", "answer", "race", "race", "late", "wait", "go on", "step", "stop", "restart",
    "lost", "rest", "long rest",
)  # fmt: skip
_CONFIRM_US = 60_000_000


class History:
    """One run that asks people between the actions of a robot, and what people do, as a seed decides."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.lab = Lab({"*": [{"after_s": self.chance.choice((1, 3)), "stop_s": 0.2}]})
        late = {"deadline_s": self.chance.choice((0, 20, 90)), "at_deadline": "false"}
        graph = line(
            asking("AaConfirm", 0, question="Is it clear?", **late),
            "Scout",
            asking("AaAskNumber", 1, question="How much?", **late),
            asking("AaWait", 2, seconds=float(self.chance.choice((0, 5, 70)))),
            asking("AaConfirm", 3, question="Again?"),
            "Scout",
        )
        self.start = asked_of(graph, lost="wait")
        self.run = ""
        self.seen: dict[str, QuestionAsked] = {}
        self.counted: list[tuple[str, Author]] = []
        self.told_first = 0

    async def live(self) -> None:
        """Live through all presses, then stop what goes on."""
        rest = [self.chance.choice(_PRESSES) for _ in range(self.chance.randint(5, 22))]
        while rest:
            async with self.lab.runner() as control:
                if not self.run:
                    self.run = (await control.start(self.start, ANN)).run.id
                while rest and (press := rest.pop()) != "restart":
                    await anyio.sleep(self.chance.random() * 3)
                    with suppress(Refused):
                        await self._press(control, press)
                    self.lab.harness.journal.down = False
                if not rest:
                    await control.stop(self.run, BEN)
                    await anyio.sleep(60)
                    assert self.run not in control.open

    async def _press(self, control: ExecutionService, press: str) -> None:
        if self.run not in control.open:
            return
        now = control.open[self.run].run
        self.seen |= now.questions
        if press == "rest":
            await anyio.sleep(self.chance.random() * 10)
        elif press == "long rest":
            await anyio.sleep(70)
        elif press == "stop":
            await control.stop(self.run, BEN)
        elif press == "wait":
            await control.wait(self.run, WaitRequest(), BEN)
        elif press == "late" and self.seen:
            await self._answer(control, self.chance.choice(list(self.seen)), BEN)
        elif press in {"answer", "race", "lost"} and now.questions:
            question = next(iter(now.questions))
            self.lab.harness.journal.down = press == "lost"
            async with anyio.create_task_group() as people:
                people.start_soon(self._answer, control, question, ANN)
                if press == "race":
                    people.start_soon(self._answer, control, question, BEN)
                    if self.chance.random() < 0.3:
                        people.start_soon(self._quietly, control)
                if press == "lost":
                    await anyio.sleep(self.chance.choice((0.1, 2)))
                    self.lab.harness.journal.down = False
        elif now.held is not None and press == "go on":
            await control.go_on(self.run, GoOnRequest(time(now.held.at)), ANN)
        elif now.held is not None and press == "step":
            await control.step(self.run, StepRequest(time(now.held.at)), BEN)

    async def _quietly(self, control: ExecutionService) -> None:
        with suppress(Refused):
            await control.wait(self.run, WaitRequest(), BEN)

    async def _answer(self, control: ExecutionService, question: str, by: Author) -> None:
        value = 2.5 if self.seen[question].asks.kind == "number" else self.chance.random() < 0.7
        try:
            await control.questions.answer(self.run, question, AnswerRequest(value=value), by)
            self.counted.append((question, by))
        except Conflict as refused:
            if refused.where and "answered_by" in refused.where:
                self.told_first += 1
        except (NotFound, Refused):
            return

    def check(self) -> None:
        """Raise AssertionError if an answer counted twice, late, while the run was held or after a Stop,
        or if the robot began an action twice or without its cause."""
        told = self.lab.harness.journal.told(self.run)
        require_first_answers(told)
        answered = {each.question: each for each in told if isinstance(each, QuestionAnswered)}
        for question, by in self.counted:
            assert answered[question].by == by
        assert len({question for question, _ in self.counted}) == len(self.counted)
        sent = Counter(each.graph.name for each in self.lab.david.starts)
        assert all(count == 1 for count in sent.values()), sent
        ended = {
            each.node for each in told if isinstance(each, PieceEnded) and each.how != "unsent"
        }
        for name, before in (("task--Work_1", "AaConfirm_0"), ("task--Work_5", "AaConfirm_3")):
            assert name not in sent or before in ended


def require_first_answers(told: list[RunEvent]) -> None:
    """Raise AssertionError if a question was answered that was not open, or an end has no cause."""
    asked: dict[str, QuestionAsked] = {}
    over: set[str] = set()
    answers: dict[int, QuestionAnswered] = {}
    is_held = is_stopped = False
    for event in told:
        match event:
            case QuestionAsked(question=question):
                assert question not in asked
                assert not is_stopped
                assert not [each for each in asked.keys() - over if asked[each].call == event.call]
                asked[question] = event
            case QuestionClosed(question=question):
                assert question not in over
                over.add(question)
            case QuestionAnswered(question=question, call=call):
                known = asked[question]
                assert question not in over
                assert not is_stopped
                if known.lapses_at:
                    assert not is_held
                    assert event.at - known.at <= _CONFIRM_US + 100_000
                assert call not in answers
                answers[call] = event
                over.add(question)
            case PieceEnded(how="answer", call=call, outcome=outcome):
                assert answers[call].outcome == outcome
            case PieceEnded(how="deadline", outcome=outcome):
                assert outcome == "on_false"
            case PieceBegan():
                assert not is_stopped
                assert not is_held
            case Held():
                is_held = True
            case Released():
                is_held = False
            case StopRequested():
                is_stopped = True


@settings(max_examples=examples(12), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(some.integers(0, 10**9))
def test_the_first_answer_counts_once_for_one_question_of_one_visit(seed: int) -> None:
    async def main() -> None:
        history = History(seed)
        await history.live()
        history.check()

    run_in_virtual_time(main)
