"""`restore`: puts a backup in the place of what is there, or into an empty folder or database.

Everything is unpacked and proven beside its place first. While it is put there, `restore.unfinished`
stands in the folder, with which nothing starts: whatever ends it, what is there is as before, or whole,
or marked.
"""

import argparse
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Final

import msgspec
from sqlalchemy import Connection, inspect, select

from action_assistant import settings
from action_assistant.commands.backups.backup_file import (
    FILES,
    BackupManifest,
    Package,
    sha256_of,
)
from action_assistant.commands.backups.data_folder import (
    BRANCHES,
    MERGED,
    WHOLE,
    aside_folder,
    checked,
    fold_of,
    left_out,
    rows_of,
    sweep,
    workshop,
)
from action_assistant.commands.backups.progress import Progress
from action_assistant.errors import CannotStart
from action_assistant.journal.database import Branch
from action_assistant.journal.databases import ask_once, database_of
from action_assistant.journal.foreign_schema import remove_strangers
from action_assistant.private_files import DamagedFile, opener, read_json, replace_file, sync
from action_assistant.schema.editor_tables import editor_event
from action_assistant.web.auth.keys import TOKEN_FILE

_WORK: Final = ".restore-"
_JOURNALS: Final = tuple(f"{branch}.db" for branch in BRANCHES)
_MARKS: Final = ("editor.mark", "editor.database", settings.RESTORING)
_event: Final = editor_event.c
_LAST: Final = select(_event.position, _event.chain).order_by(_event.position.desc()).limit(1)


class RestoreUnderWay(msgspec.Struct, frozen=True):
    """A restore that has begun; a later call reads this and continues it.

    `sha256`: the hash of the editor's journal in the backup. `position` and `chain`: the end of the
    log after the restore.
    """

    sha256: str
    position: int
    chain: str


def restore(options: argparse.Namespace) -> int:
    """Run the command `restore` with these options and return its exit code. Raise CannotStart if
    the backup is damaged or its target is in use."""
    from action_assistant.editor.log import database_location

    data, source = options.data.resolve(), options.file.resolve()
    progress = Progress()
    package = Package(source)
    try:
        about = package.about
        check_names(about, source)
        _check_folder(data, source)
        url = (
            options.database
            or database_location.remembered(data)
            or f"sqlite:///{data / 'editor.db'}"
        )
        with _made(data), workshop(data, _WORK) as folder, _locked(data, about.journals):
            sweep(data, _WORK)
            package.unpack(folder, progress)
            dropped: list[str] = []
            for branch, held in about.journals.items():
                path = folder / f"{branch}.db"
                dropped += (f"{branch}: {each}" for each in remove_strangers(path, branch))
                checked(path, branch, progress, expected=held.events, anew=True)
            aside, kept = _put(folder, data, url, about, progress)
    finally:
        package.close()
    progress.end()
    for each in dropped:
        print(f"dropped, since this program has not made it: {each}")
    _tell(about, url, data, aside, kept)
    return 0


@contextmanager
def _made(data: Path) -> Iterator[None]:
    """Make the data folder if it is missing. A folder that was made for a restore that fails before
    anything is in it is removed."""
    is_new = not data.exists()
    try:
        data.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise CannotStart(f"Cannot make {data}: {error.strerror}.") from error
    try:
        yield
    except BaseException:
        if is_new:
            with suppress(OSError):  # it is not empty
                data.rmdir()
        raise


def check_names(about: BackupManifest, source: Path) -> None:
    """Raise CannotStart if a backup has a file that does not belong to a data folder. `about`: its
    manifest; `source`: its path, for the message."""
    for name in about.files:
        top, inner = name.split("/")[:2]
        if top == FILES and inner not in MERGED | WHOLE:
            raise CannotStart(f"{source} is damaged, or no backup of ours: {name!r} is in it.")


def _check_folder(data: Path, source: Path) -> None:
    """Raise CannotStart if the data folder has files of other programs and none of this one. The
    backup itself (`source`) may lie there."""
    strangers = [path for path in left_out(data) if path != source]
    if strangers and not any((data / name).exists() for name in (*_JOURNALS, *WHOLE, *_MARKS)):
        names = ", ".join(path.name for path in strangers[:3])
        raise CannotStart(
            f"{data} holds other things ({names}): name an empty folder, or one of this program."
        )


