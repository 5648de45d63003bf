"""`simulate --behaviours`: a graph on the command line, its actions in Python, in real time."""

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from action_assistant.umrf.files import codec
from runner.links.behaviours.written import DEAF, WAITS, chain, processes, write
from support.product import COMMAND


def simulated(
    folder: Path, behaviours: Path, *names: str, more: tuple[str, ...] = ()
) -> subprocess.CompletedProcess[str]:
    """A chain of these actions, as somebody tries it."""
    file = folder / "graph.json"
    file.write_text(codec.write(chain(*names)))
    (folder / "script.json").write_text('{"behaviours": {"*": [{"after_s": 0.02}]}}')
    return subprocess.run(
        [
            *(*COMMAND, "simulate", str(file), "--script", str(folder / "script.json")),
            *("--behaviours", str(behaviours), *more),
        ],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )


def test_actions_do_what_their_behaviours_do_and_say_it(tmp_path: Path) -> None:
    behaviours = write(
        tmp_path / "behaviours",
        greets="def run(action):\n    action.message('good\\nmorning')\n    return False\n",
    )
    done = simulated(tmp_path, behaviours, "Greets", "Scripted")
    assert done.returncode == 0, done.stderr
    assert "Greets_0 says: good\\nmorning" in done.stdout
    assert "chain ends with on_true" in done.stdout


@pytest.mark.parametrize(
    ("source", "state"), [(WAITS, "STOPPED"), (DEAF, "ERROR")], ids=["obeys", "never ends"]
)
def test_a_command_at_a_time_reaches_it_and_nothing_is_left(
    tmp_path: Path, source: str, state: str
) -> None:
    behaviours = write(tmp_path / "behaviours", acts=source)
    done = simulated(tmp_path, behaviours, "Acts", more=("--at", "800:stop", "--trace"))
    assert done.returncode == 0, done.stderr
    events: list[dict[str, Any]] = [json.loads(line) for line in done.stdout.splitlines()]
    states = [each["state"] for each in events if each["kind"] == "graph_state"]
    assert states[-2:] == ["STOPPING", state]
    stopped = [each["t_ms"] for each in events if each.get("state") == "STOPPING"]
    assert min(stopped) >= 800
    assert not processes()


def test_simulate_ends_when_its_time_is_over_and_kills_running_calls(tmp_path: Path) -> None:
    behaviours = write(tmp_path / "behaviours", acts=DEAF)
    done = simulated(tmp_path, behaviours, "Acts", more=("--for", "0.5", "--trace"))
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout.splitlines()[-1])["state"] == "RUNNING"
    assert not processes()


@pytest.mark.parametrize("command", ["simulate", "runner", "serve"])
def test_a_folder_that_is_not_there_is_said_at_once(tmp_path: Path, command: str) -> None:
    missing = tmp_path / "nowhere"
    if command == "simulate":
        done = simulated(tmp_path, missing, "Acts")
    else:
        done = subprocess.run(
            [*COMMAND, command, "--data", str(tmp_path / "data"), "--behaviours", str(missing)],
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )
    assert done.returncode == 2
    assert f"There is no folder of behaviours {missing}: No such file or directory." in done.stderr
    assert "Traceback" not in done.stderr
