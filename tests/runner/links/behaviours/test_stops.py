"""Runs with behaviours that are paused, stopped and ended: nothing is left, and nobody waits for it."""

import os
import time
from functools import partial
from pathlib import Path

import anyio
import httpx
import psutil
import pytest

from action_assistant.runner.links.behaviours.folder import BehaviourFolder
from action_assistant.runner.links.behaviours.performer import MOST, BehaviourPerformer
from action_assistant.runner.links.port import NoAnswer
from action_assistant.runner.links.simulator import SimulatorLink, engine_of
from action_assistant.umrf.facts import SIMULATED
from runner.links.behaviours.driven import messages, moves, result, shown, start
from runner.links.behaviours.written import (
    DEAF,
    WAITS,
    chain,
    processes,
    side_by_side,
    until,
    write,
)
from runner.links.contract import placed
from runner.process import RunnerProcess, over

pytestmark = pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="behaviours need Linux")


def test_a_stop_reaches_a_behaviour_which_then_ends_the_run(
    client: httpx.Client, folder: Path
) -> None:
    write(folder, waits=WAITS)
    run = start(client, chain("Waits", "Waits2"))
    moves(client, run, "Waits_0")
    client.post(f"/api/runs/{run}/stop")
    done = over(client, run)
    assert (done["state"], result(done, "Waits_0")) == ("stopped", "stopped")
    assert done["proof_at"] is not None


def test_a_paused_behaviour_holds_and_goes_on_when_it_may(
    client: httpx.Client, folder: Path, tmp_path: Path
) -> None:
    log = tmp_path / "log"
    write(
        folder,
        counts=f"""
            def run(action):
                for _ in range(20):
                    if not action.sleep(0.05):
                        return False
                    with open({str(log)!r}, "a") as out:
                        out.write("x")
            """,
    )
    run = start(client, chain("Counts"))
    until(lambda: log.exists() and log.stat().st_size >= 2)
    client.post(f"/api/runs/{run}/pause")
    until(lambda: shown(client, run)["state"] == "paused")
    time.sleep(0.2)  # what was being slept through is over
    held = log.stat().st_size
    time.sleep(1)
    assert log.stat().st_size == held < 20
    client.post(f"/api/runs/{run}/resume")
    assert over(client, run)["state"] == "finished"
    assert log.stat().st_size == 20


def test_a_behaviour_that_never_ends_is_killed_five_seconds_after_its_stop_and_delays_no_other(
    client: httpx.Client, folder: Path
) -> None:
    write(folder, deaf=DEAF, waits=WAITS)
    hangs = start(client, chain("Deaf", name="hangs"))
    other = start(client, chain("Waits", name="other"))
    moves(client, hangs, "Deaf_0")
    moves(client, other, "Waits_0")
    client.post(f"/api/runs/{hangs}/stop")
    client.post(f"/api/runs/{other}/stop")
    done = over(client, other)
    assert done["state"] == "stopped"
    assert not any(each["code"] == "stop_unconfirmed" for each in done["alarms"])  # within 2 s
    assert shown(client, hangs)["ended_at"] is None
    assert processes()
    done = over(client, hangs)
    assert (done["state"], result(done, "Deaf_0")) == ("error", "error")
    assert "5 s after a stop" in messages(done, "Deaf_0")
    until(lambda: not processes())


@pytest.mark.long
def test_a_behaviour_that_floods_leaves_the_runner_and_other_runs_alone(
    client: httpx.Client, folder: Path
) -> None:
    flood = "while True:\n        print('x' * 999)\n        action.message('y' * 999)\n"
    write(folder, flood=f"def run(action):\n    {flood}", waits=WAITS)
    noisy = [start(client, chain("Flood", name=f"noisy{i}")) for i in range(2)]
    other = start(client, chain("Waits", name="other"))
    for run in noisy:
        moves(client, run, "Flood_0")
    moves(client, other, "Waits_0")
    client.post(f"/api/runs/{other}/stop")
    done = over(client, other)
    assert done["state"] == "stopped"
    assert not any(each["code"] == "stop_unconfirmed" for each in done["alarms"])
    client.post("/api/stop")
    for run in noisy:
        done = over(client, run)
        said = messages(done, "Flood_0")
        assert "more messages" in said
        assert "more printed lines" in said
        assert len(said) < 100_000


def test_processes_that_a_behaviour_started_are_killed_with_it(
    client: httpx.Client, folder: Path
) -> None:
    write(
        folder,
        parent="""
            import os, subprocess, sys
            def run(action):
                there = [subprocess.Popen([sys.executable, "-c", "import time; time.sleep(3600)"],
                                          start_new_session=own).pid for own in (False, True)]
                if not (child := os.fork()):
                    os.setsid()
                    if not os.fork():
                        action.sleep(3600)
                    os._exit(0)
                os.waitpid(child, 0)
                action.message(" ".join(map(str, there)))
            """,
    )
    done = over(client, start(client, chain("Parent")))
    assert done["state"] == "finished"
    pids = [int(each) for each in messages(done, "Parent_0").split()]
    assert len(pids) == 2
    assert not any(psutil.pid_exists(each) for each in pids)
    assert not processes()


def test_the_end_of_the_runner_by_force_leaves_no_process_behind(
    tmp_path: Path, folder: Path
) -> None:
    write(folder, deaf=DEAF)
    runner = RunnerProcess(tmp_path / "data", "--behaviours", str(folder)).start()
    try:
        with runner.client() as client:
            moves(client, start(client, chain("Deaf")), "Deaf_0")
            until(lambda: len(processes()) == 2)
    finally:
        runner.kill()
    until(lambda: not processes())


def test_the_end_of_the_engines_process_ends_its_behaviours(
    client: httpx.Client, runner: RunnerProcess, folder: Path
) -> None:
    write(folder, deaf=DEAF)
    run = start(client, chain("Deaf"))
    moves(client, run, "Deaf_0")
    supervisor = until(lambda: [each for each in processes() if each.parent() not in processes()])[
        0
    ]
    engine = supervisor.parent()
    assert engine is not None
    engine.kill()
    until(lambda: not processes())
    assert over(client, run)["state"] == "lost"


@pytest.mark.long
def test_the_largest_number_of_behaviours_runs_at_once_and_obeys_one_stop(
    client: httpx.Client, folder: Path
) -> None:
    write(folder, waits=WAITS)
    run = start(client, side_by_side(MOST, "Waits"))
    until(lambda: len(processes()) == 2 * MOST)
    client.post(f"/api/runs/{run}/stop")
    done = over(client, run)
    assert done["state"] == "stopped"
    assert {result(done, f"Waits_{i}") for i in range(MOST)} == {"stopped"}


async def _answer_while(folder: Path, *, kills: bool) -> None:
    performer = BehaviourPerformer(BehaviourFolder.opened(folder))
    link = SimulatorLink(engine_of(SIMULATED, "", performer), clock_us=int, performer=performer)
    await link.start(placed(chain("Deaf"), "r1"))
    try:
        if kills:
            performer.give_up(1)
        await link.get()
    finally:
        await link.aclose()


def test_while_one_is_being_killed_the_engine_says_nothing_that_could_prove_rest(
    folder: Path,
) -> None:
    write(folder, deaf=DEAF)
    anyio.run(partial(_answer_while, folder, kills=False))
    with pytest.raises(NoAnswer, match="is being killed"):
        anyio.run(partial(_answer_while, folder, kills=True))
    assert not processes()
