"""Starts at most once; pauses where that is safe; takes up what a crash left. In virtual time."""

from typing import Any

import anyio
import pytest

from action_assistant.errors import BadInput, Conflict, Unavailable
from action_assistant.runner.links.port import Leaves, Order, unwatched
from action_assistant.runner.runs import views
from action_assistant.runner.runs.events import Published, Requested
from action_assistant.runner.runs.run import ENDED
from runner.harness import (
    ANN,
    BEN,
    Harness,
    Robot,
    ended,
    engine,
    order,
    sequence,
    until,
    virtual,
)
from runner.registered_robots import group


@virtual
async def test_a_simulated_run_goes_through_its_actions_to_the_end() -> None:
    harness = Harness()
    async with harness.runner() as control:
        started = await control.start(order(sequence(actions=3)), ANN)
        assert await ended(control, started.run.id) == "finished"
        run = await control.find(started.run.id)
    assert (run.result, run.number, run.stopped_by) == ("on_true", 1, None)
    assert [(a.aid, a.state, a.visits[0].result) for a in run.actions.values()] == [
        ("aid000000000", "FINISHED", "true"),
        ("aid000000001", "FINISHED", "true"),
        ("aid000000002", "FINISHED", "true"),
    ]
    assert run.ended_at is not None
    assert run.started_at is not None
    assert 3.0 <= (run.ended_at - run.started_at) / 1e6 < 3.2


@virtual
async def test_the_last_shown_state_is_that_of_the_history() -> None:
    harness = Harness()
    async with harness.runner() as control:
        started = await control.start(order(sequence(), script={"Work_1": [{"never": True}]}), ANN)
        await anyio.sleep(5)
        control.stop_all(BEN)
        await ended(control, started.run.id)
    assert harness.shown[-1][1] == harness.journal.history(started.run.id)
    assert harness.shown[-1][1].state == "stopped"


@virtual
async def test_the_run_is_stored_before_anything_is_sent() -> None:
    robot = Robot(engine())
    harness = Harness({"David": robot})
    async with harness.runner() as control:
        harness.journal.down = True
        with pytest.raises(Unavailable, match="could not be recorded"):
            await control.start(order(sequence(), engine="David"), ANN)
        assert robot.starts == []
        harness.journal.down = False
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        assert [type(each) for each in harness.journal.told(run.id)][:1] == [Requested]


@virtual
async def test_a_run_whose_record_was_in_doubt_is_told_as_refused() -> None:
    harness = Harness()
    async with harness.runner() as control:
        harness.journal.forgetful = True
        with pytest.raises(Unavailable):
            await control.start(order(sequence()), ANN)
        (stream,) = harness.journal.streams
        harness.journal.forgetful = False
        await anyio.sleep(3)
        assert (await control.find(stream.removeprefix("run/"))).state == "refused"


@pytest.mark.parametrize("askers", [2, 20])
@virtual
async def test_equal_requests_at_once_make_exactly_one_start(askers: int) -> None:
    robot = Robot(engine())
    harness = Harness({"David": robot})
    harness.journal.slow = 0.05
    asked = order(sequence(), engine="David")
    answers = []
    async with harness.runner() as control:

        async def ask() -> None:
            answers.append(await control.start(asked, ANN))

        async with anyio.create_task_group() as tasks:
            for _ in range(askers):
                tasks.start_soon(ask)
    assert len(robot.starts) == 1
    assert len({each.run.id for each in answers}) == 1
    assert [each.fresh for each in answers].count(True) == 1


@virtual
async def test_a_request_repeated_after_a_restart_is_the_same_run() -> None:
    harness = Harness()
    asked = order(sequence(actions=1))
    async with harness.runner() as control:
        first = await control.start(asked, ANN)
        await ended(control, first.run.id)
    async with harness.runner() as control:
        again = await control.start(asked, ANN)
    assert (again.run.id, again.run.state, again.fresh) == (first.run.id, "finished", False)


@virtual
async def test_a_request_id_belongs_to_one_start_only() -> None:
    harness = Harness()
    async with harness.runner() as control:
        await control.start(order(sequence("one"), request_id="same"), ANN)
        with pytest.raises(Conflict, match="request_id"):
            await control.start(order(sequence("two"), request_id="same"), ANN)


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("simulator", {"robots": {"": "David"}}),
        ("David", {"robots": {"": "David"}}),
        ("David", {"like": "David"}),
        ("David", {"behaviours": True}),
        ("conducted", {"robots": {"": "simulator"}, "like": "David"}),
        ("conducted", {"robots": {"": "simulator"}, "behaviours": True}),
    ],
)
@virtual
async def test_a_field_that_means_nothing_for_the_engine_is_refused_with_its_place(
    name: str, given: dict[str, Any]
) -> None:
    harness = Harness({"David": Robot(engine())})
    async with harness.runner() as control:
        with pytest.raises(BadInput) as refused:
            await control.start(order(sequence(), engine=name, **given), ANN)
        assert refused.value.where == {"path": f"/{list(given)[-1]}"}
        assert not control.open


