"""Diagnostics: what is wrong with an installation, where, why, and what to do about it.

Codes are for programs and stay; *Help* makes the table of its page *What `doctor` names* from them.
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


class Code(msgspec.Struct, frozen=True):
    """One kind of fault. `meaning`: what is wrong, for the table of *Help*."""

    severity: Severity
    meaning: str


def _error(meaning: str) -> Code:
    return Code("error", meaning)


def _warning(meaning: str) -> Code:
    return Code("warning", meaning)


#: All kinds of faults by code, by the subject that they belong to.
SUBJECTS: Final[Mapping[str, Mapping[str, Code]]] = {
    "settings": {
        "setting-unknown": _error("an unknown variable `ACTION_ASSISTANT_…`; nothing starts"),
        "setting-wrong": _error("a variable or option with an invalid value"),
    },
    "the data folder": {
        "folder-unusable": _error("it cannot be read, written or created"),
        "folder-of-others": _error(
            "files in it belong to another user than the folder, for instance after `sudo`"
        ),
        "folder-readable": _error("other users of the computer can read it"),
        "file-unreadable": _error(
            "a file of a person, session, token, link, release or of rules holds nothing readable: it is kept, and opens nothing"
        ),
        "token-missing": _error("the token of a folder in use is gone"),
        "token-readable": _error("other users can read the token and be the owner with it"),
        "token-unusable": _error("the token is too short or no text"),
        "restore-unfinished": _error("a restore was interrupted; nothing starts"),
        "archive-unusable": _error(
            "the archive folder is missing, is no folder, or cannot be written"
        ),
        "disk-full": _error("less than 100 MiB are free"),
        "backup-missing": _warning("a week of use without any known backup"),
        "backup-old": _warning(
            "the last backup failed, is late by its schedule, or is a month old without one"
        ),
    },
    "the databases": {
        "schema-newer": _error("a newer version of this program made the tables"),
        "schema-older": _warning(
            "an older version made the tables: what the next start changes, the size of its copy, and that there is room"
        ),
        "schema-room": _error("the same, and there is no room for the copy"),
        "database-foreign": _error("the database belongs to another program"),
        "database-unreadable": _error("the file is damaged, or its permissions are wrong"),
        "database-lost": _error("the graphs or runs of a folder in use are gone"),
        "events-damaged": _error("a stored event is not what was written"),
        "journal-held": _error("another program holds the lock of the database"),
        "database-url": _error("the URL names no supported database"),
        "database-host-unknown": _error("no name server knows the host"),
        "database-password": _error("the server refuses user or password"),
        "database-absent": _error("the server has no database of that name"),
        "database-unreachable": _error("the database server does not answer"),
        "database-unsafe": _error("it may lose confirmed data, or is a read-only replica"),
    },
    "this computer": {
        "page-missing": _error("the page is not built, or incomplete"),
        "page-stale": _error("in a checkout: sources are newer than the page"),
        "descriptors-few": _error("a process may open fewer than 1,024 files and connections"),
        "clock-wrong": _error("events or this program are from the future"),
        "shared-memory-missing": _error("`/dev/shm` cannot be written"),
        "shared-memory-small": _warning("less than 32 MiB of it are left"),
    },
    "what runs": {
        "port-taken": _error("another program listens where editor or runner should"),
        "served-elsewhere": _warning(
            "this program has the folder open but does not answer at this port"
        ),
        "version-differs": _error("another version of the program is running"),
        "token-differs": _error("the running program has another token than this folder"),
        "clock-differs": _error("the clock of editor or runner differs by 5 s or more"),
        "certificate-expired": _error("the certificate has expired"),
        "certificate-names": _error("the certificate is for other names"),
        "certificate-untrusted": _error("the certificate is signed by an unknown authority"),
        "proxy-unreachable": _error("nobody answers at the public address"),
        "proxy-target": _error(
            "what answers there is another program, or the process behind is down"
        ),
        "proxy-host": _error("the proxy replaces the Host header"),
        "proxy-path": _error("requests below `runner/` go to the editor"),
        "proxy-sockets": _error("it passes no WebSockets on"),
        "provider-unusable": _error(
            "the identity provider does not answer, or is another one than the setting says"
        ),
        "provider-address": _warning(
            "an identity provider is set, but no https address at which others could sign in by it"
        ),
    },
    "ROS 2 and robots": {
        "python-unusable": _error(
            "the runner's Python cannot run this program, or another one would fit better"
        ),
        "ros1-sourced": _error("ROS 1 is sourced in this shell"),
        "rclpy-missing": _error("robots are registered, and rclpy or their messages are missing"),
        "domain-wrong": _error("`ROS_DOMAIN_ID` is no domain"),
        "domain-high": _warning("a domain above 101: its ports may be used by other programs"),
        "middleware-broken": _error("`RMW_IMPLEMENTATION` is not installed, or does not start"),
        "shared-memory-apart": _warning(
            "this container has private shared memory: engines outside are seen, nothing arrives"
        ),
        "shared-memory-users": _warning(
            "nodes of several users, who may not read each other's memory"
        ),
        "robot-profile": _error("its profile is invalid"),
        "robot-name": _warning("a robot has the name `conducted`, which stands for led runs now"),
        "robot-unproven": _error(
            "the ids of its middleware (Zenoh, for one) do not tell processes apart, so nothing is proven there"
        ),
        "robot-older": _error("its messages are of an earlier generation"),
        "robot-middleware": _error("it is registered with another middleware than the runner's"),
        "robot-elsewhere": _error("no engine on its domain, and an unregistered one on another"),
        "robot-silent": _error("no engine, no answer, or several answers"),
        "robot-deaf": _error("it answers, and does not listen to start or stop"),
        "engine-odd": _error("several engines on one path, or one of the earlier generation"),
        "engine-unregistered": _warning(
            "an unregistered engine; without a name, absent robots that it may be are listed"
        ),
        "engine-indexing": _warning(
            "the engine of a robot on this computer indexes while it runs (`H15`); the start of a led run on it is refused"
        ),
    },
    "the checks themselves": {
        "check-failed": _error("a check itself failed"),
        "check-unfinished": _warning("a check got no answer in time"),
    },
}
CODES: Final[Mapping[str, Code]] = {
    code: each for subject in SUBJECTS.values() for code, each in subject.items()
}


def table() -> str:
    """Return a Markdown table of all codes, with a row for each subject before its codes."""
    lines = ["| code | severity | what is wrong |", "|---|---|---|"]
    for subject, codes in SUBJECTS.items():
        lines.append(f"| **{subject}** | | |")
        lines += [
            f"| `{name}` | {code.severity} | {code.meaning} |" for name, code in codes.items()
        ]
    return "\n".join((*lines, ""))


def found(code: str, where: object, message: str, remedy: str) -> Diagnostic:
    """Return the diagnostic of a fault, with the severity that `CODES` gives its code. `where`: the
    path, address or setting with the fault; `message` and `remedy` are sentences for people. Raise
    KeyError for a code that is not in `CODES`."""
    return Diagnostic(
        code=code, severity=CODES[code].severity, where=str(where), message=message, remedy=remedy
    )


def fine(where: object, message: str) -> Diagnostic:
    """Return the diagnostic of a check that found no fault. `where`: the path, address or setting
    that was checked; `message`: the result for people."""
    return Diagnostic(code="", severity="fine", where=str(where), message=message, remedy="")
