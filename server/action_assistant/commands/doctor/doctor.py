"""`doctor`: says in plain sentences what is wrong with this installation, and what to do about it.

Each check runs by itself and for a bounded time, and none of them ends the others. No check changes anything.
The page of administrators takes the same checks from `diagnose`, in a worker; it raises nothing.
"""

import argparse
import os
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final, TypeAlias

import anyio
import msgspec
from sqlalchemy import create_engine
from sqlalchemy.exc import DBAPIError

from action_assistant import paths as places
from action_assistant import settings
from action_assistant.commands.doctor import (
    database_checks,
    machine_checks,
    process_checks,
)
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
from action_assistant.safe_text import one_line
from action_assistant.system.diagnostics import Diagnostic, Severity, found

Check: TypeAlias = Callable[[Installation], Iterable[Diagnostic]]

PATIENCE_S: Final = 10.0  # for all together; each has bounds of its own, which are lower
CHECKS: Final[tuple[Check, ...]] = (
    machine_checks.program,
    machine_checks.settings_mean_something,
    machine_checks.page_is_built,
    machine_checks.folder_is_ours,
    machine_checks.token_is_there,
    machine_checks.small_files_are_whole,
    machine_checks.nothing_was_interrupted,
    machine_checks.archive_is_usable,
    machine_checks.disk_has_room,
    machine_checks.backups_are_made,
    database_checks.graphs_are_there,
    database_checks.runs_are_there,
    process_checks.processes_fit,
    process_checks.proxy_leads_here,
    process_checks.provider_answers,
    machine_checks.descriptors_suffice,
    machine_checks.clock_is_possible,
    machine_checks.shared_memory_is_there,
)
#: What to know before a newer version is started on a data folder.
BEFORE_UPGRADE: Final[tuple[Check, ...]] = (
    machine_checks.program,
    machine_checks.folder_is_ours,
    machine_checks.nothing_was_interrupted,
    machine_checks.backups_are_made,
    database_checks.graphs_are_there,
    database_checks.runs_are_there,
    database_checks.copies_fit,
)
_SIGNS: Final[dict[Severity, str]] = {"fine": "✓", "warning": "·", "error": "✗"}
_ROBOTS_TIMEOUT_S: Final = 45.0
#: The most seconds that `robots_answer` takes.
ROBOTS_S: Final = _ROBOTS_TIMEOUT_S + 5


def diagnose(place: Installation) -> list[Diagnostic]:
    """Return the faults of an installation; robots are not asked. This takes about a second, and
    ten seconds at most."""
    return [each for each in examine(place) if each.severity != "fine"]


def examine(
    place: Installation, checks: Iterable[Check] = CHECKS, seconds: float = PATIENCE_S
) -> Iterator[Diagnostic]:
    """Start all checks of an installation at the same time, since some wait for an answer, and
    yield their findings in the order of the checks. A check that takes longer than `seconds` is
    reported as unfinished."""
    until = time.monotonic() + seconds
    threads = [_CheckThread(check, place) for check in checks]
    return (each for thread in threads for each in thread.seen(until))


class _CheckThread(threading.Thread):
    """Runs one check on a daemon thread."""

    def __init__(self, check: Check, place: Installation) -> None:
        super().__init__(name=check.__name__, daemon=True)
        self._check = check
        self._place = place
        self._found: list[Diagnostic] = []
        self.start()

    def run(self) -> None:
        """Run the check and store its findings; an exception becomes a finding."""
        try:
            self._found = list(self._check(self._place))
        except Exception as error:  # noqa: BLE001 - that a check fails is told, and ends no other one
            self._found = [
                found(
                    "check-failed",
                    self.name,
                    f"This could not be looked at: {type(error).__name__}: {error}.",
                    "Report it with this line: doctor is to look at everything.",
                )
            ]

    def seen(self, until: float) -> list[Diagnostic]:
        """Wait for the end of the check, until `until` (monotonic seconds) at most. Return its
        findings, or one finding that says that it has not ended."""
        self.join(max(0.0, until - time.monotonic()))
        if not self.is_alive():
            return self._found
        return [
            found(
                "check-unfinished",
                self.name,
                "This was not looked at to its end: something does not answer.",
                "Look at disks and servers on the network that it asks, and run doctor again.",
            )
        ]


def _add_doctor(doctor: argparse.ArgumentParser) -> None:
    doctor.epilog = (
        "example: action-assistant doctor --data ./data; exit code 1 if something is wrong"
    )
    doctor.add_argument(
        "--data", type=Path, default=places.data(), metavar="DIR", help="default: %(default)s"
    )
    doctor.add_argument(
        "--database",
        metavar="URL",
        help="of the editor; default: the one that was served last",
    )
    doctor.add_argument(
        "--host", metavar="H", help="default: the one that serves DIR, or 127.0.0.1"
    )
    doctor.add_argument(
        "--port",
        type=settings.port_number,
        metavar="N",
        help="of the editor; default: the one that serves DIR, or ACTION_ASSISTANT_PORT",
    )
    doctor.add_argument(
        "--public-url", metavar="URL", help="where a proxy shows the page; it is asked there"
    )
    sides = doctor.add_mutually_exclusive_group()
    sides.add_argument(
        "--before-upgrade",
        action="store_true",
        help="look only at what the next start of this version changes in older data, and whether "
        "there is room for the copy that it makes before",
    )
    sides.add_argument(
        "--only", choices=("machine", "ros"), help="look at one side of it only; default: at both"
    )
    doctor.add_argument(
        "--json", action="store_true", help="print what is wrong as JSON, and nothing else"
    )
    doctor.add_argument("--here", action="store_true", help=argparse.SUPPRESS)  # with this Python
    doctor.set_defaults(handler=_doctor)


COMMANDS: Final = {"doctor": _add_doctor}


def _doctor(options: argparse.Namespace) -> int:
    with suppress(CannotStart):  # reported as a finding
        settings.take_secrets_from_files()
    place = Installation(
        data=options.data.absolute(),
        database=options.database or settings.database(),
        host=options.host or "127.0.0.1",
        port=options.port or Installation.port_of_settings(),
        public_url=options.public_url,
    )
    if options.host is None and options.port is None:
        place = place.where_served()
    if options.here:
        print(msgspec.json.encode(look_here(place)).decode())
        return 0
    seen: list[Diagnostic] = []
    before = options.before_upgrade
    for each in examine(place, BEFORE_UPGRADE) if before else _looked_at(place, options.only):
        seen.append(each)
        if not options.json:
            _tell(each)
    wrong = [each for each in seen if each.severity != "fine"]
    if options.json:
        print(msgspec.json.encode(wrong).decode())
    return 1 if any(each.severity == "error" for each in wrong) else 0


def _looked_at(place: Installation, only: str | None) -> Iterator[Diagnostic]:
    # Robots are asked from the start: that waits for the network, the rest for disks.
    asked: list[Check] = (
        [] if only == "machine" else [robots_answer, engines_index_once, robots_have_names]
    )
    robots = examine(place, asked, ROBOTS_S)
    if only != "ros":
        yield from examine(place)
    if only != "machine" and sys.stderr.isatty():
        print("Asking robots, which takes some seconds …", file=sys.stderr)
    yield from robots


def _tell(each: Diagnostic) -> None:
    code = f" [{each.code}]" if each.code else ""
    print(one_line(f"{_SIGNS[each.severity]} {each.where}: {each.message}{code}"), flush=True)
    if each.remedy:
        print(one_line(f"    {each.remedy}"), flush=True)


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
