"""A sourced ROS 2 workspace is what the runner reaches robots with, however it is started.

The prefix is laid out as the distribution lays it out; on its PYTHONPATH there are also packages that
would do harm to ours. The runner's Python is the one of `.venv`, as people have it. `make workspace`
runs these tests where all of that lies at its own place, under Python 3.12, and with a wheel's program
(TEST_PREFIX, TEST_WORKSPACE, TEST_PROGRAMS).
"""

import importlib.machinery
import importlib.util
import os
import shlex
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import psutil
import pytest

from support.distribution import Distribution, lay_out
from support.product import TOKEN, free_ports

ROOT = Path(__file__).parents[2]
WHEELS = ROOT / ".venv-ros"
PLAIN = ROOT / ".venv" / "bin" / "action-assistant"
PROGRAMS = os.environ.get("TEST_PROGRAMS", str(PLAIN)).split(":")
UNIT = ROOT / "ros" / "action-assistant-runner.service"
LAID_OUT = os.environ.get("TEST_WORKSPACE", "")
#: The distribution's; there is none for a Python that somebody built.
NUMPY = Path("/usr/lib/python3/dist-packages/numpy")
FITS = f"core/_multiarray_umath{importlib.machinery.EXTENSION_SUFFIXES[0]}"
OF_THE_SYSTEM = any((NUMPY / f"{private}{FITS}").exists() for private in ("", "_"))

pytestmark = [
    # Its processes are those of `.venv` whoever runs it: once is enough.
    pytest.mark.skipif(
        not LAID_OUT and importlib.util.find_spec("rclpy") is None,
        reason="rclpy is not here; `make ros-test` brings it",
    ),
    pytest.mark.skipif(
        not (PLAIN.exists() and (LAID_OUT or (WHEELS / "share" / "ament_index").is_dir())),
        reason="needs .venv and .venv-ros: `make setup ros`",
    ),
]


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Distribution:
    """Lay out a workspace as on Ubuntu, where numpy is the system's; the prefix has numpy where
    the system has none."""
    if LAID_OUT:
        return Distribution(prefix=Path(os.environ["TEST_PREFIX"]), workspace=Path(LAID_OUT))
    folder = tmp_path_factory.mktemp("ubuntu")
    prefix, base = folder / "opt" / "ros" / "jazzy", folder / "workspace" / "install"
    return lay_out(WHEELS, prefix, base, numpy=not OF_THE_SYSTEM)


def bare(tmp_path: Path) -> dict[str, str]:
    """The environment of a fresh shell: nothing of the Python that runs this test."""
    kept = {name: os.environ[name] for name in os.environ if name.startswith(("PIP_", "LC_"))}
    return {
        **kept,
        "PATH": os.environ["PATH"].replace(f"{WHEELS}/bin{os.pathsep}", ""),
        "HOME": str(tmp_path),
        "LANG": os.environ.get("LANG", "C.UTF-8"),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ACTION_ASSISTANT_TOKEN": TOKEN,
    }


@contextmanager
def started(command: Sequence[str], environ: Mapping[str, str], log: Path) -> Iterator[int]:
    """A command in a session of its own, ended with all that it started; its process id."""
    with log.open("wb") as out:
        process = subprocess.Popen(
            command, env=environ, cwd=ROOT, stdout=out, stderr=out, start_new_session=True
        )
    try:
        yield process.pid
    except BaseException as error:
        error.add_note(log.read_text(errors="replace")[-4000:])
        raise
    finally:
        os.killpg(process.pid, signal.SIGTERM)
        process.wait(30)


@pytest.fixture
def david(workspace: Distribution, domain: int, tmp_path: Path) -> Iterator[dict[str, Any]]:
    """A robot on the workspace's own messages, and how it is registered."""
    command = [str(PLAIN), "simulate-robot", "David", "--domain", str(domain)]
    with started(command, workspace.sourced(bare(tmp_path)), tmp_path / "david.log") as pid:
        wait_for(lambda: b"is on domain" in (tmp_path / "david.log").read_bytes())
        assert uses(pid, workspace)
        yield {"name": "David", "domain": domain}


def wait_for(told: Callable[[], bool], seconds: float = 60) -> None:
    deadline = time.monotonic() + seconds
    while not told():
        assert time.monotonic() < deadline, "it never came to be"
        time.sleep(0.1)


def uses(pid: int, workspace: Distribution) -> bool:
    """Return whether a process has loaded the workspace's messages, and no others."""
    maps = Path(f"/proc/{pid}/maps").read_text()
    assert str(WHEELS) not in maps
    assert (str(NUMPY) if OF_THE_SYSTEM else f"{workspace.prefix}/lib/python") in maps
    return f"{workspace.workspace}/temoto_msgs/lib/libtemoto_msgs" in maps


