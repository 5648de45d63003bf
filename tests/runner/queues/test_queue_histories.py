"""Random histories of queues over two robots: no action is started twice, none without the press of a
person, none after a Stop that came after that press. What the actions themselves count stands beside it.

Between the presses there are Stops of everything, of a robot and of runs, waits, steps, *Go on* and
answers of led runs, restarts of the runner, lost robots, batons, words of rest, and a journal that is slow
or fails.
"""

import random
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from typing import Final

import anyio
import pytest
from anyio.abc import TaskGroup
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from action_assistant.errors import Refused
from action_assistant.runner.execution.interventions import RestRequest, confirm_rest
from action_assistant.runner.execution.question_commands import AnswerRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.queues.entry import (
    MoveRequest,
    QueueRequest,
    TurnRequest,
    request_of,
)
from action_assistant.runner.queues.robot_queue import Entry
from action_assistant.runner.queues.service import Queues
from action_assistant.runner.robots.rights import Rules
from action_assistant.runner.runs.history import whole_of
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest, StepRequest, WaitRequest
from runner.counted_robots import Begins, CountedRobot
from runner.execution.test_conductor import led, shared
from runner.execution.test_questions import CONFIRM, asked_of, line
from runner.harness import order, run_in_virtual_time, sequence
from runner.queues.test_queues import QUICK, Lab, on, reopened
from runner.start.test_rights_registry import ANN, BEN, OLGA, author
from support.doses import examples

ROBOTS: Final = ("David", "Carol")
STEPS: Final = (
    *["press"] * 16,
    *["put"] * 8,
    *["sleep"] * 8,
    *["reopen"] * 6,
    *("stop all", "stop robot", "stop robot", "stop run", "stop run", "hold", "step", "step"),
    *("go on", "go on", "answer", "answer", "restart", "lost", "rest", "rest", "baton", "down"),
    *("slow", "close", "move", "remove", "direct"),
)
TOTALS: Final = Counter[str]()


