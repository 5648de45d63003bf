"""All checks of an installation: each by itself and for a bounded time, and none of them ends the rest.

`diagnose` is for whoever wants to know: the command, and a page for administrators, in a worker.
Nothing is changed by it, and it raises nothing.
"""

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Final, TypeAlias

from action_assistant.commands.doctor import (
    database_checks,
    folder_checks,
    machine_checks,
    process_checks,
)
from action_assistant.commands.doctor.installation import Installation
from action_assistant.system.diagnostics import Diagnostic, found

Check: TypeAlias = Callable[[Installation], Iterable[Diagnostic]]

PATIENCE_S: Final = 10.0  # for all together; each has bounds of its own, which are lower
CHECKS: Final[tuple[Check, ...]] = (
    machine_checks.program,
    machine_checks.settings_mean_something,
    machine_checks.page_is_built,
    folder_checks.folder_is_ours,
    folder_checks.token_is_there,
    folder_checks.nothing_was_interrupted,
    folder_checks.archive_is_usable,
    folder_checks.disk_has_room,
    folder_checks.backups_are_made,
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
        """Return the findings, or a finding that says that the check did not end before `until`
        (monotonic clock)."""
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