def reached(port: int, robot: dict[str, Any]) -> None:
    """The runner on this port comes to reach a robot that is registered there."""
    head = {"authorization": f"Bearer {TOKEN}"}
    base = f"http://127.0.0.1:{port}"
    with httpx.Client(base_url=base, headers=head, trust_env=False, timeout=20) as runner:

        def ready() -> bool:
            try:
                return runner.get("/readyz").status_code == 200
            except httpx.TransportError:
                return False

        def answers() -> bool:
            (known,) = [
                each for each in runner.get("/api/robots").json() if each["name"] == "David"
            ]
            return bool(known["state"] == "answering")

        wait_for(ready)
        assert runner.get("/api/reach").json()["no_reach"] == ""
        runner.post("/api/robots", json=robot).raise_for_status()
        wait_for(answers)


def runner_of(pid: int) -> int:
    """The runner among what a command started; itself, if it is one."""
    family = [psutil.Process(pid), *psutil.Process(pid).children(recursive=True)]
    runners = [
        each.pid
        for each in family
        if "runner" in each.cmdline() and "action_assistant" in " ".join(each.cmdline())
    ]
    # Its fork server, a child of it, has its command line.
    return runners[0] if runners else pid


def test_make_run_in_a_sourced_shell_reaches_a_robot_with_the_workspaces_messages(
    workspace: Distribution, david: dict[str, Any], tmp_path: Path
) -> None:
    port = free_ports()
    run = f"make run ARGS='--no-open --data {tmp_path}/data --port {port}'"
    shell = ["bash", "-c", f". {workspace.setup} && exec {run}"]
    with started(shell, bare(tmp_path), tmp_path / "make.log") as pid:
        reached(port + 1, david)
        assert uses(runner_of(pid), workspace)


@pytest.mark.parametrize("program", PROGRAMS)
def test_serve_in_a_sourced_shell_takes_nothing_else_of_its_packages(
    program: str, workspace: Distribution, david: dict[str, Any], tmp_path: Path
) -> None:
    port = free_ports()
    serve = [program, "serve", "--no-open", "--data", f"{tmp_path}/data", "--port", str(port)]
    environ = workspace.sourced(bare(tmp_path))
    harmful = Path(environ["PYTHONPATH"].split(":")[-1]) / "litestar.py"
    assert harmful.exists(), "there to do harm"
    with started(serve, environ, tmp_path / "serve.log") as pid:
        reached(port + 1, david)
        assert uses(runner_of(pid), workspace)


def test_the_service_reaches_a_robot_from_an_environment_in_which_nothing_is_sourced(
    workspace: Distribution, david: dict[str, Any], tmp_path: Path
) -> None:
    port = free_ports()
    (line,) = [
        each.removeprefix("ExecStart=")
        for each in UNIT.read_text().splitlines()
        if each.startswith("ExecStart=")
    ]
    environ = {
        **bare(tmp_path),
        "WORKSPACE": str(workspace.workspace),
        "PROGRAM": PROGRAMS[-1],
        "STATE_DIRECTORY": str(tmp_path / "data"),
        "ARGUMENTS": f"--port {port + 1} --page-port {port}",
    }
    with started(shlex.split(line), environ, tmp_path / "unit.log") as pid:
        reached(port + 1, david)
        assert uses(pid, workspace)
    assert "--ros-args" not in line


def test_doctor_in_a_sourced_shell_says_whose_rclpy_and_messages_there_are(
    workspace: Distribution, domain: int, tmp_path: Path
) -> None:
    told = subprocess.run(
        [PLAIN, "doctor", "--only", "ros", "--data", tmp_path],
        env={**workspace.sourced(bare(tmp_path)), "ROS_DOMAIN_ID": str(domain)},
        capture_output=True,
        text=True,
        check=False,
        timeout=110,
    )
    assert "ROS 2 jazzy is sourced." in told.stdout
    assert (
        f"rclpy of {workspace.prefix} speaks rmw_fastrtps_cpp, with the temoto_msgs of "
        f"{workspace.workspace}/temoto_msgs." in told.stdout
    )


def test_the_package_for_workspaces_builds_and_runs_the_program_of_its_checkout(
    tmp_path: Path,
) -> None:
    package = ROOT / "ros" / "temoto_action_assistant"
    subprocess.run([ROOT / "scripts" / "build-messages", WHEELS, package, tmp_path], check=True)
    program = tmp_path / "lib" / package.name / "action-assistant"
    told = subprocess.run(
        [program, "--version"],
        env={"PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert told.stdout.startswith("action-assistant ")
    assert (tmp_path / "share" / package.name / "launch" / "runner.launch.py").is_file()
    assert (tmp_path / "share/ament_index/resource_index/packages" / package.name).is_file()
