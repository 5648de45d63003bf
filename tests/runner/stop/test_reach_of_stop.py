"""Stop reaches everything that moves or is about to: graphs that carry a run's mark where no run of
ours is, starts under way, robots that are registered anew meanwhile. In virtual time."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import anyio
import pytest

from action_assistant.errors import Conflict
from action_assistant.runner.emulator.messages import Start
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Leaves, Link, NotSent, Order, Registration, unwatched
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.robot_events import StopUnproven
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.files import codec
from runner.harness import ANN, BEN, Harness, at_once, clock_us, order, sequence, until, virtual
from runner.registered_robots import NEVER, Open, RegisteredRobots, fleet, group
from runner.robots_in_network import PATROL, RobotsInNetwork, asked, shown


async def _cleaning(robot: Open, run: str) -> None:
    """Start a graph there, as a stranger, that carries the mark of a run."""
    await robot.engine.start(Order(run=run, graph=sequence("cleaning"), umrf=""))


# --- graphs that carry the mark of a run ------------------------------------------------------


@virtual
async def test_a_graph_with_the_mark_of_a_run_on_another_robot_is_stopped_too() -> None:
    david, eve = Open(NEVER), Open(NEVER)
    async with fleet(Harness(), David=david, Eve=eve) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await _cleaning(eve, run.id)
        await anyio.sleep(15)
        (look,) = await control.look(group(sequence(), "Eve"))
        assert {each.code: each.verdict for each in look.items}["quiet"] == "blocked"
        assert control.stop_robot("Eve", BEN) == ([], ["Eve: cleaning"])
        await until(lambda: not control.foreign_stops.is_stopping("Eve"))
        assert not await eve.moving("cleaning")
        assert control.open[run.id].run.desired == "running"


@virtual
async def test_a_graph_with_the_mark_of_a_run_that_has_ended_is_stopped_before_that_is_recorded() -> (
    None
):
    scene = RobotsInNetwork(4)
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).state == "running")
        scene.harness.journal.down = True
        await control.stop(run, BEN)
        await until(lambda: shown(control, run).state == "stopped")
        scene.network.carry(scene.starts()[0], "bag")  # somebody plays our start again
        await until(lambda: scene.nodes["David"].robot.moving == ("patrol",))
        await anyio.sleep(15)
        assert shown(control, run).state == "stopped"
        control.stop_all(BEN)
        await until(lambda: scene.nodes["David"].robot.moving == ())
        scene.harness.journal.down = False


# --- graphs that were begun just now ----------------------------------------------------------


def _their_start(scene: RobotsInNetwork) -> None:
    text = codec.write(PATROL)
    scene.network.carry(Start(graph_name="patrol", targets=("David",), graph_json=text), "terminal")


@pytest.mark.parametrize("after_s", [0.1, 1.0, 5.0])
@virtual
async def test_a_graph_that_somebody_started_a_moment_ago_is_stopped(after_s: float) -> None:
    scene = RobotsInNetwork(4)
    async with scene.played() as control:
        await anyio.sleep(45)
        _their_start(scene)
        await anyio.sleep(after_s)
        control.stop_all(BEN)
        await until(lambda: scene.nodes["David"].robot.moving == (), patience=5)
        await until(lambda: not control.foreign_stops.is_stopping("David"))


@virtual
async def test_a_graph_that_somebody_started_is_shown_moving_a_second_later() -> None:
    scene = RobotsInNetwork(4)
    async with scene.played() as control:
        await anyio.sleep(45)
        _their_start(scene)
        await anyio.sleep(2)
        assert [each.active for each in control.robots.robot("David").holds] == [True]


@virtual
async def test_a_stop_of_it_that_is_pressed_again_goes_on_for_another_minute() -> None:
    david = Open(NEVER)
    async with fleet(Harness(), David=david) as control:
        await _cleaning(david, "theirs")
        await anyio.sleep(15)
        david.loss = 1.0
        control.stop_robot("David", BEN)
        await anyio.sleep(50)
        control.stop_robot("David", BEN)
        await anyio.sleep(20)
        david.loss = 0.0
        await until(lambda: not control.foreign_stops.is_stopping("David"))
        assert not await david.moving("cleaning")


# --- robots that are registered anew ----------------------------------------------------------


class Lease:
    """One link to a robot, which sends nothing any more once the registry has let go of it."""

    def __init__(self, robot: Open) -> None:
        self._robot = robot
        self._is_over = False

    def __getattr__(self, name: str) -> Any:
        return getattr(self._robot, name)

    async def stop(self, graph_name: str) -> None:
        """Sent while it lives."""
        if self._is_over:
            raise NotSent("it is not being looked for any more")
        await self._robot.stop(graph_name)

    async def aclose(self) -> None:
        """The robot goes on."""
        self._is_over = True


class Leases(RegisteredRobots):
    """A reach that makes another link at each registration."""

    def link(self, registration: Registration, facts: EngineFacts) -> Link:
        """A new one to the robot of that name."""
        return Lease(self.robots[registration.name])  # type: ignore[return-value,arg-type]


@virtual
async def test_a_start_that_comes_while_its_robot_is_registered_anew_can_be_stopped() -> None:
    harness, david = Harness(), Open(NEVER)
    robots = Robots(reach=Leases(David=david))
    async with (
        ExecutionService.opened(
            harness.journal, robots, clock_us=clock_us, run_in_worker=at_once
        ) as control,
        anyio.create_task_group() as tasks,
    ):
        await control.register(Registration(name="David"), ANN)
        await until(lambda: control.robots.robot("David").heard_at is not None)
        harness.journal.slow = 1.0
        tasks.start_soon(control.register, Registration(name="David", domain=3), BEN)
        await anyio.sleep(0.5)
        run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
        await until(lambda: control.open[run].run.state == "running")
        assert control.robots.robot("David").domain == 3
        await control.stop(run, BEN)
        await until(lambda: run not in control.open)
        assert (await control.find(run)).state == "stopped"


@virtual
async def test_a_robot_is_neither_changed_nor_forgotten_while_something_is_stopped_there() -> None:
    david = Open(NEVER)
    async with fleet(Harness(), David=david) as control:
        await _cleaning(david, "theirs")
        await anyio.sleep(15)
        david.loss = 1.0
        control.stop_robot("David", BEN)
        with pytest.raises(Conflict, match="being stopped"):
            await control.register(Registration(name="David", domain=3), BEN)
        with pytest.raises(Conflict, match="being stopped"):
            await control.remove("David", BEN)
        david.loss = 0.0
        await until(lambda: not control.foreign_stops.is_stopping("David"))
        await control.remove("David", BEN)


@asynccontextmanager
async def _leased(harness: Harness, david: Open) -> AsyncIterator[ExecutionService]:
    """A runner in which somebody else's graph moves on David, which hears nothing more."""
    robots = Robots(reach=Leases(David=david))
    async with ExecutionService.opened(
        harness.journal, robots, clock_us=clock_us, run_in_worker=at_once
    ) as control:
        await control.register(Registration(name="David"), ANN)
        await _cleaning(david, "theirs")
        await anyio.sleep(15)
        david.loss = 1.0
        harness.journal.slow = 1.0
        yield control


