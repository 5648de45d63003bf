"""Checks of ROS 2 and of the registered robots."""

import os
import sqlite3
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import anyio
import msgspec
from sqlalchemy import create_engine
from sqlalchemy.exc import DBAPIError

from action_assistant.commands.doctor.installation import Installation
from action_assistant.errors import CannotStart
from action_assistant.interpreter import Interpreter, for_runner
from action_assistant.journal.sqlite import unchanged
from action_assistant.kit.clock import utc_us
from action_assistant.runner.links.engine_process import (
    argument,
    command_line,
    indexing_rate,
    is_engine_node,
)
from action_assistant.runner.links.port import CONDUCTED, Registration
from action_assistant.runner.links.ros2.checkup import look
from action_assistant.runner.runs import queries
from action_assistant.system.diagnostics import Diagnostic, found

_ROBOTS_TIMEOUT_S: Final = 45.0
#: The most seconds that `robots_answer` takes.
ROBOTS_S: Final = _ROBOTS_TIMEOUT_S + 5


def robots_answer(place: Installation) -> Iterator[Diagnostic]:
    """Check ROS 2, and whether each robot registered at `place` answers, with the Python that the
    runner would use. Yield what was found. With registered robots this takes some seconds. Nothing
    is yielded if there is no such Python, since the check of the settings reports that."""
    try:
        interpreter = for_runner()
    except CannotStart:  # reported with the settings
        return
    if interpreter.remark:
        yield found(
            "python-unusable",
            interpreter.path,
            interpreter.remark,
            "Do as the sentence says; until then robots are reached as far as it says.",
        )
    yield from _asked(interpreter, place)


def engines_index_once(place: Installation) -> Iterator[Diagnostic]:
    """Yield a warning for each engine process on this computer that belongs to a registered robot
    and, by its command line, reads its folders again and again: it may crash at a get or a start
    (hazard H15, docs/umrf-and-the-engine.md 3)."""
    robots = {each.name: each for each in _registered(place.data)}
    for pid, words in _engines() if robots else ():
        name = argument(words, "--actor-name")
        if name in robots and indexing_rate(words) != "0":
            refused = " The start of a led run on it is refused." if robots[name].led else ""
            yield found(
                "engine-indexing",
                name,
                f"Its engine (process {pid}) reads its folder again and again while it runs. It may die of "
                f"being asked meanwhile, with every running graph (H15).{refused}",
                "Start it with --indexing-rate 0, and again after a change of its folder. Only where graphs "
                "are written into its index while it runs (--index-folder) does it need another rate.",
            )


def robots_have_names(place: Installation) -> Iterator[Diagnostic]:
    """Yield a warning if a robot is registered under the name `CONDUCTED`, which since a later
    version stands for led runs (one run on several robots)."""
    if any(each.name == CONDUCTED for each in _registered(place.data)):
        yield found(
            "robot-name",
            CONDUCTED,
            "Led runs have this name now. A start with this engine means the robot only where it names no robots.",
            "Register it under another name, which is also its engine's --actor-name, and remove this one.",
        )


def _engines() -> Iterator[tuple[int, list[str]]]:
    """Yield the process id and command line of each engine node on this computer."""
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            words = command_line(int(folder.name))
        except OSError:
            continue  # it has ended
        if is_engine_node(words):
            yield int(folder.name), words


def look_here(place: Installation) -> list[Diagnostic]:
    """Return the findings about ROS 2 and the robots registered at `place`, with the Python that
    runs this."""
    return anyio.run(look, _registered(place.data), utc_us)


def _asked(interpreter: Interpreter, place: Installation) -> list[Diagnostic]:
    command = [
        str(interpreter.path),
        *("-m", "action_assistant", "doctor", "--only", "ros", "--here", "--json"),
        *("--data", str(place.data)),
    ]

    try:
        answer = subprocess.run(
            command,
            env=interpreter.environment(os.environ),
            capture_output=True,
            timeout=_ROBOTS_TIMEOUT_S,
            check=False,
        )
        return msgspec.json.decode(answer.stdout, type=list[Diagnostic])
    except subprocess.TimeoutExpired:
        why = f"did not answer in {_ROBOTS_TIMEOUT_S:g} s"
    except OSError as error:
        why = f"cannot be started: {error.strerror}"
    except msgspec.DecodeError:
        said = answer.stderr.decode(errors="replace").strip().splitlines()
        why = f"cannot run this program: {said[-1] if said else f'exit code {answer.returncode}'}"
    return [
        found(
            "python-unusable",
            interpreter.path,
            f"The Python of the runner {why}.",
            "Name another one in ACTION_ASSISTANT_RUNNER_PYTHON, or renew it (`make ros`).",
        )
    ]


def _registered(data: Path) -> list[Registration]:
    """Return the registered robots, read from the database in the data folder without the runner;
    empty if it cannot be read."""
    path = data / "runner.db"
    if not path.exists():
        return []
    engine = create_engine(unchanged(path))
    try:
        with engine.connect() as connection:
            rows = connection.execute(queries.all_robots()).all()
    except (sqlite3.Error, DBAPIError):
        return []  # another check reports what is wrong with the file
    finally:
        engine.dispose()
    return [
        Registration(
            name=row.name,
            domain=row.domain,
            rmw=row.rmw,
            get_service=row.get_service,
            profile=row.profile,
            led=row.led,
        )
        for row in rows
    ]
