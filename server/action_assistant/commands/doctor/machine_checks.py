"""This computer: the program itself, its page, descriptors, the clock, shared memory."""

import os
import re
import shutil
import sqlite3
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from action_assistant import paths
from action_assistant.commands.doctor.installation import Installation
from action_assistant.system import limits
from action_assistant.system.diagnostics import Diagnostic, fine, found
from action_assistant.version import described

_DESCRIPTORS: Final = 1024
_SHM: Final = Path("/dev/shm")
_SHM_MIB: Final = 32  # Fast DDS takes half a MiB for each process, and some for large messages
_ASSET: Final = re.compile(r'(?:src|href)="\.?/?(assets/[^"]+)"')


def program(place: Installation) -> Iterator[Diagnostic]:
    """What runs this."""
    del place
    python = f"{sys.version_info.major}.{sys.version_info.minor}.{sys.version_info.micro}"
    yield fine(
        "program",
        f"Version {described()} on Python {python} with SQLite {sqlite3.sqlite_version}.",
    )


def page_is_built(place: Installation) -> Iterator[Diagnostic]:
    """The page, whole, and in a checkout not older than what it is made of."""
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
    """In a checkout, a source of the page that is newer than the page."""
    sources = paths.page_sources()
    if sources is None:
        return None
    for folder, _, names in os.walk(sources):
        for each in (Path(folder, name) for name in names if ".test." not in name):
            if each.stat().st_mtime > built + 1:
                return each.relative_to(sources.parent)
    return None


def descriptors_suffice(place: Installation) -> Iterator[Diagnostic]:
    """Files and connections that a process may have open."""
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
    """A clock can be compared with the files of this program only; events and processes are compared
    with it where they are looked at."""
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
    """Workers and messages of ROS 2 go through it on Linux."""
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
