"""Commands that keep a copy of the journals and bring it back: backup, restore."""

import argparse
import asyncio
import hashlib
import os
import shutil
import sqlite3
import tempfile
import time
import zipfile
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Final

import msgspec

from action_assistant import places
from action_assistant.errors import CannotStart
from action_assistant.journal.database import Branch
from action_assistant.journal.events import Fold
from action_assistant.journal.journal import Journal
from action_assistant.private import own_folder
from action_assistant.version import VERSION

_FORMAT: Final = 1
_ABOUT: Final = "about.json"
_BRANCHES: Final[tuple[Branch, ...]] = ("editor", "runner")
_CHUNK: Final = 1 << 20


class Copied(msgspec.Struct, frozen=True):
    """One journal in a backup: its last position, and the SHA-256 of the file."""

    events: int
    sha256: str


class About(msgspec.Struct, frozen=True):
    """What a backup says of itself."""

    format: int
    version: str
    made_at: float
    journals: dict[Branch, Copied]


def add_to(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the commands of this module."""
    backup = commands.add_parser(
        "backup",
        help="write a checked copy of all journals into one file, also while they are in use",
        epilog="example: action-assistant backup monday.zip --data ./data",
    )
    restore = commands.add_parser(
        "restore",
        help="put a backup in the place of the journals; open pages notice and ask",
        epilog="example: action-assistant restore monday.zip --data ./data",
    )
    for command in (backup, restore):
        command.add_argument("file", type=Path, metavar="FILE")
        command.add_argument(
            "--data", type=Path, default=places.data(), metavar="DIR", help="default: %(default)s"
        )
    backup.set_defaults(deed=_backup)
    restore.set_defaults(deed=_restore)


def _backup(options: argparse.Namespace) -> int:
    data, target = options.data.resolve(), options.file.resolve()
    found = [branch for branch in _BRANCHES if (data / f"{branch}.db").is_file()]
    if not found:
        raise CannotStart(
            f"There is no journal in {data}. A Postgres database is backed up with pg_dump."
        )
    with _workshop(target.parent) as folder:
        copies = {}
        for branch in found:
            _copy(data / f"{branch}.db", folder / f"{branch}.db")
            events = _checked(folder, branch)
            copies[branch] = Copied(events, _sha256(folder / f"{branch}.db"))
        about = About(_FORMAT, VERSION, time.time(), copies)
        _pack(folder, about, target)
    for branch, copy in copies.items():
        print(f"{branch}: {copy.events} events, all of them sound")
    print(f"written to {target}")
    return 0


def _restore(options: argparse.Namespace) -> int:
    data, source = options.data.resolve(), options.file.resolve()
    own_folder(data)
    with _workshop(data) as folder, ExitStack() as locks:
        about = _unpack(source, folder)
        for branch in about.journals:
            locks.callback(os.close, _locked(data, branch))
        for branch, copy in about.journals.items():
            if _sha256(folder / f"{branch}.db") != copy.sha256:
                raise CannotStart(f"{source} is damaged: {branch}.db is not what was written.")
            _checked(folder, branch, anew=True)
        aside = data / time.strftime("before-restore-%Y%m%d-%H%M%S")
        aside.mkdir(mode=0o700)
        for branch in about.journals:
            _exchange(folder / f"{branch}.db", data / f"{branch}.db", aside)
        (data / _mark()).unlink(missing_ok=True)
    for branch, copy in about.journals.items():
        print(f"{branch}: as it was after {copy.events} events")
    print(f"what was there before is in {aside}")
    return 0


@contextmanager
def _workshop(parent: Path) -> Iterator[Path]:
    """A folder for the work, on the disk where its result will lie."""
    try:
        with tempfile.TemporaryDirectory(prefix=".backup-", dir=parent) as folder:
            yield Path(folder)
    except (OSError, sqlite3.Error) as error:
        text = error.strerror if isinstance(error, OSError) else str(error)
        raise CannotStart(f"Cannot work in {parent}: {text}.") from error


def _copy(source: Path, target: Path) -> None:
    """The database as it is at one moment, while others may write."""
    with (
        closing(sqlite3.connect(f"{source.as_uri()}?mode=ro", uri=True)) as there,
        closing(sqlite3.connect(target)) as here,
    ):
        there.backup(here)


def _checked(folder: Path, branch: Branch, *, anew: bool = False) -> int:
    """The number of events of a copy, each of which is sound. `anew`: it begins another epoch.

    Raises CannotStart.
    """
    from action_assistant.editor import epochs
    from action_assistant.editor.happenings import fold as editor_fold
    from action_assistant.runner.archive import fold as runner_fold

    folds: dict[Branch, Fold] = {"editor": editor_fold, "runner": runner_fold}

    async def look() -> int:
        url = f"sqlite:///{folder / f'{branch}.db'}"
        journal = await Journal.open(url, branch=branch, fold=folds[branch])
        try:
            for damage in await journal.verify():
                raise CannotStart(
                    f"The journal of the {branch} is damaged: {damage.stream or 'the file'}, "
                    f"event {damage.seq}: {damage.why}. `verify` tells more."
                )
            events = await journal.position()
            if anew and branch == "editor":
                await epochs.begin(journal, "a backup was restored")
            return events
        finally:
            await journal.close()

    return asyncio.run(look())


def _mark() -> str:
    from action_assistant.editor.epochs import MARK

    return MARK


def _locked(data: Path, branch: Branch) -> int:
    """Keep everybody else out of a journal, also out of one that cannot be opened."""
    from action_assistant.journal.sqlite import own

    try:
        return own(data / f"{branch}.db")
    except CannotStart as error:
        raise CannotStart(f"{error} End action-assistant first.") from error


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _pack(folder: Path, about: About, target: Path) -> None:
    part = folder / "backup.zip"
    with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr(_ABOUT, msgspec.json.format(msgspec.json.encode(about)))
        for branch in about.journals:
            archive.write(folder / f"{branch}.db", f"{branch}.db")
    part.chmod(0o600)  # graphs and names are nobody else's business
    _sync(part)
    part.replace(target)
    _sync(target.parent)


def _unpack(source: Path, folder: Path) -> About:
    """Its journals into the folder, under names of our own choice. Raises CannotStart."""
    try:
        with zipfile.ZipFile(source) as archive:
            about = msgspec.json.decode(archive.read(_ABOUT), type=About)
            if about.format != _FORMAT:
                raise CannotStart(f"{source} was made by a newer version, {about.version}.")
            for branch in about.journals:
                path = folder / f"{branch}.db"
                with archive.open(path.name) as packed, path.open("wb") as file:
                    shutil.copyfileobj(packed, file, _CHUNK)
    except FileNotFoundError as error:
        raise CannotStart(f"There is no file {source}.") from error
    except (zipfile.BadZipFile, KeyError, msgspec.DecodeError, EOFError) as error:
        raise CannotStart(f"{source} is no backup of ours, or is damaged: {error}.") from error
    return about


def _exchange(new: Path, old: Path, aside: Path) -> None:
    """Put a file in the place of another, which is kept. At no moment is there none."""
    for path in (old, old.with_name(f"{old.name}-wal")):
        if path.exists():
            os.link(path, aside / path.name)
    # What an old log still holds must not be applied to the new file.
    for suffix in ("-wal", "-shm"):
        old.with_name(f"{old.name}{suffix}").unlink(missing_ok=True)
    new.chmod(0o600)
    _sync(new)
    new.replace(old)
    _sync(old.parent)


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
