"""`doctor`: says in plain sentences what is wrong with this installation, and what to do about it.

Each check runs by itself and for a bounded time, and none of them ends the others. No check changes anything.
The page of administrators takes the same checks from `diagnose`, in a worker; it raises nothing.
"""

import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Final, TypeAlias

from action_assistant.commands.doctor import (
    database_checks,
    machine_checks,
    process_checks,
)
from action_assistant.commands.doctor.installation import Installation
from action_assistant.commands.doctor.robot_checks import (
    ROBOTS_S,
    engines_index_once,
    robots_answer,
    robots_have_names,
)
from action_assistant.system.diagnostics import Diagnostic, found

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


def looked_at(place: Installation, only: str | None) -> Iterator[Diagnostic]:
    """Yield the findings about the computer, and what runs on it, and those about robots; `only`:
    "machine" or "ros" for one side of them."""
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
