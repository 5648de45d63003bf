"""A Stop arrives although messages get lost and overwrite each other; of many starts at once exactly
one leaves; and what is shown is true when the engine is silent, killed, restarted, late, not alone,
or of another generation. The real runner and stand-in robots, in virtual time.

`TEST_STOPS` and `TEST_RACES` are how many (default 20 each); with `-s` the figures are printed.
"""

import os
import statistics
import sys
from contextlib import suppress

import anyio
import pytest

from action_assistant.errors import Refused
from action_assistant.runner.emulator.messages import EngineTraits, Message, Start, Stop
from action_assistant.runner.execution.interventions import confirm_rest
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.runs.events import Override
from action_assistant.umrf.files import codec
from runner.fake_network import now, now_ms
from runner.harness import ANN, BEN, run_in_virtual_time, until, virtual
from runner.robots_in_network import LOOKED, OTHER, PATROL, RobotsInNetwork, asked, shown

STOPS = int(os.environ.get("TEST_STOPS", "20"))
RACES = int(os.environ.get("TEST_RACES", "20"))
KNOWINGLY = Override(codes=("others", "quiet"), reason="it is a test")


# --- stop -------------------------------------------------------------------------------------------


async def stopped(seed: int) -> tuple[float, float]:
    """One stop through 30 % loss and commands of others that overwrite it: seconds until the engine
    took it up, and until it was proven."""
    scene = RobotsInNetwork(seed)
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: control.open[run].run.state == "running")
        scene.network.loss = {"stop": 0.3, "get": 0.3}
        deaf = scene.chance.random() < 0.3
        if deaf:  # somebody stops a graph that does not obey: five seconds of silence
            other = Start(graph_name="other", targets=("David",), graph_json=codec.write(OTHER))
            scene.network.carry(other, "terminal")
            await anyio.sleep(0.3)
            scene.nodes["David"].robot.hear(Stop(graph_name="other", targets=("David",)), now_ms())
        _talk_over(scene)
        await anyio.sleep(scene.chance.random() * 0.2)
        clicked = now()
        await control.stop(run, BEN)
        await until(lambda: run not in control.open or bool(control.open[run].run.loading))
        proven = now() - clicked
        if run in control.open:  # the feedback that would have told got lost
            assert "may still be loading" in control.open[run].run.loading
            confirm_rest(control.open[run], LOOKED, BEN)
        else:
            ended = await control.find(run)
            assert ended.state == "stopped", (seed, ended.state, ended.detail)
        assert "patrol" not in scene.nodes["David"].robot.moving
        taken = next(
            at for at, text in scene.lines if text.startswith("Stopping UMRF graph 'patrol'")
        )
        return taken - clicked, proven


def _talk_over(scene: RobotsInNetwork) -> None:
    """Stop another graph on the same robot as a stranger, often at the moment of our Stop."""
    carry = scene.network.carry

    def both(message: Message, stranger: str = "") -> None:
        carry(message, stranger)
        if not stranger and isinstance(message, Stop) and scene.chance.random() < 0.5:
            carry(Stop(graph_name="nothing", targets=("David",)), "terminal")

    scene.network.carry = both  # type: ignore[method-assign]


@pytest.mark.timeout(0 if STOPS > 200 else 120)
def test_no_stop_stays_undelivered_whatever_gets_lost_or_overwritten() -> None:
    told: list[tuple[float, float]] = []
    for seed in range(STOPS):

        async def main(seed: int = seed) -> None:
            told.append(await stopped(seed))

        run_in_virtual_time(main)
    assert len(told) == STOPS
    for what, times in (("taken up", [a for a, _ in told]), ("proven", [b for _, b in told])):
        times.sort()
        p99 = times[min(len(times) - 1, len(times) * 99 // 100)]
        sys.stdout.write(
            f"\nstop {what}: n={STOPS} p50={statistics.median(times):.2f} s p99={p99:.2f} s "
            f"max={times[-1]:.2f} s (virtual)\n"
        )


# --- start ------------------------------------------------------------------------------------------


async def raced(seed: int) -> None:
    """Up to twenty people start at once, some of them twice."""
    scene = RobotsInNetwork(seed)
    fresh: list[str] = []
    async with scene.played() as control:

        async def operator() -> None:
            request = asked(override=KNOWINGLY)
            await anyio.sleep(scene.chance.random() * scene.chance.choice([0, 0.001, 0.05]))
            for _ in range(scene.chance.choice([1, 1, 2])):
                with suppress(Refused):
                    started = await control.start(request, ANN)
                    fresh.extend([started.run.id] if started.fresh else [])

        async with anyio.create_task_group() as people:
            for _ in range(scene.chance.randint(2, 20)):
                people.start_soon(operator)
        assert len(fresh) == 1
        assert len(scene.starts()) == 1
        await until(lambda: control.open[fresh[0]].run.state == "running")


@pytest.mark.timeout(0 if RACES > 200 else 120)
def test_exactly_one_of_many_starts_at_once_leaves() -> None:
    for seed in range(RACES):

        async def main(seed: int = seed) -> None:
            await raced(seed)

        run_in_virtual_time(main)


@virtual
async def test_a_silent_engine_is_shown_as_unknown_and_as_running_when_it_speaks_again() -> None:
    scene = RobotsInNetwork(1)
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).state == "running")
        scene.nodes["David"].robot.freeze(now_ms())
        await until(lambda: shown(control, run).state == "unknown")
        assert shown(control, run).unknown_since is not None
        assert len(scene.starts()) == 1
        scene.nodes["David"].robot.thaw(now_ms())
        scene.network.stir(scene.nodes["David"])
        await until(lambda: shown(control, run).state == "running")
        assert shown(control, run).unknown_since is None


