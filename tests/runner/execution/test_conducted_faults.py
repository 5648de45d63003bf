"""Random histories of a led run with faults of all kinds: no piece is sent twice, none after the
gate has closed, no outcome is made up, and nothing is called stopped that moves."""

import json
import random
from collections import defaultdict
from contextlib import suppress
from typing import Any

import anyio
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from action_assistant.errors import Refused
from action_assistant.runner.execution.conducted_steps import CONDUCTED_FACTS
from action_assistant.runner.execution.interventions import RestRequest, confirm_rest
from action_assistant.runner.execution.piece_values import returned_of
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.led_calls import LedCalls
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.links.port import CallBegan, Order, Registration
from action_assistant.runner.links.simulator import SimulatorLink
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import (
    Author,
    Observed,
    PieceBegan,
    PieceEnded,
    Published,
    Released,
    Requested,
    RunEvent,
    StopRequested,
)
from action_assistant.runner.runs.run import ENDED
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import (
    BreakpointsRequest,
    GoOnRequest,
    StartRequest,
    StepRequest,
    WaitRequest,
)
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files import codec
from action_assistant.umrf.kept_values import keeper
from action_assistant.umrf.model import Graph
from action_assistant.umrf.pieces import outcome_of
from action_assistant.umrf.semantics import Behaviour, Call, Engine, GraphRefused, Script
from action_assistant.umrf.semantics.values import MISSING, slots_of
from runner.execution.test_conducted_courses import ACCEPTED, LedRobot, drawn, played, with_values
from runner.harness import (
    ANN,
    BEN,
    MemoryJournal,
    at_once,
    clock_us,
    order,
    run_in_virtual_time,
    stand_still,
)
from support.doses import examples

ROBOTS = {"A": "Ann", "B": "Bob", "C": "Cy"}
STEPS = [
    "wait", "wait", "wait", "wait", "silent", "well", "restart robot", "foreign start", "foreign stop",
    "lose starts", "load slowly", "kill runner", "go on", "stop", "journal down", "clock jumps",
]  # fmt: skip


