"""This computer: the program itself, its page, descriptors, the clock, shared memory."""

import argparse
import difflib
import os
import re
import shutil
import sqlite3
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Final

from action_assistant import interpreter, paths, settings
from action_assistant.commands.backups import options
from action_assistant.commands.doctor.installation import Installation
from action_assistant.errors import CannotStart
from action_assistant.journal.databases import database_of
from action_assistant.logs.setup import log_settings
from action_assistant.system import limits
from action_assistant.system.diagnostics import Diagnostic, fine, found
from action_assistant.version import described
from action_assistant.web.auth.keys import Keys

_PREFIX: Final = "ACTION_ASSISTANT_"
_HOST: Final = re.compile(r"[A-Za-z0-9_.:\[\]-]+")


def settings_mean_something(place: Installation) -> Iterator[Diagnostic]:
    """Check every environment variable of this program."""
    del place
    given = {name: value for name, value in os.environ.items() if name.startswith(_PREFIX)}
    problems = [each for name in sorted(given) for each in _setting(name, given[name])]
    yield from problems
    if not problems:
        many = f"{len(given)} of them are set" if given else "none is set"
        yield fine("settings", f"What ACTION_ASSISTANT_… says can be read; {many}.")


def _setting(name: str, value: str) -> Iterator[Diagnostic]:
    if name not in settings.VARIABLES:
        near = difflib.get_close_matches(name, settings.VARIABLES, 1)
        meant = f"Is {near[0]} meant? " if near else ""
        yield found(
            "setting-unknown",
            name,
            f"No setting has the name {name}, so nothing starts.",
            f"{meant}Correct or unset it; docs/network.md and `action-assistant serve --help` have all.",
        )
        return
    try:
        if value.strip():
            _READERS.get(name, _anything)(value)
    except CannotStart as error:
        yield found("setting-wrong", name, str(error), f"Correct or unset {name}.")


def _anything(_: str) -> None:
    """Accept any value, since another check reads it."""


def _limits(value: str) -> None:
    if value.lower() not in {"on", "off"}:
        raise CannotStart(f"ACTION_ASSISTANT_LIMITS is `off` or unset, not {value!r}.")


def _hosts(value: str) -> None:
    for each in value.split(","):
        if each.strip() and not _HOST.fullmatch(each.strip()):
            raise CannotStart(
                f"ACTION_ASSISTANT_HOSTS is a list of host names, and {each.strip()!r} is none."
            )


def _url(value: str) -> None:
    if not value.startswith(("http://", "https://")):
        raise CannotStart(
            f"ACTION_ASSISTANT_URL begins with http:// or https://, not as {value!r}."
        )


def _days(name: str) -> Callable[[str], object]:
    return lambda value: settings.keep(Path(), {name: value})


def _file(name: str) -> Callable[[str], object]:
    return lambda value: settings.take_secrets_from_files({name: value})


def _log(name: str) -> Callable[[str], object]:
    return lambda value: log_settings(environ={name: value})


def _metrics(name: str) -> Callable[[str], object]:
    return lambda value: settings.metrics_token({name: value})


def _argument(reads: Callable[[str], object]) -> Callable[[str], object]:
    """Return `reads` with the errors of argparse turned into CannotStart."""

    def read(value: str) -> object:
        try:
            return reads(value)
        except argparse.ArgumentTypeError as error:
            raise CannotStart(f"{error}.") from error

    return read


_READERS: Final[Mapping[str, Callable[[str], object]]] = {
    "ACTION_ASSISTANT_PORT": lambda value: settings.port({"ACTION_ASSISTANT_PORT": value}),
    **{name: _file(name) for name in settings.VARIABLES if name.endswith("_FILE")},
    "ACTION_ASSISTANT_TOKEN": lambda value: Keys(value, "ACTION_ASSISTANT_TOKEN"),
    "ACTION_ASSISTANT_DATABASE": database_of,
    "ACTION_ASSISTANT_URL": _url,
    "ACTION_ASSISTANT_HOSTS": _hosts,
    "ACTION_ASSISTANT_PUBLIC_URL": lambda value: settings.reached(value, ""),
    "ACTION_ASSISTANT_TRUSTED_PROXIES": lambda value: settings.reached("", value),
    "ACTION_ASSISTANT_RUNNER_PYTHON": lambda value: interpreter.for_runner(
        {interpreter.VARIABLE: value}
    ),
    "ACTION_ASSISTANT_KEEP_RUNS": _days("ACTION_ASSISTANT_KEEP_RUNS"),
    "ACTION_ASSISTANT_KEEP_RAW": _days("ACTION_ASSISTANT_KEEP_RAW"),
    "ACTION_ASSISTANT_LIMITS": _limits,
    **{name: _log(name) for name in ("ACTION_ASSISTANT_LOG_FORMAT", "ACTION_ASSISTANT_LOG_LEVEL")},
    **{
        name: _metrics(name)
        for name in ("ACTION_ASSISTANT_METRICS_TOKEN", "ACTION_ASSISTANT_METRICS_TOKEN_FILE")
    },
    settings.INDEX_FOLDERS: lambda value: settings.index_folders(
        (), {settings.INDEX_FOLDERS: value}
    ),
    "ACTION_ASSISTANT_BACKUP_EVERY": _argument(options.span),
    "ACTION_ASSISTANT_BACKUP_KEEP": _argument(options.rule),
}


