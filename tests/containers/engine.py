"""podman with what it needs in a folder of its own: nothing of it is left on the machine."""

import json
import os
import subprocess
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import IO, Any, Final

ROOT: Final = Path(__file__).parents[2]
#: Images, containers and volumes; some gigabytes.
FOLDER: Final = Path(
    os.environ.get("CONTAINERS_FOLDER", "/var/tmp/action-assistant-containers")
).resolve()
#: The folder of podman-compose from PyPI.
BIN: Final = ROOT / "build" / "containers" / "bin"
#: A configuration that also runs without systemd and with the first control groups.
_CONFIGURATION: Final = """
[engine]
runtime = "runc"
cgroup_manager = "cgroupfs"
events_logger = "file"
[containers]
default_ulimits = ["nofile=4096:4096", "nproc=4096:4096"]
[network]
network_config_dir = "{folder}/networks"
"""
_STORAGE: Final = """
[storage]
driver = "overlay"
graphroot = "{folder}/storage"
runroot = "{folder}/run"
"""


@cache
def _configured() -> tuple[Path, Path]:
    """Written once: several podmans may read them at any moment."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    configuration, storage = FOLDER / "containers.conf", FOLDER / "storage.conf"
    configuration.write_text(_CONFIGURATION.format(folder=FOLDER))
    storage.write_text(_STORAGE.format(folder=FOLDER))
    return configuration, storage


def environment() -> dict[str, str]:
    """Return the environment in which every podman here works on our folder."""
    configuration, storage = _configured()
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("ACTION_ASSISTANT_", "POSTGRES_", "COMPOSE_", "ROS_"))
    }
    return kept | {
        "CONTAINERS_CONF": str(configuration),
        "CONTAINERS_STORAGE_CONF": str(storage),
        "PATH": f"{BIN}:{kept['PATH']}",
        "TMPDIR": str(FOLDER),
    }


def run(
    *words: str | Path,
    check: bool = True,
    timeout: float = 600,
    cwd: Path = ROOT,
    more: Mapping[str, str] | None = None,
    stdin: IO[bytes] | None = None,
) -> "subprocess.CompletedProcess[str]":
    """A program with this engine, and `more` settings. What it said is shown when it fails."""
    answer = subprocess.run(
        [str(word) for word in words],
        env=environment() | dict(more or {}),
        stdin=stdin,
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )
    if check and answer.returncode:
        said = (answer.stdout + answer.stderr)[-6000:]
        raise AssertionError(f"{' '.join(map(str, words))}: {answer.returncode}\n{said}")
    return answer


def podman(*words: str | Path, **more: Any) -> str:
    """Run podman, and return its standard output."""
    return run("podman", *words, **more).stdout


def inspect(name: str, kind: str = "image") -> dict[str, Any]:
    """Return all that podman knows of one image or container."""
    (found,) = json.loads(podman("inspect", "--type", kind, name))
    return dict(found)