@virtual
async def test_a_robot_registered_before_its_name_stood_for_led_runs_goes_on() -> None:
    robot = Robot(engine())
    async with Harness({"conducted": robot}).runner() as control:
        asked = order(sequence(), engine="conducted")
        plain = (await control.start(asked, ANN)).run
        await until(lambda: plain.id not in control.open)
        ended = await control.find(plain.id)
        assert (ended.state, ended.led, len(robot.starts)) == ("finished", None, 1)
        assert (await control.start(asked, ANN)).run.id == plain.id
        look = await control.look(group(sequence(), "conducted"))
        assert [each.engine for each in look] == ["conducted"]
        led = order(sequence(), engine="conducted", robots={"": "simulator"})
        assert (await control.start(led, ANN)).run.led is not None
        assert len(robot.starts) == 1


@virtual
async def test_a_robot_takes_one_run_and_the_loser_learns_whose_it_is() -> None:
    robot = Robot(engine())
    harness = Harness({"David": robot})
    outcomes = []
    async with harness.runner() as control:

        async def ask(name: str) -> None:
            try:
                outcomes.append(await control.start(order(sequence(name), engine="David"), ANN))
            except Conflict as conflict:
                outcomes.append(conflict)

        async with anyio.create_task_group() as tasks:
            for i in range(10):
                tasks.start_soon(ask, f"g{i}")
    assert len(robot.starts) == 1
    refused = [each for each in outcomes if isinstance(each, Conflict)]
    assert len(refused) == 9
    assert "taken by run 1" in refused[0].detail
    assert "Ann" in refused[0].detail


@virtual
async def test_simulated_runs_do_not_exclude_each_other() -> None:
    harness = Harness()
    async with harness.runner() as control:
        one = await control.start(order(sequence()), ANN)
        two = await control.start(order(sequence()), BEN)
        assert await ended(control, one.run.id) == await ended(control, two.run.id) == "finished"
        assert (one.run.number, two.run.number) == (1, 2)


@virtual
async def test_an_engine_that_does_not_answer_is_not_started() -> None:
    robot = Robot(engine())
    robot.silent = True
    harness = Harness({"David": robot})
    async with harness.runner() as control:
        with pytest.raises(Unavailable, match="does not answer"):
            await control.start(order(sequence(), engine="David"), ANN)
    assert robot.starts == []
    assert not any(stream.startswith("run/") for stream in harness.journal.streams)


@virtual
async def test_the_graph_on_the_wire_names_run_version_and_action() -> None:
    robot = Robot(engine())
    harness = Harness({"David": robot})
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), engine="David", version="v7"), ANN)).run
    sent = robot.starts[0].umrf
    assert f'"run": "{run.id}"' in sent
    assert '"version": "v7"' in sent
    assert '"aid": "aid000000001"' in sent
    assert robot.starts[0].targets == ("David",)


@virtual
async def test_a_robot_nobody_knows_and_one_without_a_link_are_refused() -> None:
    harness = Harness()
    async with harness.runner() as control:
        with pytest.raises(BadInput, match="No robot"):
            await control.start(order(sequence(), engine="Nobody"), ANN)


@virtual
async def test_a_start_that_the_engine_refuses_is_shown_as_refused() -> None:
    class Contested(Robot):
        async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
            """Start after a stranger's graph has started."""
            await self.engine.start(Order(run="theirs", graph=sequence("busy"), umrf=""))
            await super().start(order, leaves)

    harness = Harness({"David": Contested(engine())})
    async with harness.runner() as control:
        run = (await control.start(order(sequence("busy"), engine="David"), ANN)).run
        assert run.state == "refused"
        assert "already active" in run.detail


# --- pause ------------------------------------------------------------------------------------


@virtual
async def test_a_simulated_run_pauses_and_goes_on() -> None:
    harness = Harness()
    async with harness.runner() as control:
        run = (await control.start(order(sequence(actions=1)), ANN)).run
        await anyio.sleep(0.5)
        await control.pause(run.id, ANN)
        await anyio.sleep(20)
        assert control.open[run.id].run.state == "paused"
        await control.resume(run.id, ANN)
        assert await ended(control, run.id) == "finished"
    found = harness.journal.history(run.id)
    assert found.ended_at is not None
    assert found.started_at is not None
    assert (found.ended_at - found.started_at) / 1e6 > 20
    assert len(found.actions["Work_0"].visits) == 1