class Story:
    """One led run, what happens to it, and what must hold all the while."""

    def __init__(
        self, seed: int, *, values: bool = False, stalls: bool = False, waits: bool = False
    ) -> None:
        self.chance = random.Random(seed)
        self.waits = random.Random(f"waits {seed}") if waits else None
        self.stalls = random.Random(f"stalls {seed}") if stalls else None
        self.seed = seed
        self.graph, self.calls = with_values(*drawn(seed), seed) if values else drawn(seed)
        self.counted: dict[str, int] = defaultdict(int)
        self.robots = {
            name: WatchedRobot(self, name, self.calls, self.counted, seed)
            for name in ROBOTS.values()
        }
        if values:
            for robot in self.robots.values():
                robot.known = tuple(map(codec.write_action, (*self.graph.actions, keeper())))
        self.journal = MemoryJournal()
        self.control: ExecutionService | None = None
        self.run = ""
        self.jump_us = 0
        self.faults: list[str] = []
        self.log: list[str] = []

    def request(self) -> StartRequest:
        """The start."""
        actors = {each.actor for each in self.graph.actions}
        return order(
            self.graph,
            engine="conducted",
            robots={actor: ROBOTS[actor] for actor in actors},
            lost=self.chance.choice(["stop", "wait"]),
            override=ACCEPTED,
        )

    def leaves(self, robot: str, piece: Order) -> None:
        """Called in the moment in which a piece leaves."""
        opened = self.control.open.get(self.run) if self.control is not None and self.run else None
        if opened is None:
            return
        run = opened.run
        if run.held is not None or run.desired == "stopped":
            self.faults.append(f"{piece.graph.name} left for {robot} after the gate had closed")
        assert self.control is not None
        only = self.control._conductors._open[self.run].gate._let
        if only is not None and only.node not in piece.graph.actions:
            self.faults.append(f"{piece.graph.name} left for {robot} in a step of {only.node}")

    def judge(self, opened: OpenRun) -> None:
        """Called at every change: a run that is over must not move."""
        run = opened.run
        if run.led is None or run.end is None or run.end == "lost":
            return
        for name, robot in self.robots.items():
            inside = robot.engine._engine
            for each in inside.executing(inside.now):
                if each.graph.startswith("g--") and robot.owner.get(each.graph, "").startswith(
                    run.id
                ):
                    self.faults.append(f"{run.end} while {each.graph} moves on {name}")

    async def live(self) -> str:
        """Live through the story; return how it ended."""
        try:
            _, engine = played(self.graph, self.calls)
        except GraphRefused:
            return "refused"
        if engine.crashed or engine.locked:
            return "an engine would abort"
        async with anyio.create_task_group() as engines:
            self.engines = engines
            for robot in self.robots.values():
                robot.tasks = engines
                engines.start_soon(robot.engine.run)
            steps = [self.chance.choice(STEPS) for _ in range(self.chance.randint(6, 20))]
            end = "not offered"
            while True:
                more = await self._runner(steps)
                if more is None:
                    break
                end = more
                if end != "killed":
                    break
            engines.cancel_scope.cancel()
        return end

    async def _runner(self, steps: list[str]) -> str | None:
        """One life of the runner."""
        async with ExecutionService.opened(
            self.journal,
            Robots(dict(self.robots)),
            clock_us=lambda: clock_us() + self.jump_us,
            run_in_worker=at_once,
        ) as control:
            self.control = control
            control.watch(self.judge)
            for name in self.robots:
                control.robots.add(Registration(name=name, led=True))
            await anyio.sleep(1)
            if not self.run:
                try:
                    self.run = (await control.start(self.request(), ANN)).run.id
                except Refused:
                    return None
            while steps:
                step = steps.pop(0)
                self.log.append(step)
                if step == "kill runner":
                    return "killed"
                await self._do(control, step)
            return await self._come_to_rest(control)

    async def _do(self, control: ExecutionService, step: str) -> None:
        robot = self.robots[self.chance.choice(sorted(self.robots))]
        opened = control.open.get(self.run)
        match step:
            case "wait":
                await anyio.sleep(self.chance.choice([0.01, 0.3, 1.0, 4.0]))
                if self.stalls is not None and self.stalls.random() < 0.4:
                    stand_still(self.stalls.choice([1.5, 2.5, 3.5, 8.0]))
                if self.waits is not None:
                    await self._wait_or_step(control, self.waits)
            case "silent":
                robot.silent = True
                await anyio.sleep(self.chance.choice([0.5, 4.0, 12.0]))
            case "well":
                self._make_well()
            case "restart robot":
                await robot.restart()
            case "foreign start":
                with suppress(Exception):
                    await robot.engine.start(Order(run="theirs", graph=foreign(), umrf=""))
            case "foreign stop":
                for graph in tuple(robot.owner)[:1]:
                    await robot.engine.stop(graph)
            case "lose starts":
                robot.start_loss = 0.7
            case "load slowly":
                robot.engine._engine.loading_ms = self.chance.choice([0.0, 1500.0, 8000.0])
            case "go on" if opened is not None and opened.run.held is not None:
                with suppress(Refused):
                    await control.go_on(self.run, GoOnRequest(time(opened.run.held.at)), BEN)
            case "stop" if self.chance.random() < 0.4:
                with suppress(Refused):
                    await control.stop(self.run, BEN)
            case "journal down":
                self.journal.down = True
                await anyio.sleep(1)
                self.journal.down = False
            case "clock jumps":
                self.jump_us += self.chance.choice([-3600, 3600, 1]) * 1_000_000

    async def _wait_or_step(self, control: ExecutionService, chance: random.Random) -> None:
        """One press of a person, or of two at once, on a run that waits or goes on."""
        opened = control.open.get(self.run)
        if opened is None:
            return
        if chance.random() < 0.3:
            node, visit = chance.choice(sorted(opened.run.actions)), chance.randint(0, 2)
            marks = (Breakpoint(action=node, visit=visit),) if chance.random() < 0.8 else ()
            with suppress(Refused):
                asked = BreakpointsRequest(marks, opened.run.breakpoints)
                await control.set_breakpoints(self.run, asked, BEN)
        if opened.run.held is None:
            if chance.random() < 0.6:
                with suppress(Refused):
                    await control.wait(self.run, WaitRequest("Look."), BEN)
                    assert opened.run.held is not None or opened.run.end is not None
            return
        goal = {"until": chance.choice(sorted(opened.run.actions))} if chance.random() < 0.3 else {}
        pressed = StepRequest(time(opened.run.held.at), **goal)

        async def press(author: Author) -> None:
            with suppress(Refused):
                await control.step(self.run, pressed, author)

        async with anyio.create_task_group() as presses:
            for author in (ANN, BEN)[: chance.randint(1, 2)]:
                presses.start_soon(press, author)

    def _hold_steps(self) -> None:
        """Check that each step let one action begin at most, the one that it names. That nothing
        leaves while the run is held is seen in the moment of leaving."""
        limit, begun = "", 0
        for each in self.journal.told(self.run):
            match each:
                case Released(step=step):
                    limit, begun = step, 0
                case PieceBegan(node=node, piece=piece) if limit:
                    events = (
                        self.journal.told(piece) if f"run/{piece}" in self.journal.streams else []
                    )
                    if any(isinstance(one, Published) for one in events):
                        begun += 1
                        assert (node, begun) == (limit, 1), (self.seed, self.log, each)

    def _make_well(self) -> None:
        for robot in self.robots.values():
            robot.silent, robot.start_loss = False, 0.0
            robot.engine._engine.loading_ms = 0.0

    async def _come_to_rest(self, control: ExecutionService) -> str:
        """Mend everything, and stop everything."""
        self._make_well()
        await anyio.sleep(2)
        control.stop_all(BEN)
        await anyio.sleep(60)
        for _ in range(3):
            for opened in tuple(control.open.values()):
                run = opened.run
                if run.piece is None:
                    continue
                if await self.robots[run.engine].moving(run.graph_name):
                    await self.robots[run.engine].engine.stop(run.graph_name)
                else:
                    with suppress(Refused):
                        confirm_rest(opened, RestRequest("I stand beside it."), BEN)
            await anyio.sleep(5)
        opened = control.open.get(self.run)
        if opened is not None:
            self.faults.append(f"it never ends: {opened.run.state} {opened.watch.trouble}")
            return "open"
        return (await control.find(self.run)).state

    def hold(self) -> None:
        """Check what must be true of the whole story."""
        assert self.faults == [], (self.seed, self.log, self.faults)
        for name, robot in self.robots.items():
            sent = [each.run for each in robot.starts]
            assert len(sent) == len(set(sent)), (self.seed, name)
        if not self.run:
            return
        for each in self.journal.told(self.run):
            if (
                isinstance(each, PieceEnded)
                and each.how == "shape"
                and each.outcome != "on_stopped"
            ):
                shown = [
                    outcome_of(one.state, one.nodes.get(each.node, "FINISHED"))
                    for event in self.journal.told(each.piece)
                    if isinstance(event, Observed)
                    for one in event.seen
                    if isinstance(one, Snapshot)
                ]
                assert each.outcome in shown or "on_stopped" in shown, (self.seed, each)
                if each.piece in self.meant:
                    assert self.meant[each.piece] == each.outcome, (self.seed, each)
        self._hold_values()
        self._hold_steps()
        assert self.journal.history(self.run).state in ENDED

    def _hold_values(self) -> None:
        """Check that each piece has given what its code gave, and was sent what the whole graph has."""
        gives: dict[str, dict[str, Any]] = {}
        for robot in self.robots.values():
            gives |= robot.gives
        told = self.journal.told(self.run)
        for each in told:
            if isinstance(each, PieceEnded) and each.outputs:
                assert each.how == "shape", (self.seed, each)
                gave = {
                    name: value for name, value in gives[each.piece].items() if value is not MISSING
                }
                assert {k: json.loads(v) for k, v in each.outputs.items()} == gave, (
                    self.seed,
                    each,
                )
                assert set(each.unset) == gives[each.piece].keys() - gave.keys(), (self.seed, each)
        calls = self._calls(told)
        for each in told:
            if isinstance(each, PieceBegan) and f"run/{each.piece}" in self.journal.streams:
                first = self.journal.told(each.piece)[0]
                assert isinstance(first, Requested)
                slots = slots_of(codec.read(first.umrf).graph.actions[0].inputs)
                sent = {name: slot.value for name, slot in slots.items() if slot.has_value()}
                assert sent == calls[each.call].inputs, (self.seed, each, sent, calls[each.call])

    def _calls(self, told: list[RunEvent]) -> dict[int, Call]:
        """Return the calls of the whole graph by number, as its stored events bring them about."""
        led = LedCalls({each.full_name for each in self.graph.actions})
        engine = Engine(facts=CONDUCTED_FACTS, performer=led)
        calls: dict[int, Call] = {}
        began = next((each.at for each in told if isinstance(each, Published)), None)
        if began is None:
            return calls
        engine.start(self.graph, 0.0)
        newest = 0.0
        for each in told:
            newest = (
                max(newest, (each.at - began) / 1000) if isinstance(each, PieceEnded) else newest
            )
            if isinstance(each, PieceEnded):
                engine.returned(returned_of(each), newest)
            elif isinstance(each, StopRequested):
                newest = max(newest, (each.at - began) / 1000)
                engine.stop(self.graph.name, newest)
            calls |= {
                each.call.number: each.call for each in led.news() if isinstance(each, CallBegan)
            }
        return calls

    @property
    def meant(self) -> dict[str, str]:
        """Return the outcome that the code of each piece gives unless it is stopped, by piece."""
        found: dict[str, str] = {}
        for robot in self.robots.values():
            found |= robot.meant
        return found