def _put(
    folder: Path, data: Path, url: str, about: BackupManifest, progress: Progress
) -> tuple[Path | None, list[str]]:
    """Move the unpacked parts from `folder` into the data folder, and the graphs to the database
    `url`. Return the folder with the replaced files, None if none was replaced, and the names of
    existing files that stayed instead of the backup's."""
    from action_assistant.editor.log import database_location, epochs

    mark, is_own = data / settings.RESTORING, database_location.is_own(data, url)
    has_graphs = "editor" in about.journals
    _begin(mark, folder, url, about, progress, elsewhere=has_graphs and not is_own)
    old = [f"{branch}.db" for branch in about.journals if branch == "runner" or is_own]
    aside: Path | None = None
    if any((data / name).exists() for name in old):
        aside = aside_folder(data)
    kept = [name for name in about.files if not _placed(folder, name, data)]
    for name in old:
        _replace_database(folder / name, data / name, aside)
    if has_graphs:
        (data / epochs.MARK).unlink(missing_ok=True)
        database_location.remember(data, url)
    mark.unlink()
    sync(data)
    return aside, kept


def _begin(
    mark: Path,
    folder: Path,
    url: str,
    about: BackupManifest,
    progress: Progress,
    *,
    elsewhere: bool,
) -> None:
    """Write the file `mark`, which says that a restore is under way; then, if `elsewhere`, copy the
    graphs of the backup into the database `url` in one transaction. `folder`: the unpacked backup;
    `about`: its manifest; `elsewhere`: the database is no file of the data folder. Do nothing if an
    interrupted restore has copied the graphs already. Raise CannotStart if the database cannot be
    read or the copy fails; `mark` is then as it was before the call."""
    from action_assistant.journal.copies.copying import copy

    before = _under(mark)
    if elsewhere and before is not None and _is_there(url, before, about):
        return  # an interrupted restore has done this already
    _write(mark, _end_of(folder, about))
    if not elsewhere:
        return
    staged = database_of(f"sqlite:///{folder / 'editor.db'}")
    tell = lambda count: progress.tell(f"editor: {count} events stored")  # noqa: E731
    try:
        copy(staged, database_of(url), branch="editor", fold=fold_of("editor"), tell=tell)
    except CannotStart:
        if before is None:
            mark.unlink()
        else:
            _write(mark, before)
        raise


def _under(mark: Path) -> RestoreUnderWay | None:
    try:
        return read_json(mark, RestoreUnderWay)
    except FileNotFoundError:
        return None
    except DamagedFile:
        return RestoreUnderWay("", 0, "")  # the interruption cut it short


def _end_of(folder: Path, about: BackupManifest) -> RestoreUnderWay:
    if "editor" not in about.journals:
        return RestoreUnderWay("", 0, "")
    row = rows_of(folder / "editor.db", _LAST)[0]
    return RestoreUnderWay(about.journals["editor"].sha256, row.position, bytes(row.chain).hex())


def _is_there(url: str, under: RestoreUnderWay, about: BackupManifest) -> bool:
    """Return whether the database at `url` already has the graphs of this backup (`about`), from a
    restore that was interrupted (`under`). Raise CannotStart if it cannot be read."""
    if "editor" not in about.journals or under.sha256 != about.journals["editor"].sha256:
        return False

    def last(connection: Connection) -> tuple[int, str] | None:
        if not inspect(connection).has_table(editor_event.name):
            return None
        row = connection.execute(_LAST).first()
        return None if row is None else (row.position, bytes(row.chain).hex())

    return ask_once(url, last) == (under.position, under.chain)


