"""The answer to a stop of everything names runs, graphs and robots of which nothing is known. In
virtual time."""

import json

import anyio
import pytest

from action_assistant.runner.api.live import Hub
from action_assistant.runner.links.port import Order
from action_assistant.runner.stop.foreign_stop import StoppedAll
from runner.harness import ANN, BEN, Harness, clock_us, engine, order, sequence, until, virtual
from runner.registered_robots import NEVER, Open, fleet

_SILENT = "It is there, but does not answer a get within a second."


async def _cleaning(robot: Open) -> None:
    """Start a graph there as a stranger."""
    await robot.engine.start(Order(run="theirs", graph=sequence("cleaning"), umrf=""))
    await anyio.sleep(15)


@virtual
async def test_graphs_of_others_and_robots_of_which_nothing_is_known_are_named() -> None:
    david, eve, farah = Open(NEVER), Open(NEVER), Open(NEVER)
    async with fleet(Harness(), David=david, Eve=eve, Farah=farah) as control:
        run = (await control.start(order(sequence(), engine="Farah"), ANN)).run.id
        eve.silent = True
        await _cleaning(david)
        told = control.stop_all(BEN)
        assert told == StoppedAll([run], {"David": ["cleaning"]}, {"Eve": _SILENT})
        await until(lambda: not control.foreign_stops.is_stopping("David"))
        assert not await david.moving("cleaning")
        assert control.stop_all(BEN).graphs == {}


@virtual
async def test_the_last_graphs_of_a_robot_that_has_fallen_silent_are_stopped_and_it_is_named() -> (
    None
):
    david = Open(NEVER)
    async with fleet(Harness(), David=david) as control:
        await _cleaning(david)
        david.silent = True
        await anyio.sleep(15)
        assert control.stop_all(BEN) == StoppedAll([], {"David": ["cleaning"]}, {"David": _SILENT})


@virtual
async def test_a_robot_that_has_not_answered_yet_is_not_known_and_one_that_came_back_is() -> None:
    david = Open(NEVER)
    david.silent = True
    async with Harness({"David": david}).runner() as control:
        assert control.stop_all(BEN).unknown == {"David": "It has not answered yet."}
        david.silent = False
        await until(lambda: control.robots.robot("David").heard_at is not None)
        david.engine = engine(NEVER)
        await until(lambda: control.robots.robot("David").state == "restarted")
        assert control.stop_all(BEN).unknown == {}


@virtual
async def test_a_repeat_of_a_stop_reaches_no_run_that_was_admitted_since_it_first_came() -> None:
    farah = Open(NEVER)
    told: list[str] = []
    async with fleet(Harness(), Farah=farah) as control:
        control.watch_stops(lambda author, _robot, _run: told.append(author.id))
        first = (await control.start(order(sequence(), engine="Farah"), ANN)).run.id
        await anyio.sleep(5)
        assert control.stop_all(BEN, "press").runs == [first]
        assert control.stop_all(BEN, "press", again=True).runs == [first]
        await until(lambda: first not in control.open)
        second = (await control.start(order(sequence(), engine="Farah"), ANN)).run.id
        await anyio.sleep(5)
        assert control.stop_all(BEN, "press", again=True).runs == []
        assert control.open[second].run.desired == "running"
        assert told == ["ben"]
        assert control.stop_all(BEN, "another press").runs == [second]


@virtual
async def test_a_repeat_of_a_stop_holds_no_start_back_that_was_asked_for_after_it() -> None:
    farah = Open(NEVER)
    harness = Harness()
    async with fleet(harness, Farah=farah) as control, anyio.create_task_group() as tasks:
        control.stop_all(BEN, "press")
        harness.journal.slow = 1.0
        tasks.start_soon(control.start, order(sequence(), engine="Farah"), ANN)
        await anyio.sleep(0.5)
        control.stop_all(BEN, "press", again=True)
        await until(lambda: bool(control.open))
        (opened,) = control.open.values()
        await opened.published.wait()
        assert (opened.run.end, opened.run.desired) == (None, "running")


@pytest.mark.parametrize("stop_id", ["", "x" * 100])
@virtual
async def test_a_press_whose_id_says_nothing_is_a_stop_of_its_own(stop_id: str) -> None:
    async with fleet(Harness(), Farah=Open(NEVER)) as control:
        control.stop_all(BEN, stop_id)
        run = (await control.start(order(sequence(), engine="Farah"), ANN)).run.id
        assert control.stop_all(BEN, stop_id, again=True).runs == [run]


@virtual
async def test_a_program_that_gives_all_its_presses_one_id_stops_with_each() -> None:
    async with fleet(Harness(), Farah=Open(NEVER)) as control:
        control.stop_all(BEN, "press")
        run = (await control.start(order(sequence(), engine="Farah"), ANN)).run.id
        text = await Hub(control, clock_us).follow(
            '{"type":"stop","run":"all","stop_id":"press"}', BEN
        )
        assert json.loads(text)["runs"] == [run]


@virtual
async def test_an_id_of_another_person_or_of_long_ago_is_a_stop_of_its_own() -> None:
    async with fleet(Harness(), Farah=Open(NEVER), Eve=Open(NEVER)) as control:
        control.stop_all(BEN, "press")
        first = (await control.start(order(sequence(), engine="Farah"), ANN)).run.id
        assert control.stop_all(ANN, "press", again=True).runs == [first]
        second = (await control.start(order(sequence(), engine="Eve"), ANN)).run.id
        await anyio.sleep(3600)
        assert control.stop_all(BEN, "press", again=True).runs == [second]


@virtual
async def test_the_live_socket_tells_the_same() -> None:
    david, eve = Open(NEVER), Open(NEVER)
    async with fleet(Harness(), David=david, Eve=eve) as control:
        eve.silent = True
        await _cleaning(david)
        text = await Hub(control, clock_us).follow('{"type":"stop","run":"all","stop_id":"s"}', BEN)
        assert json.loads(text) == {
            "type": "stopping",
            "stop_id": "s",
            "runs": [],
            "graphs": {"David": ["cleaning"]},
            "unknown": {"Eve": _SILENT},
        }
