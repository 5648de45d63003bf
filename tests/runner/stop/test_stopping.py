"""Stops until it is proven, and never says so before. In virtual time."""

import itertools

import anyio
import msgspec
import pytest

from action_assistant.errors import NotFound
from action_assistant.runner.runs.events import Proof, StopSent
from action_assistant.umrf.model import Conditions
from runner.harness import (
    ANN,
    BEN,
    Harness,
    Robot,
    ended,
    engine,
    order,
    sequence,
    two_ends,
    until,
    virtual,
)


@virtual
async def test_stop_is_proven_by_a_get_that_was_asked_after_it() -> None:
    harness = Harness()
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), script={"*": [{"never": True}]}), ANN)).run
        await anyio.sleep(1)
        assert await control.stop(run.id, BEN, "s1") == [run.id]
        assert await ended(control, run.id) == "stopped"
    found = harness.journal.history(run.id)
    assert (found.stopped_by, found.desired, found.result) == (BEN, "stopped", "on_stopped")
    kinds = [type(each) for each in harness.journal.told(run.id)]
    assert kinds.index(StopSent) < kinds.index(Proof)
    assert found.proof_at is not None
    assert found.actions["Work_0"].visits[-1].result == "stopped"


@virtual
async def test_stop_does_not_wait_for_the_journal() -> None:
    robot = Robot(engine({"*": [{"never": True}]}))
    harness = Harness({"David": robot})
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await anyio.sleep(1)
        harness.journal.down = True
        began = anyio.current_time()
        await control.stop(run.id, ANN)
        await until(lambda: bool(robot.stops))
        assert robot.stops[0][0] - began < 0.02
        await until(lambda: control.open[run.id].run.state == "stopped")
        assert not control.open[run.id].recorder.recorded
        harness.journal.down = False
        assert await ended(control, run.id) == "stopped"
    assert harness.journal.history(run.id).state == "stopped"


@virtual
async def test_stop_is_repeated_until_one_arrives() -> None:
    robot = Robot(engine({"*": [{"never": True}]}))
    harness = Harness({"David": robot})
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await anyio.sleep(1)
        robot.loss = 0.8
        await control.stop(run.id, ANN)
        assert await ended(control, run.id) == "stopped"
    assert robot.delivered >= 1
    times = [when for when, _ in robot.stops]
    assert all(b - a >= 0.05 for a, b in itertools.pairwise(times))


@virtual
async def test_a_stop_without_proof_is_loud_and_goes_on() -> None:
    robot = Robot(engine({"*": [{"never": True}]}))
    harness = Harness({"David": robot})
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await anyio.sleep(1)
        robot.silent = True
        await control.stop(run.id, ANN)
        await anyio.sleep(60)
        now = control.open[run.id].run
        assert (now.state, now.desired, now.proof_at) == ("unknown", "stopped", None)
        assert any(each.code == "stop_unconfirmed" for each in now.alarms)
        sent = len(robot.stops)
        await anyio.sleep(5)
        assert len(robot.stops) > sent
        robot.silent = False
        assert await ended(control, run.id) == "stopped"


@virtual
async def test_an_engine_that_holds_a_new_life_proves_nothing() -> None:
    robot = Robot(engine({"*": [{"never": True}]}))
    harness = Harness({"David": robot})
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await anyio.sleep(1)
        robot.engine = engine()
        await control.stop(run.id, ANN)
        await until(lambda: control.open[run.id].run.state == "lost")
        assert control.open[run.id].run.proof_at is None
        codes = {each.code for each in control.open[run.id].run.alarms}
        assert {"engine_restarted", "stop_unconfirmed"} <= codes


@virtual
async def test_a_start_that_got_lost_is_unknown_is_not_repeated_and_is_given_up_after_a_stop() -> (
    None
):
    robot = Robot(engine())
    robot.start_loss = 1.0
    harness = Harness({"David": robot})
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await anyio.sleep(120)
        assert control.open[run.id].run.state == "unknown"
        await control.stop(run.id, ANN)
        await until(lambda: control.open[run.id].run.state == "lost")
    assert len(robot.starts) == 1
    assert harness.journal.history(run.id).proof_at is None