_DESCRIPTORS: Final = 1024
_SHM: Final = Path("/dev/shm")
_SHM_MIB: Final = 32  # Fast DDS takes half a MiB for each process, and some for large messages
_ASSET: Final = re.compile(r'(?:src|href)="\.?/?(assets/[^"]+)"')


def program(place: Installation) -> Iterator[Diagnostic]:
    """Report the versions of this program, of Python and of SQLite."""
    del place
    python = f"{sys.version_info.major}.{sys.version_info.minor}.{sys.version_info.micro}"
    yield fine(
        "program",
        f"Version {described()} on Python {python} with SQLite {sqlite3.sqlite_version}.",
    )


def page_is_built(place: Installation) -> Iterator[Diagnostic]:
    """Check that the built page is complete and, in a checkout, not older than its sources."""
    del place
    folder = paths.page()
    index = folder / "index.html"
    try:
        text = index.read_text()
    except (OSError, UnicodeDecodeError):
        node = (
            "" if shutil.which("node") else " Node.js is not here either; `make setup` fetches one."
        )
        yield found(
            "page-missing",
            folder,
            "The page is not built: there is no index.html that could be read.",
            f"Run `make setup` in the checkout, or install the wheel anew.{node}",
        )
        return
    gone = [each for each in _ASSET.findall(text) if not (folder / each).is_file()]
    if gone:
        yield found(
            "page-missing",
            folder,
            f"The page is not whole: {gone[0]} is missing.",
            "Run `make setup` in the checkout, or install the wheel anew.",
        )
    elif newer := _newer_source(index.stat().st_mtime):
        yield found(
            "page-stale",
            folder,
            f"The page was built before {newer} changed, so it is of another version than the server.",
            "Run `make setup` in the checkout.",
        )
    else:
        yield fine(folder, "The page is built.")


def _newer_source(built: float) -> Path | None:
    """Return a source file of the page that is newer than the built page; None if there is none or
    this is no checkout."""
    sources = paths.page_sources()
    if sources is None:
        return None
    for folder, _, names in os.walk(sources):
        for each in (Path(folder, name) for name in names if ".test." not in name):
            if each.stat().st_mtime > built + 1:
                return each.relative_to(sources.parent)
    return None


def descriptors_suffice(place: Installation) -> Iterator[Diagnostic]:
    """Check how many files and connections a process may have open."""
    del place
    most = limits.descriptors_allowed()
    if most < _DESCRIPTORS:
        yield found(
            "descriptors-few",
            "ulimit -n",
            f"A process may have {most} files and connections open; each open page takes two, so "
            "people are turned away, and Stop may be among what is.",
            f"Raise the hard limit to {_DESCRIPTORS} at least: `ulimit -Hn`, LimitNOFILE= of the "
            "service, or `ulimits` in compose.",
        )
    else:
        yield fine("ulimit -n", f"A process may have {most} files and connections open.")


def clock_is_possible(place: Installation) -> Iterator[Diagnostic]:
    """Check that the clock is not earlier than the files of this program. Other checks compare it
    with events and processes."""
    del place
    newest = max(each.stat().st_mtime for each in Path(__file__).parent.glob("*.py"))
    if time.time() < newest - 86_400:
        yield found(
            "clock-wrong",
            "clock",
            f"It is {time.strftime('%Y-%m-%d')} by the clock, earlier than the program was installed.",
            "Set it (`timedatectl set-ntp true`): histories of runs would be dated wrongly.",
        )
    else:
        yield fine("clock", f"It is {time.strftime('%Y-%m-%d %H:%M:%S %Z')} by the clock.")


def shared_memory_is_there(place: Installation) -> Iterator[Diagnostic]:
    """Check the shared memory that workers and ROS 2 use on Linux."""
    del place
    if not sys.platform.startswith("linux"):
        return
    if not os.access(_SHM, os.W_OK | os.X_OK):
        yield found(
            "shared-memory-missing",
            _SHM,
            "There is no shared memory that can be written: worker processes do not start, and large "
            "messages of robots do not arrive.",
            f"Mount it (`mount -t tmpfs tmpfs {_SHM}`); in a container share the host's (`ipc: host`).",
        )
        return
    free = shutil.disk_usage(_SHM).free // 2**20
    if free < _SHM_MIB:
        yield found(
            "shared-memory-small",
            _SHM,
            f"There are {free} MiB of shared memory left: large messages of robots do not arrive.",
            "Give a container more (`shm_size: 256m`) or the host's (`ipc: host`), or end what fills it.",
        )
    else:
        yield fine(_SHM, f"There are {free} MiB of shared memory left.")