def _placed(folder: Path, name: str, data: Path) -> bool:
    """Move the unpacked file `name` from `folder` to its place in the data folder; return False if
    another file is there, which stays."""
    top, _, inner = name.partition("/")
    base = data if top == FILES else settings.keep(data).folder
    source, target = folder / name, base / inner
    whole = inner.split("/")[0]
    if top == FILES and whole in WHOLE and not (data / whole).exists():
        source, target = folder / FILES / whole, data / whole  # all of a folder at once
    if not source.exists():
        return True  # it went with its folder
    if target.exists():
        return target.is_file() and sha256_of(target) == sha256_of(source)
    if top == FILES and whole in WHOLE and target != data / whole:
        return False  # a folder is taken over as a whole or not at all
    for parent in reversed(target.parents):
        parent.mkdir(mode=0o700, exist_ok=True)
    _move(source, target)
    return True


def _move(source: Path, target: Path) -> None:
    """Move a file or folder to `target` atomically and durably, also to another disk."""
    part = source
    if source.stat().st_dev != target.parent.stat().st_dev:
        part = target.with_name(f".{target.name}.part")
        with source.open("rb") as there, open(part, "wb", opener=opener) as here:
            shutil.copyfileobj(there, here)
    for path in part.rglob("*") if part.is_dir() else [part]:
        sync(path)
    part.replace(target)
    sync(target.parent)


@contextmanager
def _locked(data: Path, branches: Iterable[Branch]) -> Iterator[None]:
    """Lock the journals of these branches against all other processes, even if they cannot be
    opened. Lock files that were made for a restore that fails are removed, while they are held.
    Raise CannotStart if another process has locked one of them."""
    from action_assistant.journal.sqlite import own

    made: list[Path] = []
    with ExitStack() as locks:
        try:
            for branch in branches:
                lock = data / f"{branch}.db.lock"
                is_new = not lock.exists()
                locks.callback(os.close, own(data / f"{branch}.db"))
                if is_new:
                    made.append(lock)
        except CannotStart as error:
            _removed(made)
            raise CannotStart(f"{error} End action-assistant first.") from error
        try:
            yield
        except BaseException:
            _removed(made)
            raise


def _removed(files: Iterable[Path]) -> None:
    for each in files:
        each.unlink(missing_ok=True)


def _replace_database(new: Path, old: Path, aside: Path | None) -> None:
    """Replace the database file `old` by `new` atomically, and remove the SQLite side files of
    `old`. First make hard links to `old` and its write-ahead log in the folder `aside`, except
    under names that it has already; None keeps nothing of the old database."""
    for path in (old, old.with_name(f"{old.name}-wal")):
        if aside is not None and path.exists() and not (aside / path.name).exists():
            os.link(path, aside / path.name)
    # Pages in an old write-ahead log must not be applied to the new file.
    for suffix in ("-wal", "-shm"):
        old.with_name(f"{old.name}{suffix}").unlink(missing_ok=True)
    sync(new)
    new.replace(old)
    sync(old.parent)


def _write(path: Path, content: msgspec.Struct) -> None:
    part = path.with_name(f".{path.name}.part")
    replace_file(path, msgspec.json.encode(content), part=part)
    sync(path.parent)


def _tell(about: BackupManifest, url: str, data: Path, aside: Path | None, kept: list[str]) -> None:
    from action_assistant.editor.log import database_location

    for branch, copied in about.journals.items():
        print(f"{branch}: as it was after {copied.events} events")
    if "editor" in about.journals and (about.database or not database_location.is_own(data, url)):
        before = about.database or "the data folder"
        here = (
            str(data / "editor.db")
            if database_location.is_own(data, url)
            else database_location.shown(url)
        )
        print(f"the graphs, which were in {before}, are in {here} now")
    if aside is not None:
        print(f"what was there before is in {aside}")
    for name in dict.fromkeys(_top(each) for each in kept):
        print(f"kept as it was, though the backup has another one: {name}")
    if f"{FILES}/{TOKEN_FILE}" in kept:
        print(
            f"Links and sessions of the backup do not open this server, which keeps its own token. "
            f"To have those of the backup, move {data / TOKEN_FILE} away and restore again."
        )
    for name, value in about.settings.items():
        print(f"it was made where {name}={value}")
    for each in about.missing:
        print(f"missing in the backup: {each}")


def _top(name: str) -> str:
    top, _, inner = name.partition("/")
    return inner.split("/")[0] if top == FILES else inner
