"""Robots are registered, watched and recorded."""

import asyncio
from contextvars import Context

import anyio
import msgspec
import pytest

from action_assistant.errors import BadInput, Conflict, NotFound
from action_assistant.runner.api.live import Hub
from action_assistant.runner.emulator.messages import Stop
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import (
    Candidate,
    Registration,
    Sighting,
)
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.robot_events import Commanded, EngineBecame
from action_assistant.runner.runs.events import EngineSaid
from action_assistant.umrf.files import codec
from runner.harness import ANN, BEN, Harness, at_once, clock_us, order, sequence, until, virtual
from runner.registered_robots import NEVER, Open, RegisteredRobots, fleet
from runner.robots_in_network import LOOKED, RobotsInNetwork


@virtual
async def test_a_robot_that_answers_says_so_and_what_it_has() -> None:
    david = Open()
    async with fleet(Harness(), David=david) as control:
        robot = control.robots.robot("David")
        assert (robot.state, robot.why, robot.actions, robot.servers) == ("answering", "", 1, 1)
        index = await control.robots.index("David")
        assert list(index.actions) == ["Work"]
        # The index has the action as its file describes it, so the library can take it over.
        assert index.described["Work"] == codec.read_action(david.known_actions[0]).action


@virtual
async def test_each_beat_tells_when_an_idle_robot_answered_although_nothing_has_changed() -> None:
    async with fleet(Harness(), David=Open()) as control:
        hub = Hub(control, clock_us)
        changes: list[None] = []
        control.watch_robots(lambda: changes.append(None))
        first = msgspec.json.decode(hub.heartbeat())["heard"]["David"]
        await anyio.sleep(15)
        assert msgspec.json.decode(hub.heartbeat())["heard"]["David"] > first
        assert changes == []


@virtual
async def test_a_new_publisher_is_shown_without_a_word_of_the_engine() -> None:
    david = Open()
    async with fleet(Harness(), David=david) as control:
        told: list[int] = []
        control.watch_robots(lambda: told.append(control.robots.robot("David").others))
        david.others = 1
        await until(lambda: told == [1], patience=2)


@virtual
async def test_a_robot_that_falls_silent_is_busy_and_one_that_left_is_gone() -> None:
    david = Open()
    async with fleet(Harness(), David=david) as control:
        david.silent = True
        await until(lambda: control.robots.robot("David").state == "busy")
        assert "does not answer" in control.robots.robot("David").why
        david.become("gone", "Nobody answers there.")
        assert control.robots.robot("David").state == "gone"
        david.silent = False
        david.become("answering", "")
        await until(lambda: control.robots.robot("David").state == "answering")
        told = [event for _, event in await control.robots.robot_log.newest("David", 99)]
    states = [event.state for event in told if isinstance(event, EngineBecame)]
    assert states.index("busy") < states.index("gone")
    assert states[-1] == "answering"


@virtual
async def test_an_engine_that_came_back_is_called_restarted() -> None:
    david = Open()
    async with fleet(Harness(), David=david) as control:
        david.engine = Open().engine
        await until(lambda: control.robots.robot("David").state == "restarted")
        assert control.robots.robot("David").restarted_at is not None


@virtual
async def test_a_changed_profile_makes_another_link_and_a_removed_robot_is_unknown() -> None:
    reach = RegisteredRobots(David=Open())
    async with ExecutionService.opened(
        Harness().journal, Robots(reach=reach), clock_us=clock_us, run_in_worker=at_once
    ) as control:
        await control.register(Registration(name="David"), ANN)
        await control.register(Registration(name="David", profile={"pauses_safely": True}), ANN)
        assert reach.facts["David"].pauses_safely
        await control.remove("David", ANN)
        with pytest.raises(NotFound):
            control.robots.robot("David")


@pytest.mark.parametrize(
    ("registration", "path"),
    [
        (Registration(name="Da vid"), "/name"),
        (Registration(name="David", get_service="a b"), "/get_service"),
        (Registration(name="David", profile={"wings": 2}), "/profile/wings"),
    ],
)
def test_an_invalid_registration_is_refused_with_its_place(
    registration: Registration, path: str
) -> None:
    @virtual
    async def asked() -> None:
        async with fleet(Harness()) as control:
            with pytest.raises(BadInput) as refused:
                await control.register(registration, ANN)
            assert refused.value.where == {"path": path}

    asked()


@virtual
async def test_a_robot_with_a_run_is_neither_changed_nor_forgotten() -> None:
    async with fleet(Harness(), David=Open(NEVER)) as control:
        await control.start(order(sequence(), engine="David"), ANN)
        with pytest.raises(Conflict, match="stop it first"):
            await control.remove("David", ANN)
        control.stop_all(ANN)
        await until(lambda: not control.open)