@virtual
async def test_a_killed_engine_is_shown_as_unknown_and_its_stop_as_unconfirmed() -> None:
    scene = RobotsInNetwork(2)
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).state == "running")
        scene.network.kill(scene.nodes["David"])
        await until(lambda: shown(control, run).state == "unknown")
        await control.stop(run, BEN)
        await anyio.sleep(30)
        told = shown(control, run)
        assert (told.state, told.desired) == ("unknown", "stopped")
        assert any(each.code == "stop_unconfirmed" for each in control.open[run].run.alarms)


@virtual
async def test_an_action_that_begins_after_the_stop_keeps_the_run_from_being_called_stopped() -> (
    None
):
    scene = RobotsInNetwork(7, quirks=EngineTraits(loading_ms=700.0))
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await anyio.sleep(0.3)
        await control.stop(run, BEN)
        await until(lambda: scene.nodes["David"].robot.moving == ("patrol",))
        await anyio.sleep(10)  # in a graph that is STOPPED the engine ignores every further stop
        assert shown(control, run).state == "stopping"
        assert any("Work_0" in each.text for each in control.open[run].run.alarms)


@virtual
async def test_a_run_of_a_restarted_engine_is_lost_and_asks_to_look_at_the_robot() -> None:
    scene = RobotsInNetwork(3)
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).state == "running")
        scene.network.kill(scene.nodes["David"])
        await anyio.sleep(1)
        scene.robot("David")
        await until(lambda: shown(control, run).state == "lost")
        told = await control.find(run)
        assert told.end is None  # its code may go on, wherever the process is
        assert "look at the robot" in " ".join(each.text for each in told.alarms)
        assert len(scene.starts()) == 1


@virtual
async def test_a_start_that_comes_a_minute_late_is_unknown_until_then_and_is_not_sent_again() -> (
    None
):
    scene = RobotsInNetwork(4)
    async with scene.played() as control:
        scene.network.late_s = 60.0
        run = (await control.start(asked(), ANN)).run.id
        assert shown(control, run).state == "published"
        await until(lambda: shown(control, run).state == "unknown")
        await anyio.sleep(50)
        assert shown(control, run).state == "unknown"
        await until(lambda: shown(control, run).state == "running")
        assert len(scene.starts()) == 1


@virtual
async def test_only_the_addressed_one_of_two_robots_with_one_graph_name_stops() -> None:
    scene = RobotsInNetwork(5, "David", "Carol")
    async with scene.played() as control:
        david = (await control.start(asked("David"), ANN)).run.id
        carol = (await control.start(asked("Carol"), ANN)).run.id
        for run in (david, carol):
            await until(lambda run=run: shown(control, run).state == "running")
        await control.stop(david, BEN)
        await until(lambda: david not in control.open)
        assert (await control.find(david)).state == "stopped"
        assert shown(control, carol).state == "running"
        assert scene.nodes["Carol"].robot.moving == ("patrol",)
        assert scene.nodes["David"].robot.moving == ()


@virtual
async def test_an_engine_of_another_generation_is_refused_in_a_sentence_and_sent_nothing() -> None:
    scene = RobotsInNetwork(6)
    scene.nodes["David"].type_hash = "RIHS01_older"
    async with scene.played() as control:
        with pytest.raises(Refused) as refused:
            await control.start(asked(), ANN)
        assert "older generation" in refused.value.detail
        assert scene.network.sent == []
        assert control.open == {}


async def replayed_after(wait_s: float) -> list[float]:
    """Replay our start after our Stop, with answers up to half a second late, and return the
    moments of false confirmations."""
    scene = RobotsInNetwork(8)
    false: list[float] = []
    async with scene.played() as control:
        robot = scene.nodes["David"].robot

        def judge(opened: OpenRun) -> None:
            if opened.run.state == "stopped" and robot.moving:
                false.append(now())

        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).state == "running")
        scene.network.old_s = 0.5
        control.watch(judge)
        await control.stop(run, BEN)
        await anyio.sleep(wait_s)
        scene.network.carry(scene.starts()[0], "bag")
        await until(lambda: run not in control.open or bool(control.open[run].run.loading))
        if run in control.open:  # what a stranger has set going nobody can tell by the arrows
            assert not robot.moving
            confirm_rest(control.open[run], LOOKED, BEN)
    return false


@virtual
async def test_an_answer_from_before_a_start_of_somebody_else_proves_nothing() -> None:
    found = [await replayed_after(hundredths / 100) for hundredths in range(60, 240, 6)]
    assert [each for each in found if each] == []


async def begun_anew_after(wait_s: float) -> bool:
    """We stop a graph of somebody else, who starts it anew so long after, while answers are on their
    way for up to half a second. Whether it was called stopped although it moves."""
    scene = RobotsInNetwork(8)
    async with scene.played() as control:
        robot = scene.nodes["David"].robot
        theirs = Start(graph_name="patrol", targets=("David",), graph_json=codec.write(PATROL))
        scene.network.carry(theirs, "terminal")
        await until(lambda: "patrol" in robot.moving)
        await until(lambda: control.foreign_stops.stop(BEN, lambda _: ()) != [])
        scene.network.old_s = 0.5
        again = now() + wait_s
        while control.foreign_stops.is_stopping("David"):
            if now() >= again:
                scene.network.carry(theirs, "terminal")
                again = float("inf")
            await anyio.sleep(0.01)
        return "patrol" in robot.moving


@virtual
async def test_nor_does_it_when_the_stopped_graph_was_not_ours() -> None:
    found = [await begun_anew_after(hundredths / 100) for hundredths in range(40, 240, 6)]
    assert not any(found)