@virtual
async def test_a_stop_that_is_pressed_while_its_robot_is_registered_anew_goes_the_new_way() -> None:
    harness, david = Harness(), Open(NEVER)
    async with _leased(harness, david) as control, anyio.create_task_group() as tasks:
        tasks.start_soon(control.register, Registration(name="David", domain=3), BEN)
        await anyio.sleep(0.5)
        control.stop_robot("David", BEN)
        await until(lambda: control.robots.robot("David").domain == 3)
        david.loss = 0.0
        await until(lambda: not control.foreign_stops.is_stopping("David"), patience=10)
        assert not await david.moving("cleaning")


@virtual
async def test_a_stop_that_is_pressed_while_its_robot_is_removed_ends_and_says_so() -> None:
    harness, david = Harness(), Open(NEVER)
    async with _leased(harness, david) as control, anyio.create_task_group() as tasks:
        tasks.start_soon(control.remove, "David", BEN)
        await anyio.sleep(0.5)
        control.stop_robot("David", BEN)
        await until(lambda: not control.robots.names)
        await until(lambda: not control.foreign_stops.is_stopping("David"), patience=10)
        await until(lambda: not control.robots.robot_log.waiting)
        told = [event for _, event in await control.robots.robot_log.newest("David", 20)]
        (given_up,) = [event for event in told if isinstance(event, StopUnproven)]
        assert "taken out of the registry" in given_up.why


# --- starts under way -------------------------------------------------------------------------


class Slow(Open):
    """A robot whose start takes its time to leave."""

    async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
        """Two seconds, in any moment of which it may have left."""
        leaves()
        await anyio.sleep(2)
        await super().start(order, leaves)