@virtual
async def test_stopping_everything_catches_a_start_that_is_being_stored() -> None:
    robot = Robot(engine())
    harness = Harness({"David": robot})
    harness.journal.slow = 1.0
    async with harness.runner() as control, anyio.create_task_group() as tasks:
        answers = []

        async def ask() -> None:
            answers.append(await control.start(order(sequence(), engine="David"), ANN))

        tasks.start_soon(ask)
        await anyio.sleep(0.5)
        assert control.stop_all(BEN).runs == []
        await until(lambda: bool(answers))
        assert robot.starts == []
        assert answers[0].run.state == "stopped"
        assert answers[0].run.stopped_by == BEN


@virtual
async def test_one_press_that_comes_by_two_ways_is_recorded_once() -> None:
    harness = Harness()
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), script={"*": [{"never": True}]}), ANN)).run
        await anyio.sleep(1)
        await control.stop(run.id, BEN, "press")
        await control.stop(run.id, BEN, "")
        await control.stop(run.id, BEN, "press")
        await ended(control, run.id)
    kinds = [each.kind for each in harness.journal.told(run.id)]
    assert kinds.count("run.stop_requested.v1") == 1


@virtual
async def test_stop_of_a_run_that_is_over_does_nothing_and_of_no_run_is_an_error() -> None:
    harness = Harness()
    async with harness.runner() as control:
        run = (await control.start(order(sequence(actions=1)), ANN)).run
        await ended(control, run.id)
        assert await control.stop(run.id, ANN) == []
        with pytest.raises(NotFound):
            await control.stop("nothing", ANN)
    assert harness.journal.history(run.id).state == "finished"


@virtual
async def test_an_action_that_ignores_stop_ends_in_error_not_in_stopped() -> None:
    harness = Harness()
    async with harness.runner() as control:
        stubborn = {"*": [{"after_s": 100, "ignores_stop": True}]}
        run = (await control.start(order(sequence(), script=stubborn), ANN)).run
        await anyio.sleep(1)
        await control.stop(run.id, ANN)
        state = await ended(control, run.id)
    found = harness.journal.history(run.id)
    assert state == "error"
    assert any(each.code == "stop_unconfirmed" for each in found.alarms)


@virtual
async def test_a_robot_that_does_not_obey_any_more_is_never_called_stopped() -> None:
    """H12: the graph has finished, an action still runs, and the engine ignores every stop."""
    robot = Robot(engine({"Work_0": [{"after_s": 1}], "*": [{"never": True}]}))
    harness = Harness({"David": robot})
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(robot.engine.run)
        async with harness.runner() as control:
            run = (await control.start(order(two_ends(), engine="David"), ANN)).run
            await anyio.sleep(5)
            assert control.open[run.id].run.state == "running"
            await control.stop(run.id, ANN)
            await anyio.sleep(60)
            now = control.open[run.id].run
            assert (now.state, now.proof_at) == ("stopping", None)
            assert "ignores Stop, while Work_1 goes on" in now.alarms[-1].text
        tasks.cancel_scope.cancel()


@virtual
async def test_a_simulated_engine_that_does_not_obey_is_switched_off_and_its_run_lost() -> None:
    harness = Harness()
    script = {"Work_0": [{"after_s": 1}], "*": [{"never": True}]}
    async with harness.runner() as control:
        run = (await control.start(order(two_ends(), script=script), ANN)).run
        await anyio.sleep(5)
        await control.stop(run.id, ANN)
        assert await ended(control, run.id) == "lost"
    assert "switched off" in harness.journal.history(run.id).detail


@virtual
async def test_a_graph_that_can_go_nowhere_says_so_and_can_be_stopped() -> None:
    """H8: the only arrow leads nowhere, so the graph stays RUNNING with nothing running."""
    graph = sequence(actions=2)
    stuck = tuple(
        msgspec.structs.replace(each, conditions=Conditions(on_true="stop"))
        if each.parent == graph.actions[0].key
        else each
        for each in graph.relations
    )
    harness = Harness()
    async with harness.runner() as control:
        asked = order(msgspec.structs.replace(graph, relations=stuck))
        run = (await control.start(asked, ANN)).run
        await anyio.sleep(10)
        assert control.open[run.id].run.state == "running"
        assert [each.code for each in control.open[run.id].run.alarms] == ["H8"]
        await control.stop(run.id, ANN)
        assert await ended(control, run.id) == "stopped"