@virtual
async def test_pausing_is_refused_where_it_is_not_safe() -> None:
    harness = Harness({"David": Robot(engine())})
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await until(lambda: control.open[run.id].run.state == "running")
        with pytest.raises(Conflict, match="not safe"):
            await control.pause(run.id, ANN)


@virtual
async def test_an_engine_that_hangs_is_unknown_and_stop_says_why_it_is_unconfirmed() -> None:
    """H5: an action without onPause holds the engine's lock for ever."""
    harness = Harness()
    script = {"*": [{"pauses": False, "never": True}]}
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), script=script), ANN)).run
        await anyio.sleep(1)
        await control.pause(run.id, ANN)
        await anyio.sleep(5)
        assert control.open[run.id].run.state == "unknown"
        await control.stop(run.id, ANN)
        await anyio.sleep(5)
        alarms = {each.code: each.text for each in control.open[run.id].run.alarms}
        assert "hangs (H5)" in alarms["stop_unconfirmed"]
        assert await ended(control, run.id) == "lost"


# --- restarts ---------------------------------------------------------------------------------


@virtual
async def test_after_a_restart_a_simulated_run_is_lost_and_never_finished() -> None:
    harness = Harness()
    async with harness.runner() as control:
        run = (await control.start(order(sequence()), ANN)).run
        await anyio.sleep(1.5)
    async with harness.runner() as control:
        assert await ended(control, run.id) == "lost"
        found = await control.find(run.id)
    assert "Nothing shows how" in found.detail
    assert found.actions["Work_0"].state == "FINISHED"
    assert found.actions["Work_1"].visits[-1].until is None


@virtual
async def test_a_robot_that_goes_on_without_the_runner_is_taken_up_again() -> None:
    robot = Robot(engine())
    harness = Harness({"David": robot})
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(robot.engine.run)
        async with harness.runner() as control:
            run = (await control.start(order(sequence(actions=5), engine="David"), ANN)).run
            await anyio.sleep(1.5)
        await anyio.sleep(1)
        async with harness.runner() as control:
            assert control.open[run.id].run.state == "running"
            assert await ended(control, run.id) == "finished"
        tasks.cancel_scope.cancel()
    assert len(robot.starts) == 1


@virtual
async def test_a_pending_stop_goes_on_after_a_crash() -> None:
    robot = Robot(engine({"*": [{"never": True}]}))
    harness = Harness({"David": robot})
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await anyio.sleep(1.5)
        robot.loss = 1.0
        await control.stop(run.id, BEN)
        await anyio.sleep(1)
    robot.loss, robot.delivered = 0.0, 0
    async with harness.runner() as control:
        now = control.open[run.id].run
        assert (now.desired, now.stopped_by) == ("stopped", BEN)
        assert await ended(control, run.id) == "stopped"
    assert robot.delivered >= 1


@virtual
async def test_a_run_on_a_robot_without_a_link_stays_unknown_and_its_stop_unconfirmed() -> None:
    robot = Robot(engine({"*": [{"never": True}]}))
    harness = Harness({"David": robot})
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await anyio.sleep(1)
    harness.links = {}
    async with harness.runner() as control:
        await control.stop(run.id, ANN)
        await anyio.sleep(30)
        now = control.open[run.id].run
        assert (now.state, now.desired) == ("unknown", "stopped")
        assert "no link" in now.alarms[-1].text
        assert now.stops_sent == 0


@virtual
async def test_numbers_go_on_after_a_restart() -> None:
    harness = Harness()
    for number in (1, 2, 3):
        async with harness.runner() as control:
            run = (await control.start(order(sequence(actions=1)), ANN)).run
            assert run.number == number
            assert await ended(control, run.id) in ENDED
            assert Published in [type(each) for each in harness.journal.told(run.id)]


@virtual
async def test_a_simulated_run_that_is_paused_can_be_stopped() -> None:
    harness = Harness()
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), script={"*": [{"after_s": 20}]}), ANN)).run.id
        await anyio.sleep(1)
        await control.pause(run, ANN)
        await until(lambda: control.open[run].run.state == "paused")
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"
    assert harness.journal.history(run).alarms == ()


@virtual
async def test_the_simulator_pauses_only_as_safely_as_the_robot_that_it_plays() -> None:
    harness = Harness({"David": Robot(engine())})
    async with harness.runner() as control:
        asked = order(sequence(), like="David", script={"*": [{"after_s": 20}]})
        run = (await control.start(asked, ANN)).run.id
        await anyio.sleep(1)
        with pytest.raises(Conflict, match="not safe"):
            await control.pause(run, ANN)
        assert views.run_view(control.open[run].run).like == "David"
        control.stop_all(BEN)
        assert await ended(control, run) == "stopped"