class WatchedRobot(LedRobot):
    """A robot that tells the story of each piece that leaves for it."""

    def __init__(
        self,
        story: Story,
        name: str,
        calls: dict[str, list[Behaviour]],
        counted: dict[str, int],
        seed: int,
    ) -> None:
        super().__init__(calls, counted, seed)
        self.story = story
        self.name = name
        self.owner: dict[str, str] = {}  # graph -> piece

    async def start(self, order: Order, leaves: Any = lambda: None) -> None:
        """One message, whose leaving the story sees."""

        def leaving() -> None:
            leaves()
            self.story.leaves(self.name, order)

        await super().start(order, leaving)

    async def _begin(self, order: Order) -> None:
        self.owner[order.graph.name] = order.run
        await super()._begin(order)

    async def restart(self) -> None:
        """The engine dies, and another one begins."""
        await self.engine.aclose()
        self.engine = SimulatorLink(Engine(facts=PINNED, script=Script({})), clock_us=clock_us)
        self.owner = {}
        assert self.tasks is not None
        self.tasks.start_soon(self.engine.run)


def foreign() -> Graph:
    """A graph that somebody else starts."""
    graph, _ = drawn(3)
    return Graph(name="theirs", actions=graph.actions[:1], relations=graph.relations[:1])


def lived(seed: int, *, values: bool = False, stalls: bool = False, waits: bool = False) -> str:
    """Live through one story in virtual time. `stalls`: the runner's process also stands still;
    `waits`: people also make the run wait, and let it make steps."""
    found = ""

    async def main() -> None:
        nonlocal found
        story = Story(seed, values=values, stalls=stalls, waits=waits)
        found = await story.live()
        story.hold()

    run_in_virtual_time(main)
    return found


@pytest.mark.timeout(0)
@settings(max_examples=examples(8), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 2**32))
def test_values_are_those_of_the_code_whatever_happens(seed: int) -> None:
    lived(seed, values=True)


@pytest.mark.timeout(0)
@settings(max_examples=examples(8), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 2**32), stalls=st.booleans())
def test_a_led_run_stays_safe_whatever_happens(seed: int, stalls: bool) -> None:
    lived(seed, stalls=stalls)


@pytest.mark.timeout(0)
@settings(max_examples=examples(8), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 2**32))
def test_no_order_of_wait_step_go_on_stop_and_restart_begins_an_action_twice(seed: int) -> None:
    lived(seed, waits=True)


def test_a_clock_that_is_set_back_between_two_runners_leaves_the_run_stoppable() -> None:
    assert lived(1444) in ENDED
    assert lived(247) in ENDED
