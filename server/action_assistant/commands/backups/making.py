"""Makes a backup: copies what there is, proves it, packs it, and reads back what was packed."""

import os
import shutil
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import msgspec
from sqlalchemy import make_url, select, text

from action_assistant import settings
from action_assistant.commands.backups.backup_file import (
    ARCHIVE,
    FILES,
    BackupPart,
    JournalCopy,
    Package,
    Packer,
    about_now,
)
from action_assistant.commands.backups.data_folder import (
    archived,
    belongings,
    checked,
    fold_of,
    is_database,
    rows_of,
    tables_copied,
    workshop,
)
from action_assistant.commands.backups.progress import Progress
from action_assistant.errors import CannotStart
from action_assistant.journal.copies.backup_state import BackupMade
from action_assistant.journal.database import Branch
from action_assistant.journal.databases import ask_once, database_of
from action_assistant.journal.foreign_schema import remove_strangers
from action_assistant.journal.migrate import recognize
from action_assistant.schema.editor_tables import invitation
from action_assistant.version import VERSION
from action_assistant.web.auth.keys import TOKEN_FILE

WORK: Final = ".backup-"
#: The kinds of archives, as folders in the folder of archives.
_ARCHIVES: Final = ("runs", "raw")
#: Variables that the manifest of a backup never contains.
_SECRET: Final = frozenset(
    {"ACTION_ASSISTANT_TOKEN", "ACTION_ASSISTANT_DATABASE", "ACTION_ASSISTANT_METRICS_TOKEN"}
)
_ROOM: Final = 64 << 20  # bytes that have to be left on the disk


class FinishedBackup(msgspec.Struct, frozen=True):
    """A finished backup and its content. `strangers` names tables and other objects in the schema
    of a journal that are not this program's and are not in the backup."""

    made: BackupMade
    journals: Mapping[Branch, JournalCopy]
    files: Mapping[str, BackupPart]
    strangers: tuple[str, ...] = ()


def make_backup(
    data: Path, database: str | None, target: Path, progress: Progress
) -> FinishedBackup:
    """Write a backup of a data folder to the file `target`, and return its contents and findings.
    `database`: the URL of the graphs, None for the folder's own. Raise CannotStart if that fails;
    no file is left then."""
    begun, at, sources = time.monotonic(), time.time(), _sources(data, database)
    for source in sources.values():
        database_of(source).look(recognize)  # refuses a newer version's by its own name
    _check_room(data, sources, target.parent)
    with workshop(target.parent, WORK) as folder:
        events: dict[Branch, int] = {}
        strangers: list[str] = []
        for branch, source in sources.items():
            path = folder / f"{branch}.db"
            _copy(source, branch, path, progress)
            strangers += (f"{branch}: {each}" for each in remove_strangers(path, branch))
            events[branch] = checked(path, branch, progress)
        packer = Packer(folder, progress)
        try:
            journals = {
                branch: packer.journal(branch, folder / f"{branch}.db", count)
                for branch, count in events.items()
            }
            missing = _fill(packer, data, folder, progress)
            about = about_now(
                made_at=at,
                journals=journals,
                files=packer.files,
                database=_elsewhere(data, sources),
                settings=_settings(),
                missing=missing,
            )
            packer.close(about, target, lambda part: _read_back(part, progress))
        finally:
            packer.abandon()
    made = BackupMade(
        at=at,
        file=str(target),
        bytes=target.stat().st_size,
        seconds=round(time.monotonic() - begun, 3),
        version=VERSION,
        events={str(branch): count for branch, count in events.items()},
        missing=missing,
        proven=True,
    )
    return FinishedBackup(made, journals, packer.files, tuple(strangers))


def _sources(data: Path, database: str | None) -> dict[Branch, str]:
    from action_assistant.editor.log import database_location

    settings.settled(data)
    url = database_location.journal_of(data, database)
    sources: dict[Branch, str] = {} if url is None else {"editor": url}
    if (data / "runner.db").is_file():
        sources["runner"] = f"sqlite:///{data / 'runner.db'}"
    if not sources:
        raise CannotStart(f"There is no journal in {data}.")
    return sources


def _elsewhere(data: Path, sources: Mapping[Branch, str]) -> str | None:
    from action_assistant.editor.log import database_location

    url = sources.get("editor")
    if url is None or database_location.is_own(data, url):
        return None
    return database_location.shown(url)


