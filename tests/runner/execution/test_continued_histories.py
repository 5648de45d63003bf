"""Random histories of led runs on robots, in virtual time: no sequence of waits, steps, continued runs, runs
from the middle, answers, queues and restarts publishes an action twice or after a Stop. What the actions
themselves count stands beside it.

Between the presses there are killed engines, silent robots, messages that are lost or late, restarts of the
runner, words of rest, and a journal that is slow or fails. Seeds that failed are kept as examples.
"""

import random
from collections import Counter
from collections.abc import Iterator
from contextlib import asynccontextmanager, suppress
from typing import Any, Final

import anyio
import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some

from action_assistant.errors import BadInput, Conflict, Forbidden, Refused
from action_assistant.runner.execution.interventions import RestRequest, confirm_rest
from action_assistant.runner.execution.question_commands import AnswerRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Registration
from action_assistant.runner.queues.entry import QueueRequest, TurnRequest, request_of
from action_assistant.runner.queues.service import Queues
from action_assistant.runner.runs.earlier import Choice, StartFrom
from action_assistant.runner.runs.events import PieceBegan, StopRequested
from action_assistant.runner.runs.history import whole_of
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import (
    GoOnRequest,
    StartRequest,
    StepRequest,
    WaitRequest,
)
from runner.counted_robots import Begins, CountedRobot
from runner.execution.test_conductor import led, shared
from runner.execution.test_continued_runs import asked
from runner.execution.test_opened_levels import PICK, opened
from runner.execution.test_questions import CONFIRM, line
from runner.harness import Harness, at_once, clock_us, run_in_virtual_time, sequence, two_lines
from runner.queues.test_queues import reopened
from runner.start.test_rights_registry import ANN, BEN, author
from support.doses import examples

_ROBOTS: Final = ("David", "Carol")
#: What follows each other, so that much of it has something to act on.
_SCENES: Final = (
    *(("wait",), ("go on",), ("step",), ("over",), ("answer",), ("restart",), ("rest",)) * 2,
    *(("stop", "rest", "continue"), ("stop all", "rest", "continue", "continue")) * 3,
    *(
        ("restart", "go on"),
        ("kill", "rest", "word", "go on"),
        ("kill", "word", "stop", "continue"),
    ),
    *(("stop", "rest", "from", "rest"), ("stop", "rest", "only"), ("from",), ("stop", "continue")),
    *(("stop", "rest", "put", "reopen", "turn"), ("put", "rest", "turn", "stop all", "turn")),
    *(("loss", "step", "loss"), ("late", "go on"), ("silent", "rest", "silent", "word", "go on")),
    *(("down", "step", "rest", "down"), ("slow", "go on", "stop", "slow"), ("late", "stop")),
)
_CHOICES: Final[tuple[Choice, ...]] = ("again", "again", "true", "leave")
TOTALS: Final = Counter[str]()


