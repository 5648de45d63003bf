"""Whatever people, networks, engines and power cuts do: nothing is started twice, and nothing is
called stopped that moves. Random histories in virtual time."""

import random
from contextlib import suppress
from typing import Any

import anyio
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from action_assistant.errors import Refused
from action_assistant.runner.execution.interventions import RestRequest, confirm_rest
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.observations import ACTIVE, NodeState
from action_assistant.runner.links.port import EngineRefused, NoAnswer, Order, Report, Transitions
from action_assistant.runner.links.simulator import SimulatorLink
from action_assistant.runner.runs.events import StopRequested
from action_assistant.runner.runs.run import ENDED, State
from runner.harness import (
    ANN,
    BEN,
    Harness,
    Robot,
    engine,
    order,
    run_in_virtual_time,
    sequence,
    two_ends,
)
from runner.random_steps import live_through
from support.doses import examples

GRAPHS = {"one": sequence("one"), "two": two_ends("two")}
NAMES = tuple(GRAPHS)
#: Ends that say that nothing moves any more.
STILL: frozenset[State] = ENDED - {"lost", "refused"}

SCRIPTS: list[dict[str, Any]] = [
    {"*": [{"after_s": 0.3}]},
    {"*": [{"never": True}]},
    {"Work_0": [{"after_s": 0.5}], "*": [{"never": True, "stop_s": 1.5}]},
    {"*": [{"after_s": 8, "ignores_stop": True}]},
    {"*": [{"after_s": 1, "result": "on_error"}]},
    {"Work_0": [{"after_s": 0.4}], "*": [{"after_s": 7}]},
]
WAIT = st.tuples(st.just("wait"), st.sampled_from([0.01, 0.05, 0.2, 1.0, 4.0]))
START = st.tuples(st.sampled_from(["start", "start at once"]), st.sampled_from(NAMES))
STOP = st.tuples(st.sampled_from(["stop", "stop all"]), st.just(None))
TROUBLE = st.one_of(
    st.tuples(st.just("loss"), st.sampled_from([0.0, 0.3, 0.9])),
    st.tuples(st.just("start loss"), st.sampled_from([0.0, 0.5])),
    st.tuples(st.just("late"), st.sampled_from([0.0, 0.3, 5.0, 40.0])),
    st.tuples(st.just("old"), st.sampled_from([0.01, 0.8])),
    st.tuples(st.just("silent"), st.booleans()),
    st.tuples(st.just("journal"), st.booleans()),
    st.tuples(st.just("slow journal"), st.sampled_from([0.0, 0.5])),
    st.tuples(st.sampled_from(["crash", "engine restarts", "well"]), st.just(None)),
    st.tuples(st.sampled_from(["foreign start", "simulate"]), st.sampled_from(NAMES)),
)
#: Much goes on, and now and then something goes wrong.
STEPS = st.one_of(WAIT, START, WAIT, STOP, WAIT, START, TROUBLE)

#: A stranger starts a graph of the same name, whose engine calls it finished while it goes on.
ANOTHER_THAT_DOES_NOT_OBEY: list[tuple[str, Any]] = [
    ("wait", 4.0),
    ("stop all", None),
    ("silent", True),
    ("foreign start", "two"),
    ("stop all", None),
]