def _check_room(data: Path, sources: Mapping[Branch, str], folder: Path) -> None:
    """Raise CannotStart if the disk of `folder` has too little free space for making a backup: a
    copy of each journal, and the packed file with the journals, archives and other files of the
    data folder `data`. `sources`: the database URL of each journal."""
    journals = sum(_size(source) for source in sources.values())
    kept = settings.keep(data).folder
    files = [path for top in _ARCHIVES for path in (kept / top).rglob("*.gz")]
    packed = sum(path.stat().st_size for path in (*files, *(path for _, path in belongings(data))))
    need = 2 * journals + packed + _ROOM
    try:
        free = shutil.disk_usage(folder).free
    except OSError as error:
        raise CannotStart(f"Cannot work in {folder}: {error.strerror}.") from error
    if need > free:
        raise CannotStart(
            f"A backup may need {need >> 20} MiB while it is made, and {folder} has {free >> 20} MiB "
            "left."
        )


def _size(source: str) -> int:
    if source.startswith("sqlite:"):
        path = Path(make_url(source).database or "")
        beside = path.with_name(f"{path.name}-wal")
        return sum(each.stat().st_size for each in (path, beside) if each.exists())
    whole = text("SELECT pg_database_size(current_database())")
    return int(ask_once(source, lambda connection: connection.execute(whole).scalar_one()))


def _read_back(part: Path, progress: Progress) -> None:
    """Raise CannotStart if the finished backup file `part` does not hold what was written."""
    package = Package(part)
    try:
        package.prove(progress)
    finally:
        package.close()


def _copy(source: str, branch: Branch, target: Path, progress: Progress) -> None:
    """Copy the journal at the URL `source`, as it is at one moment, into the SQLite file `target`."""
    from action_assistant.journal.copies.copying import copy

    target.touch(mode=0o600)
    if source.startswith("sqlite:"):
        tables_copied(Path(make_url(source).database or ""), target, branch, progress)
    else:
        copy(
            database_of(source),
            database_of(f"sqlite:///{target}"),
            branch=branch,
            fold=fold_of(branch),
            tell=lambda count: progress.tell(f"{branch}: {count} events read"),
        )


def _fill(packer: Packer, data: Path, folder: Path, progress: Progress) -> tuple[str, ...]:
    """Pack all files beside the journals, whose copies are in `folder`; return a sentence for each
    missing part. Archives come after the journals: a run that is archived meanwhile is then in
    both."""
    missing = []
    given = os.environ.get("ACTION_ASSISTANT_TOKEN")
    for name, path in belongings(data):
        if name == TOKEN_FILE and given:
            continue
        try:
            if is_database(path):
                copy = folder / "other.db"
                tables_copied(path, copy, name, progress)
                packer.file(f"{FILES}/{name}", copy)
                copy.unlink()
            else:
                packer.file(f"{FILES}/{name}", path)
        except FileNotFoundError:
            continue  # it was archived, or removed by retention
    if given:
        packer.text(f"{FILES}/{TOKEN_FILE}", f"{given}\n".encode())
    if f"{FILES}/{TOKEN_FILE}" not in packer.files and _links(folder / "editor.db"):
        missing.append(
            f"the token, by which links sign in: there is none in {data}. Set "
            "ACTION_ASSISTANT_TOKEN as for the server."
        )
    return (*missing, *_archives(packer, settings.keep(data).folder, folder / "runner.db"))


def _archives(packer: Packer, kept: Path, runner: Path) -> list[str]:
    """Add all archives in the folder `kept` to the backup. Return a sentence for each archive that
    is missing or altered but named in the copy of the runner's journal (`runner`)."""
    for path in sorted(path for top in _ARCHIVES for path in (kept / top).rglob("*.gz")):
        packer.file(f"{ARCHIVE}/{path.relative_to(kept).as_posix()}", path)
    missing = []
    for place, sha256 in archived(runner).items():
        held = packer.files.get(f"{ARCHIVE}/{place}")
        if held is None:
            missing.append(f"{place}, an archive: it is not in {kept}")
        elif held.sha256 != sha256:
            missing.append(f"{place}, an archive: it is not what was put into it")
    return missing


def _links(editor: Path) -> bool:
    """Return whether the copy of the editor's journal (`editor`) has invitations that were not
    revoked."""
    if not editor.exists():
        return False
    open_ = select(invitation.c.id).where(invitation.c.revoked_at.is_(None)).limit(1)
    return bool(rows_of(editor, open_))


def _settings() -> dict[str, str]:
    """Return the settings of the environment without the secret ones."""
    return {
        name: value
        for name in settings.VARIABLES
        if name not in _SECRET and (value := os.environ.get(name))
    }