class History:
    """One graph, the runs of it that people start, and what they press, as a seed decides.

    `allowed`: how often each action may leave, by its name: once for each run from the entry or the middle,
    and once for each *again* of a continued one. `stops`: how many Stops concerned each start so far, by its
    request id; `presses`: how many had when it was pressed.
    """

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.begins = Begins()
        script = {"*": [{"after_s": self.chance.choice((1, 3)), "stop_s": 0.2}]}
        self.robots = {
            name: CountedRobot(name, self.begins, script, self.leaves) for name in _ROBOTS
        }
        self.harness = Harness(dict(self.robots))
        self.control: ExecutionService | None = None
        self.start: StartRequest = self.chance.choice(
            (
                led(shared(sequence("task", 5), "Scout", "Carrier"), lost="wait"),
                led(shared(two_lines("task"), "Scout", "Carrier"), lost="wait"),
                led(line("Scout", CONFIRM, "Carrier", "Scout"), lost="wait"),
                opened(PICK),
            )
        )
        self.runs: list[str] = []
        self.allowed = Counter[str]()
        self.stops, self.presses = Counter[str](), dict[str, int]()
        self.requests: set[str] = set()
        self.log: list[str] = []
        self.faults: list[str] = []

    def leaves(self, robot: str, piece: str) -> None:
        """Judge a message in the moment in which it leaves."""
        TOTALS["messages"] += 1
        opened_run = self.control.open.get(whole_of(piece) or piece) if self.control else None
        if opened_run is None:
            self.faults.append(f"{piece} left for {robot}, and no run is open")
            return
        run = opened_run.run
        if self.stops[run.request_id] != self.presses.get(run.request_id):
            self.faults.append(f"{piece} left for {robot} after a Stop, or without a press")
        if run.held is not None or run.desired == "stopped":
            self.faults.append(f"{piece} left for {robot} while it was held or stopped")

    @asynccontextmanager
    async def runner(self) -> Any:
        async with (
            self.harness.runner() as control,
            Queues.opened(
                control, self.harness.journal, clock_us=clock_us, run_in_worker=at_once
            ) as queues,
            anyio.create_task_group() as late,
        ):
            for name, robot in self.robots.items():
                robot.tasks = late
                control.robots.add(Registration(name=name, led=True))
            await anyio.sleep(1)
            self.control = control
            yield control, queues
            late.cancel_scope.cancel()

    async def live(self) -> None:
        """Live through all presses, then stop whatever goes on."""
        scenes = self.chance.choices(_SCENES, k=self.chance.randint(4, 12))
        rest = [press for scene in scenes for press in scene][::-1]
        while rest:
            async with self.runner() as (control, queues), anyio.create_task_group() as people:
                if not self.runs:
                    await self._begin(control, self.start, self._names())
                while rest:
                    self.log.append(rest.pop())
                    if self.log[-1] == "restart":
                        break
                    await anyio.sleep(self.chance.random() * 3)
                    people.start_soon(self._quietly, self.log[-1], control, queues)
                    if self.chance.random() < 0.8:
                        await anyio.sleep(0.3)
                await self._calm()
                people.cancel_scope.cancel()
        async with self.runner() as (control, _):
            before = [len(each.starts) for each in self.robots.values()]
            await anyio.sleep(30)
            assert before == [len(each.starts) for each in self.robots.values()], self.log
            control.stop_all(author(BEN))
            await anyio.sleep(60)
            assert before == [len(each.starts) for each in self.robots.values()], self.log
        TOTALS["histories"] += 1

    async def _calm(self) -> None:
        journal = self.harness.journal
        if journal.slow:  # virtual time stands still where a shielded wait is cancelled
            journal.slow = 0.0
            await anyio.sleep(3)
        journal.down = False

    def _names(self) -> tuple[str, ...]:
        """Return the name of every action that a whole run sends, as messages have it."""
        return ("Pick_0", *(f"Work_{n}" for n in range(9)))

    async def _begin(
        self, control: ExecutionService, request: StartRequest, names: tuple[str, ...]
    ) -> Run | None:
        """Press a start that may send each of these actions once; return the run, None if refused."""
        self.presses[request.request_id] = self.stops[request.request_id]
        self.requests.add(request.request_id)
        self.allowed.update(names)  # before it is known whether it counts
        try:
            run = (await control.start(request, author(ANN), ANN)).run
        except (BadInput, Conflict, Forbidden):
            self.allowed.subtract(names)
            return None
        except Refused:  # nobody knows whether it counts
            return None
        TOTALS["runs"] += 1
        self.runs.append(run.id)
        return run

    async def _quietly(self, press: str, control: ExecutionService, queues: Queues) -> None:
        with suppress(Refused):
            await self._press(press, control, queues)

    async def _press(self, press: str, control: ExecutionService, queues: Queues) -> None:
        journal, robot = self.harness.journal, self.robots[self.chance.choice(_ROBOTS)]
        match press:
            case "kill":
                robot.engine = robot.new_engine()
                TOTALS["kills"] += 1
            case "silent":
                robot.silent = not robot.silent
            case "loss":
                robot.loss = 0.3 if robot.loss == 0 else 0.0
                robot.start_loss = self.chance.choice((0.0, robot.loss))
            case "late":
                robot.start_delay = self.chance.choice((0.0, 0.4, 2.0))
            case "down":
                journal.down = not journal.down
            case "slow":
                journal.slow = 0.3 - journal.slow
            case "rest":
                await anyio.sleep(self.chance.random() * 8)
            case "word":
                await self._words(control)
            case "stop all":
                self._note_stop(self.requests)
                control.stop_all(author(BEN))
            case "continue" | "from" | "only":
                await self._again(press, control)
            case "put" | "turn" | "reopen":
                await self._queue(press, queues)
            case _:
                await self._steer(press, control)

    def _note_stop(self, requests: set[str]) -> None:
        TOTALS["Stops"] += 1
        for each in requests:
            self.stops[each] += 1

    async def _words(self, control: ExecutionService) -> None:
        """Say that a lost robot is at rest, where it is."""
        for each in tuple(control.open.values()):
            robot = self.robots.get(each.run.engine) if each.run.led is None else None
            if robot is not None and not await robot.moving(each.run.graph_name):
                with suppress(Refused):
                    confirm_rest(each, RestRequest("I stand beside it."), author(BEN))
                    TOTALS["words"] += 1

    async def _again(self, press: str, control: ExecutionService) -> None:
        """Continue the newest run, or begin in the middle with what it knows."""
        before = self.runs[-1] if self.runs else ""
        request = msgspec.structs.replace(
            self.start, request_id=f"{press} {before} {clock_us()} {self.chance.random()}"
        )
        if press != "continue":
            at = (f"Work_{self.chance.randrange(5)}",)
            earlier = self.chance.choice((before, ""))
            since = StartFrom(run=earlier, at=at, only=press == "only")
            levels = "one_step"
            request = msgspec.structs.replace(request, start_from=since, levels=levels)
            run = await self._begin(control, request, self._names())
            TOTALS["from the middle"] += run is not None
            return
        since = StartFrom(run=before)
        request = msgspec.structs.replace(request, start_from=since, levels="one_step")
        (look, *_) = await control.look(asked(request), ANN)
        if look.earlier is None:
            return
        names = [each.action for each in look.earlier.under_way]
        choices = {name: self.chance.choice(_CHOICES) for name in names}
        since = StartFrom(run=before, choices=choices, reason="I looked.")
        request = msgspec.structs.replace(request, start_from=since)
        again = tuple(name for name, choice in choices.items() if choice == "again")
        run = await self._begin(control, request, again)
        TOTALS["continued"] += run is not None

    async def _queue(self, press: str, queues: Queues) -> None:
        if press == "reopen":
            for queue in queues.robot_queues:
                if queue.closed is not None:
                    with suppress(Refused):
                        await reopened(queues, queue.name)
            return
        if press == "put":
            start = msgspec.structs.replace(self.start, request_id=f"put {clock_us()}")
            await queues.put(QueueRequest(start=start), author(ANN), ANN)
            return
        for entry in queues.entries:
            look = await queues.look(entry.id, {}, ANN)
            name = request_of(entry.id)
            self.presses[name] = self.stops[name]
            self.requests.add(name)
            self.allowed.update(self._names())
            started = await queues.start(entry.id, TurnRequest(look.digest), author(ANN), ANN)
            self.runs.append(started.run.id)
            TOTALS["queued"] += 1
            return

    async def _steer(self, press: str, control: ExecutionService) -> None:
        """One press of a person on each led run that goes on."""
        for each in tuple(control.open.values()):
            run, held = each.run, each.run.held
            if run.led is None:
                continue
            with suppress(Refused):
                if press == "stop":
                    self._note_stop({run.request_id})
                    await control.stop(run.id, author(BEN))
                elif press == "wait":
                    await control.wait(run.id, WaitRequest(), author(BEN))
                elif press == "answer" and run.questions:
                    answer = AnswerRequest(value=self.chance.random() < 0.8)
                    question = next(iter(run.questions))
                    await control.questions.answer(run.id, question, answer, author(BEN), BEN)
                elif held is not None and press == "go on":
                    await control.go_on(run.id, GoOnRequest(time(held.at)), author(ANN), ANN)
                elif held is not None and press == "step":
                    await control.step(run.id, StepRequest(time(held.at)), author(BEN), BEN)
                elif held is not None and press == "over":
                    over = StepRequest(time(held.at), over=("Pick_0",))
                    await control.step(run.id, over, author(BEN), BEN)

    def check(self) -> None:
        """Raise AssertionError if an action left once too often or after a Stop, or began without that."""
        assert self.faults == [], (self.log, self.faults)
        sent = [each for robot in self.robots.values() for each in robot.starts]
        assert len({each.run for each in sent}) == len(sent), self.log
        counts = Counter(name for each in sent for name in each.graph.actions)
        for name, count in counts.items():
            assert count <= self.allowed[name], (name, count, self.log)
        assert all(count == 1 for count in self.begins.counts.values()), (
            self.log,
            self.begins.times,
        )
        assert {run for run, _ in self.begins.times} <= {each.run for each in sent}, self.log
        TOTALS["actions"] += sum(self.begins.counts.values())
        left = {each.run for each in sent}
        for run in self.runs:
            is_stopped, calls = False, Counter[int]()
            for event in self.harness.journal.told(run):
                is_stopped = is_stopped or isinstance(event, StopRequested)
                if isinstance(event, PieceBegan) and event.piece in left:
                    assert not is_stopped, self.log
                    calls[event.call] += 1
            assert all(count <= 1 for count in calls.values()), (self.log, calls)


def lived(seed: int) -> None:
    async def main() -> None:
        history = History(seed)
        await history.live()
        history.check()

    run_in_virtual_time(main)


@settings(max_examples=examples(10), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(some.integers(0, 10**9))
def test_no_history_sends_an_action_twice_unasked_or_after_a_stop(seed: int) -> None:
    lived(seed)


@pytest.fixture(scope="module", autouse=True)
def totals() -> Iterator[None]:
    """Say how much was lived through."""
    yield
    print(dict(TOTALS))  # noqa: T201 - how much was tried