class Story:
    """One history: what is done, and what must hold all the while."""

    def __init__(self, seed: int, script: dict[str, Any]) -> None:
        self.script = script
        self.robot = Robot(engine(script), random.Random(seed))
        self.harness = Harness({"David": self.robot})
        self.false: list[str] = []
        self.still: set[str] = set()
        self.defiant: set[str] = set()
        self.robot.blind = 0.05

    async def live(self, steps: list[tuple[str, Any]]) -> None:
        """Play all steps, then repair everything and wait for rest."""
        async with anyio.create_task_group() as engines:
            self.engines = engines
            self.robot.tasks = engines
            engines.start_soon(self.follow, self.robot.engine)
            await live_through(self.harness, steps, self.judge, self.do)
            await self.come_to_rest()
            engines.cancel_scope.cancel()

    async def do(self, control: ExecutionService, people: Any, step: str, value: Any) -> None:
        """One step."""
        match step:
            case "wait":
                await anyio.sleep(value)
            case "start":
                await self.start(control, value, "David")
            case "start at once":
                for _ in range(3):
                    people.start_soon(self.start, control, value, "David")
            case "simulate":
                await self.start(control, value, "simulator")
            case "stop":
                for run in tuple(control.open)[:1]:
                    await control.stop(run, BEN)
            case "stop all":
                control.stop_all(BEN)
            case "loss":
                self.robot.loss = value
            case "start loss":
                self.robot.start_loss = value
            case "late":
                self.robot.start_delay = value
            case "old":
                self.robot.old = value
            case "silent":
                self.robot.silent = value
            case "journal":
                self.harness.journal.down = value
            case "slow journal":
                self.harness.journal.slow = value
            case "well":
                self.make_well()
            case "engine restarts":
                await self.robot.engine.aclose()
                self.robot.engine = engine(self.script)
                self.engines.start_soon(self.follow, self.robot.engine)
            case "foreign start":
                with suppress(EngineRefused, NoAnswer):  # what it makes of it is its own affair
                    await self.robot.engine.start(Order(run="theirs", graph=GRAPHS[value], umrf=""))

    def make_well(self) -> None:
        """Stop all losses and delays."""
        self.robot.start_delay, self.robot.old = 0.0, 0.01
        self.robot.loss = self.robot.start_loss = self.harness.journal.slow = 0.0
        self.robot.silent = self.harness.journal.down = False

    async def start(self, control: ExecutionService, name: str, where: str) -> None:
        """A start, which may be refused."""
        script = {"script": self.script} if where == "simulator" else {}
        with suppress(Refused):
            await control.start(order(GRAPHS[name], engine=where, **script), ANN)

    async def follow(self, engine_: SimulatorLink) -> None:
        """The truth about an engine: what was called still must not move any more."""

        def hear(report: Report) -> None:
            if isinstance(report, Transitions) and report.run in self.still:
                moved = [
                    each
                    for each in report.changes
                    if isinstance(each, NodeState) and each.state in ACTIVE
                ]
                self.false += [f"moves after its end: {each}" for each in moved]

        with engine_.listen(hear):
            await engine_.run()

    def judge(self, opened: OpenRun) -> None:
        """Called at every change: what is shown must be true at that moment."""
        run = opened.run
        sent = any(each.run == run.id for each in self.robot.starts)
        if run.state not in STILL or run.engine != "David" or not sent:
            return
        self.still.add(run.id)
        engine_ = self.robot.engine
        for name, now in engine_._engine.states().items():
            mine = engine_._run_of(name) == run.id
            if mine and any(state in ACTIVE for state in now.nodes.values()):
                self.false.append(f"{run.state} at {anyio.current_time()}: {now.nodes}")

    async def come_to_rest(self) -> None:
        """Repair everything, and stop all runs."""
        self.make_well()
        async with self.harness.runner() as control:
            control.watch(self.judge)
            await anyio.sleep(1)
            control.stop_all(BEN)
            await anyio.sleep(60)
            for opened in tuple(control.open.values()):
                if not await self.robot.moving(opened.run.graph_name):  # nor does its engine say so
                    confirm_rest(opened, RestRequest("I stand beside it."), BEN)
            await anyio.sleep(1)
            for opened in control.open.values():  # the engine does not obey once it has finished
                run = opened.run
                is_own = self.robot.engine._run_of(run.graph_name) == run.id
                assert run.state == ("stopping" if is_own else "lost")  # others took its place
                assert await self.robot.moving(run.graph_name)
                self.defiant.add(run.id)

    def hold(self) -> None:
        """Check the properties of the whole history."""
        assert self.false == []
        runs = [each.run for each in self.robot.starts]
        assert len(runs) == len(set(runs))
        last = {run.id: run for _, run in self.harness.shown}
        for stream in self.harness.journal.streams:
            if not stream.startswith("run/"):
                continue
            told = self.harness.journal.history(stream.removeprefix("run/"))
            assert told.state in ENDED or told.id in self.defiant
            assert told == last[told.id]
            stops = [e for e in self.harness.journal.told(told.id) if isinstance(e, StopRequested)]
            assert (told.desired == "stopped") == bool(stops)


@settings(max_examples=examples(200), suppress_health_check=[HealthCheck.too_slow])
@given(
    first=st.sampled_from(NAMES),
    seed=st.integers(0, 2**32),
    script=st.sampled_from(SCRIPTS),
    steps=st.lists(STEPS, min_size=6, max_size=30),
)
@example(first="two", seed=365, script=SCRIPTS[2], steps=ANOTHER_THAT_DOES_NOT_OBEY)
def test_nothing_is_started_twice_and_nothing_is_called_stopped_that_moves(
    first: str, seed: int, script: dict[str, Any], steps: list[tuple[str, Any]]
) -> None:
    async def main() -> None:
        story = Story(seed, script)
        await story.live([("start", first), *steps])
        story.hold()

    run_in_virtual_time(main)