@virtual
async def test_stopping_a_robot_catches_a_start_there_that_is_being_stored_and_no_other() -> None:
    david, eve = Open(NEVER), Open(NEVER)
    harness = Harness()
    async with fleet(harness, David=david, Eve=eve) as control, anyio.create_task_group() as tasks:
        harness.journal.slow = 1.0
        for name in ("David", "Eve"):
            tasks.start_soon(control.start, order(sequence(), engine=name), ANN)
        await anyio.sleep(0.5)
        assert control.stop_robot("David", BEN) == ([], [])
        await until(lambda: len(eve.starts) == 1)
        await anyio.sleep(2)
        assert david.starts == []
        ((run),) = [each.run for each in control.open.values() if each.run.end is None]
        assert (run.engine, run.desired) == ("Eve", "running")


@virtual
async def test_stopping_a_group_catches_those_of_its_robots_that_are_still_to_start() -> None:
    david, eve = Slow(NEVER), Open(NEVER)
    harness = Harness()
    async with fleet(harness, David=david, Eve=eve) as control, anyio.create_task_group() as tasks:
        tasks.start_soon(control.start_group, group(sequence(), "David", "Eve"), ANN)
        await until(lambda: bool(control.open))
        (first,) = control.open.values()
        assert first.run.group is not None
        await control.stop(first.run.group, BEN)
        await anyio.sleep(10)
        assert eve.starts == []
        assert not await david.moving(sequence().name)
        await until(lambda: first.run.state == "lost")  # nobody can tell whether its start left
        await control.start(order(sequence(), engine="Eve"), ANN)
        assert len(eve.starts) == 1


@virtual
async def test_a_start_that_is_being_handed_over_holds_up_no_stop() -> None:
    david = Slow(NEVER)
    async with fleet(Harness(), David=david) as control, anyio.create_task_group() as tasks:
        tasks.start_soon(control.start, order(sequence(), engine="David"), ANN)
        await until(lambda: bool(control.open))
        (run,) = control.open
        await anyio.sleep(0.5)
        began = anyio.current_time()
        await control.stop(run, BEN)
        await until(lambda: bool(david.stops))
        assert david.stops[0][0] - began < 0.1
        await anyio.sleep(5)
        assert david.starts == []
        assert control.open[run].run.state == "unknown"  # whether it had left cannot be told here
        await until(lambda: control.open[run].run.state == "lost")


class Waiting(Open):
    """A robot whose start waits for those of others, `turn_s` seconds."""

    turn_s = 2.0

    async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
        """Send the start after a wait."""
        await anyio.sleep(self.turn_s)
        await super().start(order, leaves)


@virtual
async def test_a_start_that_is_stopped_before_its_turn_was_never_sent_and_no_alarm_is_raised() -> (
    None
):
    david = Waiting(NEVER)
    async with fleet(Harness(), David=david) as control, anyio.create_task_group() as tasks:
        tasks.start_soon(control.start, order(sequence(), engine="David"), ANN)
        await until(lambda: bool(control.open))
        ((run, opened),) = control.open.items()
        await anyio.sleep(0.5)
        await control.stop(run, BEN)
        await until(lambda: run not in control.open)
        assert (opened.run.state, opened.run.detail) == (
            "stopped",
            "Stopped before anything was sent.",
        )
        assert not opened.run.alarms
        await anyio.sleep(5)
        assert david.starts == []
        assert (await control.start(order(sequence("next"), engine="David"), ANN)).fresh


class InTurn(Open):
    """A robot whose start leaves in the very step in which its turn comes."""

    def __init__(self, *more: Any) -> None:
        super().__init__(*more)
        self.turn = anyio.Event()

    async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
        """Send the start when its turn comes, without a further wait."""
        await self.turn.wait()
        await super().start(order, leaves)


@virtual
async def test_a_start_whose_turn_comes_together_with_a_stop_never_leaves() -> None:
    david = InTurn(NEVER)
    async with fleet(Harness(), David=david) as control, anyio.create_task_group() as tasks:
        tasks.start_soon(control.start, order(sequence(), engine="David"), ANN)
        await until(lambda: bool(control.open))
        ((run, opened),) = control.open.items()
        await anyio.sleep(0.5)
        david.turn.set()
        await control.stop(run, BEN)  # before the task that sends the start goes on
        await until(lambda: run not in control.open)
        assert (opened.run.state, opened.run.detail) == (
            "stopped",
            "Stopped before anything was sent.",
        )
        assert david.starts == []


@virtual
async def test_a_start_whose_turn_does_not_come_is_refused_and_was_never_sent() -> None:
    david = Waiting(NEVER)
    david.turn_s = 10
    async with fleet(Harness(), David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        assert (run.state, "its turn" in run.detail) == ("refused", True)
        await anyio.sleep(10)
        assert david.starts == []
