"""`doctor`: says in plain sentences what is wrong with this installation, and what to do about it.

Each check runs by itself and for a bounded time, and none of them ends the others. No check changes anything.
The page of administrators takes the same checks from `diagnose`, in a worker; it raises nothing.
"""

import argparse
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final, TypeAlias

import msgspec

from action_assistant import paths as places
from action_assistant import settings
from action_assistant.commands.doctor import (
    database_checks,
    machine_checks,
    process_checks,
)
from action_assistant.commands.doctor.installation import Installation
from action_assistant.commands.doctor.ros_checks import (
    ROBOTS_S,
    engines_index_once,
    look_here,
    robots_answer,
)
from action_assistant.commands.processes import port_number
from action_assistant.errors import CannotStart
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
    machine_checks.nothing_was_interrupted,
    machine_checks.archive_is_usable,
    machine_checks.disk_has_room,
    machine_checks.backups_are_made,
    database_checks.graphs_are_there,
    database_checks.runs_are_there,
    process_checks.processes_fit,
    process_checks.proxy_leads_here,
    machine_checks.descriptors_suffice,
    machine_checks.clock_is_possible,
    machine_checks.shared_memory_is_there,
)


def diagnose(place: Installation) -> list[Diagnostic]:
    """Return the faults of an installation, without those of robots.

    This takes about a second, and ten seconds at most.
    """
    return [each for each in examine(place) if each.severity != "fine"]


def examine(
    place: Installation, checks: Iterable[Check] = CHECKS, seconds: float = PATIENCE_S
) -> Iterator[Diagnostic]:
    """Start all checks side by side, since some wait for an answer, and yield their findings in the
    order of the checks."""
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
        """Wait for the end of the check, until `until` (monotonic clock) at most. Return its
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


_SIGNS: Final[dict[Severity, str]] = {"fine": "✓", "warning": "·", "error": "✗"}


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
    doctor.add_argument("--host", default="127.0.0.1", metavar="H", help="default: %(default)s")
    doctor.add_argument(
        "--port",
        type=port_number,
        metavar="N",
        help="of the editor; default: ACTION_ASSISTANT_PORT",
    )
    doctor.add_argument(
        "--public-url", metavar="URL", help="where a proxy shows the page; it is asked there"
    )
    doctor.add_argument(
        "--only", choices=("machine", "ros"), help="look at one side of it only; default: at both"
    )
    doctor.add_argument(
        "--json", action="store_true", help="print what is wrong as JSON, and nothing else"
    )
    doctor.add_argument("--here", action="store_true", help=argparse.SUPPRESS)  # with this Python
    doctor.set_defaults(handler=_doctor)


COMMANDS: Final = {"doctor": _add_doctor}


def _doctor(options: argparse.Namespace) -> int:
    with suppress(CannotStart):  # told as a finding
        settings.take_secrets_from_files()
    port = Installation.port_of_settings() if options.port is None else options.port
    place = Installation(
        data=options.data.absolute(),
        database=options.database or settings.database(),
        host=options.host,
        port=port,
        public_url=options.public_url,
    )
    if options.here:
        print(msgspec.json.encode(look_here(place)).decode())
        return 0
    seen: list[Diagnostic] = []
    for each in _looked_at(place, options.only):
        seen.append(each)
        if not options.json:
            _tell(each)
    wrong = [each for each in seen if each.severity != "fine"]
    if options.json:
        print(msgspec.json.encode(wrong).decode())
    return 1 if any(each.severity == "error" for each in wrong) else 0


def _looked_at(place: Installation, only: str | None) -> Iterator[Diagnostic]:
    # Robots are asked from the start: that waits for the network, the rest for disks.
    asked: list[Check] = [] if only == "machine" else [robots_answer, engines_index_once]
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
