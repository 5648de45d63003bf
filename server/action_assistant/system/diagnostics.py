"""Diagnostics: what is wrong with an installation, where, why, and what to do about it.

Codes are for programs and stay; docs/doctor.md explains each of them.
"""

from collections.abc import Mapping
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.safe_text import hold_names

Severity: TypeAlias = Literal["error", "warning", "fine"]


class Diagnostic(msgspec.Struct, frozen=True, kw_only=True):
    """The result of one check. `error`: something does not work or is not safe; `warning`: it may
    matter; `fine`: without code and remedy. `where`: the file, variable, port or robot."""

    code: str
    severity: Severity
    where: str
    message: str
    remedy: str

    def __post_init__(self) -> None:
        hold_names(self, "message", "remedy")


#: All faults by code, in the order of the documentation.
CODES: Final[Mapping[str, Severity]] = {
    # settings
    "setting-unknown": "error",
    "setting-wrong": "error",
    # the data folder
    "folder-unusable": "error",
    "folder-of-others": "error",
    "folder-readable": "error",
    "file-unreadable": "error",
    "token-missing": "error",
    "token-readable": "error",
    "token-unusable": "error",
    "restore-unfinished": "error",
    "archive-unusable": "error",
    "disk-full": "error",
    "backup-missing": "warning",
    "backup-old": "warning",
    # the databases
    "schema-newer": "error",
    "schema-older": "warning",
    "schema-room": "error",
    "database-foreign": "error",
    "database-unreadable": "error",
    "database-lost": "error",
    "events-damaged": "error",
    "journal-held": "error",
    "database-url": "error",
    "database-host-unknown": "error",
    "database-password": "error",
    "database-absent": "error",
    "database-unreachable": "error",
    "database-unsafe": "error",
    # this computer
    "page-missing": "error",
    "page-stale": "error",
    "descriptors-few": "error",
    "clock-wrong": "error",
    "shared-memory-missing": "error",
    "shared-memory-small": "warning",
    # what runs
    "port-taken": "error",
    "served-elsewhere": "warning",
    "version-differs": "error",
    "token-differs": "error",
    "clock-differs": "error",
    "certificate-expired": "error",
    "certificate-names": "error",
    "certificate-untrusted": "error",
    "proxy-unreachable": "error",
    "proxy-target": "error",
    "proxy-host": "error",
    "proxy-path": "error",
    "proxy-sockets": "error",
    "provider-unusable": "error",
    "provider-address": "warning",
    # ROS 2 and robots
    "python-unusable": "error",
    "ros1-sourced": "error",
    "rclpy-missing": "error",
    "domain-wrong": "error",
    "domain-high": "warning",
    "middleware-broken": "error",
    "shared-memory-apart": "warning",
    "shared-memory-users": "warning",
    "robot-profile": "error",
    "robot-name": "warning",
    "robot-unproven": "error",
    "robot-older": "error",
    "robot-middleware": "error",
    "robot-elsewhere": "error",
    "robot-silent": "error",
    "robot-deaf": "error",
    "engine-odd": "error",
    "engine-unregistered": "warning",
    "engine-indexing": "warning",
    # looking itself
    "check-failed": "error",
    "check-unfinished": "warning",
}


def found(code: str, where: object, message: str, remedy: str) -> Diagnostic:
    """Return the diagnostic of a fault, with the severity that `CODES` gives its code. `where`: the
    path, address or setting with the fault; `message` and `remedy` are sentences for people. Raise
    KeyError for a code that is not in `CODES`."""
    return Diagnostic(
        code=code, severity=CODES[code], where=str(where), message=message, remedy=remedy
    )


def fine(where: object, message: str) -> Diagnostic:
    """Return the diagnostic of a check that found no fault. `where`: the path, address or setting
    that was checked; `message`: the result for people."""
    return Diagnostic(code="", severity="fine", where=str(where), message=message, remedy="")
