"""`doctor` as tests ask it, on installations that are sound until one fault is planted."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from action_assistant.commands.doctor.doctor import examine
from action_assistant.commands.doctor.installation import Installation
from action_assistant.system.diagnostics import Diagnostic
from support.product import TOKEN, free_ports, running


def asked(
    data: Path, *flags: str, before: tuple[str, ...] = (), **environment: str
) -> tuple[int, list[dict[str, Any]]]:
    """The command's exit code, and what it prints as JSON. `before`: a program that starts it."""
    command = [*before, sys.executable, "-m", "action_assistant", "doctor", "--json"]
    answer = subprocess.run(
        [*command, "--data", str(data), *flags],
        env={**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", **environment},
        capture_output=True,
        check=False,
        timeout=90,
    )
    assert answer.stdout, answer.stderr.decode()
    found = json.loads(answer.stdout)
    sys.stdout.writelines(
        f"{each['code']}: {each['message']} → {each['remedy']}\n" for each in found
    )
    return answer.returncode, found


def faults(data: Path, **more: Any) -> list[Diagnostic]:
    """Return the faults that `doctor` finds, without robots, on ports where nothing runs unless
    one is named."""
    place = Installation(data=data, **{"port": free_ports(), **more})
    # Time for a busy machine; how long it may take is not what is asked here.
    found = [each for each in examine(place, seconds=60) if each.severity != "fine"]
    sys.stdout.writelines(f"{each.code}: {each.message} → {each.remedy}\n" for each in found)
    assert all(each.where and each.remedy and each.message.endswith(".") for each in found), found
    return found


def fault(data: Path, **more: Any) -> Diagnostic:
    """The only thing that is wrong."""
    found = faults(data, **more)
    assert len(found) == 1, found
    return found[0]


def served_once(folder: Path, *flags: str) -> Path:
    """A data folder as somebody leaves it: with graphs, a run, a robot and a token, and nothing runs."""
    with running(folder / "data", *flags) as product:
        token = product.data / "token"
        token.touch(mode=0o600)
        token.write_text(TOKEN + "\n")
        with product.runner() as runner:
            runner.post("/api/robots", json={"name": "Ada"}).raise_for_status()
    return product.data
