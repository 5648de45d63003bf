"""Simulated runs with behaviours, in a real runner: started, paused, stopped, and never in the way."""

import os
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import psutil
import pytest

from action_assistant.umrf.model import Graph
from runner.harness import order
from runner.links.behaviours.written import (
    DEAF,
    OK,
    WAITS,
    action,
    chain,
    parameter,
    processes,
    until,
    write,
)
from runner.process import RunnerProcess, body, over, started

pytestmark = pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="behaviours need Linux")

QUICK = {"*": [{"after_s": 0.02}]}


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunnerProcess]:
    """A runner that has a folder of them, for all tests."""
    place = tmp_path_factory.mktemp("runner")
    process = RunnerProcess(
        place / "data", "--behaviours", str(write(place / "behaviours"))
    ).start()
    yield process
    process.end()
    until(lambda: not processes())


@pytest.fixture
def folder(shared: RunnerProcess) -> Iterator[Path]:
    """Where the behaviours are: none yet."""
    found = shared.data.parent / "behaviours"
    yield found
    shutil.rmtree(found)
    found.mkdir()


@pytest.fixture
def runner(shared: RunnerProcess) -> Iterator[RunnerProcess]:
    """The runner; whatever a test leaves running is stopped."""
    yield shared
    with shared.client() as client:
        client.post("/api/stop")
    until(lambda: not processes())


@pytest.fixture
def client(runner: RunnerProcess) -> Iterator[httpx.Client]:
    with runner.client() as opened:
        yield opened


def start(client: httpx.Client, graph: Graph, **changes: Any) -> str:
    """A run with behaviours; its id."""
    run = started(client, order(graph, script=QUICK, behaviours=True, **changes))
    assert run["behaviours"] is True
    found: str = run["id"]
    return found


def shown(client: httpx.Client, run: str) -> dict[str, Any]:
    found: dict[str, Any] = client.get(f"/api/runs/{run}").json()
    return found


def moves(client: httpx.Client, run: str, node: str) -> None:
    """Wait until the process of an action is there."""
    until(lambda: shown(client, run)["actions"][node]["state"] == "RUNNING")


def result(run: dict[str, Any], node: str) -> str:
    (visit,) = run["actions"][node]["visits"]
    found: str = visit["result"]
    return found


def messages(run: dict[str, Any], node: str) -> str:
    return "\n".join(each["text"] for each in run["actions"][node]["messages"])


def test_what_a_behaviour_returns_is_the_result_of_its_action(
    client: httpx.Client, folder: Path
) -> None:
    write(
        folder,
        yes=OK,
        no="def run(action):\n    return False\n",
        nothing="def run(action):\n    action.message('done')\n",
        fails="def run(action):\n    raise RuntimeError('gripper jammed')\n",
    )
    done = over(client, start(client, chain("Yes", "No", "Nothing", "Fails", "Scripted")))
    assert done["state"] == "finished"
    ends = {name: result(done, f"{name}_0") for name in ("Yes", "No", "Nothing", "Fails")}
    assert ends == {"Yes": "true", "No": "false", "Nothing": "true", "Fails": "error"}
    assert messages(done, "Nothing_0") == "done"
    assert "RuntimeError: gripper jammed (fails.py, line 2)" in messages(done, "Fails_0")
    assert result(done, "Scripted_0") == "true"  # without a file, as the script says


def test_without_the_choice_the_script_says_what_is_done(
    client: httpx.Client, folder: Path
) -> None:
    write(folder, no="def run(action):\n    return False\n")
    run = started(client, order(chain("No"), script=QUICK))
    assert result(over(client, run["id"]), "No_0") == "true"


TYPES: dict[str, Any] = {
    "string": "grüß \N{SNOWMAN} \"'\n",
    "strings": ["a", "", "b"],
    "number": -1.5e300,
    "numbers": [0.0, 1.5, 3.0],
    "bool": True,
    "bools": [True, False],
}


def test_values_of_every_native_type_come_in_and_go_on_to_the_next_action(
    client: httpx.Client, folder: Path
) -> None:
    write(
        folder,
        gives="""
            def run(action):
                for name, value in action.inputs.items():
                    action.outputs[name.replace("in::", "out::")] = value
            """,
        takes="""
            import json
            def run(action):
                action.message(json.dumps(action.inputs, sort_keys=True))
            """,
    )
    first = action(
        "Gives",
        [parameter(f"in::{kind}", kind, value) for kind, value in TYPES.items()],
        [parameter(f"out::{kind}", kind) for kind in TYPES],
    )
    second = action("Takes", [parameter(f"out::{kind}", kind) for kind in TYPES])
    done = over(client, start(client, chain(first, second)), 15)
    assert done["state"] == "finished"
    told = httpx.Response(200, text=messages(done, "Takes_0")).json()
    assert told == {f"out::{kind}": value for kind, value in TYPES.items()}


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("action.outputs['count'] = 'three'", "is a number, not str"),
        ("action.outputs['count'] = True", "is a number, not bool"),
        ("action.outputs['other'] = 3", "no output “other”"),
        ("action.outputs['count'] = float('nan')", "not JSON compliant"),
        ("action.outputs['count'] = {1, 2}", "not JSON serializable"),
        ("return 'yes'", "returned str"),
        ("import sys; sys.exit(0)", "SystemExit"),
        ("import os; os._exit(0)", "ended with code 0 before it had a result"),
        ("import os; os.kill(os.getpid(), 11)", "SIGSEGV"),
        ("import os; os.write(1, b'x'); raise MemoryError", "it may have 512 MB"),
        ("hold = [bytearray(1 << 20) for _ in range(10**6)]", "it may have 512 MB"),
    ],
)
def test_what_a_behaviour_may_not_do_ends_its_action_with_an_error_that_says_so(
    client: httpx.Client, folder: Path, line: str, why: str
) -> None:
    write(folder, odd=f"def run(action):\n    {line}\n    action.sleep(3600)\n")
    node = action("Odd", outputs=[parameter("count", "number")])
    done = over(client, start(client, chain(node, "After")), 15)
    assert result(done, "Odd_0") == "error"
    assert why in messages(done, "Odd_0")


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