@virtual
async def test_registered_robots_are_known_after_a_restart_and_removed_ones_are_not() -> None:
    harness = Harness()
    async with fleet(harness, David=Open(), Eve=Open()) as control:
        await control.remove("Eve", ANN)
    again = Robots(reach=RegisteredRobots(David=Open()))
    async with ExecutionService.opened(
        harness.journal, again, clock_us=clock_us, run_in_worker=at_once
    ) as control:
        assert [robot.name for robot in control.robots.all()] == ["simulator", "David"]


@virtual
async def test_candidates_are_those_that_nobody_registered() -> None:
    reach = RegisteredRobots(David=Open())
    seen = Candidate(domain=0, rmw="x", get_service="/umrf_graph_get")
    other = Candidate(domain=3, rmw="x", get_service="/eve/umrf_graph_get", actor="Eve")
    reach.sight = (seen, other)
    async with ExecutionService.opened(
        Harness().journal, Robots(reach=reach), clock_us=clock_us, run_in_worker=at_once
    ) as control:
        assert await control.robots.candidates() == (seen, other)
        reach.left_s = 2.5
        assert await control.robots.sighting() == Sighting((seen, other), 2.5)
        await control.register(Registration(name="David"), ANN)
        assert await control.robots.candidates() == (other,)
        assert (await control.robots.sighting()).engines == (other,)


@virtual
async def test_a_start_of_somebody_else_is_recorded_with_its_graph_and_the_run_it_stopped() -> None:
    david = Open(NEVER)
    async with fleet(Harness(), David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        text = codec.write(sequence())
        david.command("start", run.graph_name, text)
        assert control.open[run.id].run.alarms[-1].code == "foreign_start"
        await anyio.sleep(1)
        ((seq, told),) = [
            (seq, event)
            for seq, event in await control.robots.robot_log.newest("David", 9)
            if isinstance(event, Commanded)
        ]
        assert (told.command, told.run, told.number) == ("start", run.id, run.number)
        assert await control.robots.robot_log.graph("David", seq) == text
        control.stop_all(ANN)
        await until(lambda: not control.open)


@virtual
async def test_the_log_of_the_engine_is_kept_with_the_run_and_proves_nothing() -> None:
    david, harness = Open(NEVER), Harness()
    async with fleet(harness, David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await anyio.sleep(2)
        david.log("UMRF graph 'sequence' stopped.", run.graph_name)
        david.log("about another one", "another")
        assert control.open[run.id].run.state == "running"
        control.stop_all(ANN)
        await until(lambda: not control.open)
    said = [each.text for each in harness.journal.told(run.id) if isinstance(each, EngineSaid)]
    assert said == ["UMRF graph 'sequence' stopped."]


@virtual
async def test_an_engine_that_shows_another_graph_raises_an_alarm_and_goes_on() -> None:
    david = Open(NEVER)
    async with fleet(Harness(), David=david) as control:
        david.texts = {sequence().name: codec.write(sequence(actions=2))}
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await until(lambda: bool(control.open[run.id].run.alarms))
        (alarm,) = control.open[run.id].run.alarms
        assert alarm.code == "echo_differs"
        assert "lacks Work_2" in alarm.text
        assert control.open[run.id].run.state == "running"
        control.stop_all(ANN)
        await until(lambda: not control.open)


@virtual
async def test_no_run_is_called_stopped_while_two_engines_serve_one_path() -> None:
    david, harness = Open(NEVER), Harness()
    async with fleet(harness, David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await anyio.sleep(2)
        david.servers = 2
        await control.stop(run.id, BEN)
        await anyio.sleep(20)
        now = control.open[run.id].run
        assert now.state == "stopping"
        assert any("2 engines" in alarm.text for alarm in now.alarms)
        david.servers = 1
        await until(
            lambda: bool(control.open[run.id].run.loading)
        )  # whose feedback it was is not known
        await control.confirm_rest(run.id, LOOKED, BEN)
        await until(lambda: not control.open)
    assert harness.journal.history(run.id).proof_at is None


@virtual
async def test_a_command_of_others_that_comes_by_itself_in_no_task_is_heard_and_looked_into() -> (
    None
):
    """A link over ROS 2 hands over what its own thread has read: by callbacks of the event loop."""
    faults: list[object] = []
    here = RobotsInNetwork(5)
    async with here.played() as control:
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(lambda _, told: faults.append(told))
        await anyio.sleep(60)
        asked_at = control.robots.last_answers()["David"]
        stop = Stop(graph_name="patrol", targets=("David",))
        loop.call_later(0.1, lambda: here.network.carry(stop, "cli"), context=Context())
        await anyio.sleep(5)
        assert faults == []
        assert control.robots.last_answers()["David"] >= asked_at + 4_000_000
        await until(lambda: not control.robots.robot_log.waiting)
        heard = [each for _, each in await control.robots.robot_log.newest("David", 9)]
        assert [each.command for each in heard if isinstance(each, Commanded)] == ["stop"]