class History:
    """A random history of queues, and what must hold all the while.

    `stops`: how many Stops concerned each start so far, by its request id; `presses`: how many had
    when a person pressed it last.
    """

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.begins = Begins()
        self.stops, self.presses = Counter[str](), dict[str, int]()
        self.robots_of: dict[str, tuple[str, ...]] = {}
        self.runs: dict[str, tuple[str, str, tuple[str, ...]]] = {}  # of this process
        self.faults: list[str] = []
        self.log: list[str] = []
        self.reopened: set[int] = set()
        self.closed: set[int] = set()
        self.control: ExecutionService | None = None
        self.lab = Lab(QUICK)
        self.robots = {name: CountedRobot(name, self.begins, QUICK, self.leaves) for name in ROBOTS}
        self.lab.harness.links |= self.robots

    def leaves(self, robot: str, run: str) -> None:
        """Judge a message in the moment in which it leaves."""
        TOTALS["messages"] += 1
        whole = whole_of(run) or run
        opened = self.control.open.get(whole) if self.control is not None else None
        if opened is None:
            self.faults.append(f"{run} left for {robot}, and no run is open")
            return
        name = self._pressed(opened.run.request_id)
        if name not in self.presses:
            self.faults.append(f"{run} left for {robot} without a press")
        elif self.stops[name] != self.presses[name]:
            self.faults.append(f"{run} left for {robot} after a Stop")
        if opened.run.held is not None or opened.run.desired == "stopped":
            self.faults.append(f"{run} left for {robot} while it was held or stopped")

    def _pressed(self, request: str) -> str:
        """Return the id of the start whose run has this request id: those of a start on several robots
        have their robot behind it."""
        whole = request.rpartition("/")[0]
        return whole if whole in self.robots_of else request

    async def live(self) -> None:
        """Live through it, and through what comes after its last restart."""
        left = ["put"] * 4 + self.chance.choices(STEPS, k=self.chance.randint(15, 40))
        while left:
            async with self.lab.runner() as (control, queues), anyio.create_task_group() as people:
                self.control = control
                self.runs.clear()
                control.watch(
                    lambda each: self.runs.update(
                        {each.run.id: (each.run.id, each.run.request_id, each.run.robots)}
                    )
                )
                while left:
                    step = left.pop(0)
                    self.log.append(step)
                    if step == "restart":
                        break
                    await self._do(step, control, queues, people)
                    self._check(queues)
                await self._calm()
                people.cancel_scope.cancel()
        async with self.lab.runner() as (control, queues):
            self.control = control
            before = [len(each.starts) for each in self.robots.values()]
            await anyio.sleep(60)
            after = [len(each.starts) for each in self.robots.values()]
            assert before == after, "a restart started something"
            assert not any(each.is_open for each in queues.robot_queues)
        self.hold()

    async def _calm(self) -> None:
        journal = self.lab.harness.journal
        if journal.slow:  # virtual time stands still where a shielded wait is cancelled
            journal.slow = 0.0
            await anyio.sleep(3)
        journal.down = False

    def _request(self) -> QueueRequest:
        match self.chance.randrange(9):
            case 0:
                return QueueRequest(start=order(sequence("sim"), script=QUICK), by_itself=True)
            case 1 | 2:
                graph = shared(sequence("both", 3), "Scout", "Carrier")
                return QueueRequest(start=led(graph, lost=self.chance.choice(["stop", "wait"])))
            case 3:
                return QueueRequest(start=asked_of(line("Scout", CONFIRM, "Scout")))
            case 4:
                start = order(sequence("each"), engine="David")
                return QueueRequest(start=start, engines=self.chance.choice([ROBOTS, ROBOTS[::-1]]))
            case _:
                return on(self.chance.choice(ROBOTS))

    async def _put(self, queues: Queues) -> None:
        with suppress(Refused):
            entry, _ = await queues.put(self._request(), author(ANN), ANN)
            self.robots_of[request_of(entry.id)] = entry.entered.robots
            TOTALS["entries"] += 1

    async def _press(self, queues: Queues, entry: Entry) -> None:
        who = self.chance.choice((ANN, BEN))
        with suppress(Refused):
            look = await queues.look(entry.id, {}, who)
            name = request_of(entry.id)
            self.presses[name] = self.stops[name]
            TOTALS["presses"] += 1
            await queues.start(entry.id, TurnRequest(look.digest), author(who), who)

    async def _direct(self, control: ExecutionService) -> None:
        request = order(sequence("other"), engine=self.chance.choice(ROBOTS))
        self.robots_of[request.request_id] = (request.engine,)
        self.presses[request.request_id] = self.stops[request.request_id]
        with suppress(Refused):
            await control.start(request, author(BEN), BEN)

    def _note_stop(self, robot: str = "") -> None:
        TOTALS["Stops"] += 1
        for name, robots in self.robots_of.items():
            if not robot or robot in robots:
                self.stops[name] += 1

    async def _stop_run(self, control: ExecutionService, queues: Queues) -> None:
        if not self.runs:
            return
        run, request, robots = self.chance.choice(list(self.runs.values()))
        TOTALS["Stops"] += 1
        concerned = {
            request_of(each.id)
            for each in queues.entries
            if not set(robots).isdisjoint(each.entered.robots)
        }
        for name in {self._pressed(request)} | concerned:
            self.stops[name] += 1
        with suppress(Refused):
            await control.stop(run, author(BEN))
        self._hold_closed(queues, robots)

    def _hold_closed(self, queues: Queues, robots: tuple[str, ...]) -> None:
        """Check in the step of a Stop that no queue of its robots is open."""
        for queue in queues.robot_queues:
            if queue.name in robots and queue.is_open:
                self.faults.append(f"a Stop left the queue of {queue.name} open")

    async def _do(
        self, step: str, control: ExecutionService, queues: Queues, people: TaskGroup
    ) -> None:
        journal, chance, robot = self.lab.harness.journal, self.chance, self.chance.choice(ROBOTS)
        waiting = queues.entries
        ready = [each for each in waiting if each.ready_at is not None]
        match step:
            case "put":
                people.start_soon(self._put, queues)
                await anyio.sleep(chance.choice([0.0, 0.1]))
            case "press" if waiting:
                for _ in range(chance.choice([1, 1, 2])):
                    people.start_soon(self._press, queues, chance.choice(ready or waiting))
                await anyio.sleep(chance.choice([0.0, 0.05, 0.2, 2.0]))
            case "direct":
                people.start_soon(self._direct, control)
                await anyio.sleep(chance.choice([0.0, 0.2]))
            case "sleep":
                await anyio.sleep(chance.choice([0.3, 2.0, 9.0]))
            case "stop all":
                self._note_stop()
                control.stop_all(author(BEN))
                self._hold_closed(queues, ROBOTS)
            case "stop robot":
                self._note_stop(robot)
                control.stop_robot(robot, author(BEN))
                self._hold_closed(queues, (robot,))
            case "stop run":
                await self._stop_run(control, queues)
            case "reopen":
                for queue in queues.robot_queues:
                    if queue.closed is not None and queue in queues.robot_queues:
                        with suppress(Refused):
                            await reopened(queues, queue.name)
                            self.reopened.add(id(queue))
            case "lost":
                self.robots[robot].engine = self.robots[robot].new_engine()
            case "baton":
                with suppress(Refused):
                    await control.rights.set_rules(robot, Rules(baton=chance.random() < 0.5), OLGA)
                    await control.rights.take(robot, ANN, author(ANN), "mine")
            case "down":
                journal.down = not journal.down
            case "slow":
                journal.slow = chance.choice([0.0, 0.0, 0.3])
            case "move" | "remove" if waiting:
                with suppress(Refused):
                    one, before = chance.choice(waiting), chance.choice(waiting)
                    if step == "move":
                        await queues.move(one.id, MoveRequest(before.id), author(ANN), ANN)
                    else:
                        await queues.remove(one.id, author(ANN), ANN)
            case "close" if queues.robot_queues:
                queues.close(chance.choice(queues.robot_queues).name, author(BEN))
            case "rest":
                await self._rest(control)
            case "hold" | "step" | "go on" | "answer":
                await self._steer(step, control)

    async def _rest(self, control: ExecutionService) -> None:
        for opened in tuple(control.open.values()):
            run = opened.run
            robot = self.robots.get(run.engine) if run.lost and run.led is None else None
            if robot is not None and not await robot.moving(run.graph_name):
                with suppress(Refused):
                    confirm_rest(opened, RestRequest("I stand beside it."), author(BEN))

    async def _steer(self, step: str, control: ExecutionService) -> None:
        """One press of a person on a led run."""
        for opened in tuple(control.open.values()):
            run, held = opened.run, opened.run.held
            if run.led is None or run.end is not None:
                continue
            with suppress(Refused):
                if step == "hold" and held is None:
                    await control.wait(run.id, WaitRequest("Look."), author(BEN))
                elif step == "step" and held is not None:
                    await control.step(run.id, StepRequest(time(held.at)), author(BEN))
                elif step == "go on" and held is not None:
                    await control.go_on(run.id, GoOnRequest(time(held.at)), author(BEN))
                elif step == "answer" and run.questions:
                    asked = AnswerRequest(value=self.chance.random() < 0.8)
                    question = next(iter(run.questions))
                    await control.questions.answer(run.id, question, asked, author(BEN), BEN)

    def _check(self, queues: Queues) -> None:
        """A closed queue is opened by a person alone, and nothing of it is ready."""
        for queue in queues.robot_queues:
            if queue.is_open and id(queue) in self.closed - self.reopened:
                self.faults.append(f"the queue of {queue.name} opened by itself")
            (self.closed.discard if queue.is_open else self.closed.add)(id(queue))
            if not queue.is_open:
                self.reopened.discard(id(queue))
                for entry in queues.entries:
                    if queue.name in entry.queue_names and entry.ready_at is not None:
                        self.faults.append("an entry of a closed queue is ready")

    def hold(self) -> None:
        """Check what must be true of the whole history."""
        assert self.faults == [], (self.log, self.faults)
        for robot in self.robots.values():
            sent = [each.run for each in robot.starts]
            assert len(sent) == len(set(sent)), (self.log, sent)
        requests = Counter(each.request_id for each in self.lab.starts() if each.piece is None)
        assert all(number == 1 for number in requests.values()), (self.log, requests)
        assert all(number == 1 for number in self.begins.counts.values()), (
            self.log,
            self.begins.times,
        )
        messages = {each.run for robot in self.robots.values() for each in robot.starts}
        assert {run for run, _ in self.begins.times} <= messages, (self.log, self.begins.times)
        TOTALS["actions"] += sum(self.begins.counts.values())
        TOTALS["histories"] += 1


def lived(seed: int) -> None:
    async def main() -> None:
        await History(seed).live()

    run_in_virtual_time(main)


@settings(
    max_examples=examples(50),
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
@given(seed=st.integers(0, 2**32))
def test_no_history_starts_an_action_twice_without_a_press_or_after_a_stop(seed: int) -> None:
    lived(seed)


@pytest.fixture(scope="module", autouse=True)
def totals() -> Iterator[None]:
    """Say how much was lived through."""
    yield
    print(dict(TOTALS))  # noqa: T201 - how much was tried