def test_one_that_never_ends_is_killed_five_seconds_after_its_stop_and_delays_no_other(
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


def test_one_that_floods_leaves_the_runner_and_other_runs_alone(
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


def test_whatever_it_has_started_is_killed_with_it(client: httpx.Client, folder: Path) -> None:
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
    keeper = until(lambda: [each for each in processes() if each.parent() not in processes()])[0]
    engine = keeper.parent()
    assert engine is not None
    engine.kill()
    until(lambda: not processes())
    assert over(client, run)["state"] == "lost"


def test_a_link_is_refused_with_the_reason_before_anything_is_started(
    client: httpx.Client, folder: Path, tmp_path: Path
) -> None:
    write(tmp_path / "elsewhere", secret=OK)
    (folder / "open_gripper.py").symlink_to(tmp_path / "elsewhere" / "secret.py")
    before = client.get("/api/runs").json()
    asked = order(chain("OpenGripper"), script=QUICK, behaviours=True)
    answer = client.post("/api/runs", content=body(asked))
    assert answer.status_code == 409
    assert answer.json()["detail"].startswith(
        "The behaviour open_gripper.py cannot be read: it is a link, and no link is followed."
    )
    assert answer.json()["where"] == {"path": "/behaviours"}
    assert client.get("/api/runs").json() == before


def test_the_behaviours_that_there_are_are_listed_with_what_cannot_be_run(
    client: httpx.Client, folder: Path
) -> None:
    write(folder, open_gripper=OK, Odd=OK, notes=OK)
    (folder / "notes.txt").write_text("no behaviour")
    (folder / "held.py").mkdir()
    listed = client.get("/api/reach").json()["behaviours"]
    assert listed["names"] == ["notes", "open_gripper"]
    assert listed["refused"] == {
        "held": "The behaviour held.py cannot be read: it is no regular file."
    }


def test_a_folder_that_has_gone_meanwhile_refuses_the_start(
    client: httpx.Client, folder: Path
) -> None:
    folder.rename(folder.with_name("away"))
    asked = order(chain("Waits"), script=QUICK, behaviours=True)
    answer = client.post("/api/runs", content=body(asked))
    folder.with_name("away").rename(folder)
    assert answer.status_code == 409
    assert "folder of behaviours cannot be read" in answer.json()["detail"]


def test_a_runner_without_a_folder_has_none_and_says_so(process: RunnerProcess) -> None:
    with process.client() as client:
        assert client.get("/api/reach").json()["behaviours"] is None
        asked = order(chain("Waits"), script=QUICK, behaviours=True)
        answer = client.post("/api/runs", content=body(asked))
        assert answer.status_code == 409
        assert "has no behaviours" in answer.json()["detail"]


def test_names_from_graphs_lead_to_no_other_file(
    client: httpx.Client, folder: Path, tmp_path: Path
) -> None:
    write(tmp_path, outside="raise SystemExit('was run')")
    write(folder, waits=WAITS)
    names = ["../outside", "..", str(tmp_path / "outside"), "waits.py", "waits\N{ZERO WIDTH SPACE}"]
    done = over(client, start(client, chain(*names)))
    assert done["state"] == "finished"
    assert {result(done, f"{name}_0") for name in names} == {"true"}  # by the script


def test_numbers_stay_numbers(client: httpx.Client, folder: Path) -> None:
    """What is whole in a file is a double to the engine."""
    write(
        folder,
        doubles="""
            def run(action):
                action.outputs["count"] = 3
                action.message(repr(action.inputs["count"]))
            """,
        shows="def run(action):\n    action.message(repr(action.inputs['count']))\n",
    )
    first = action("Doubles", [parameter("count", "number", 2)], [parameter("count", "number")])
    second = action("Shows", [parameter("count", "number")])
    done = over(client, start(client, chain(first, second)), 15)
    assert (messages(done, "Doubles_0"), messages(done, "Shows_0")) == ("2.0", "3.0")
