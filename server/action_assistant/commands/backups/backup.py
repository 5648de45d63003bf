"""Commands that keep a copy of everything and bring it back: backup; restore is beside it."""

import argparse
import os
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from sqlalchemy import make_url, select

from action_assistant import paths, settings
from action_assistant.commands.backups import restore
from action_assistant.commands.backups.backup_file import (
    ARCHIVE,
    FILES,
    JournalCopy,
    Packer,
    about_now,
)
from action_assistant.commands.backups.data_folder import (
    archived,
    belongings,
    checked,
    fold_of,
    is_database,
    left_out,
    rows_of,
    tables_copied,
    workshop,
)
from action_assistant.commands.backups.progress import Progress
from action_assistant.errors import CannotStart
from action_assistant.journal.database import Branch
from action_assistant.journal.databases import database_of
from action_assistant.schema.editor_tables import invitation
from action_assistant.web.auth.keys import TOKEN_FILE

#: What archives are of, in their folder.
_ARCHIVES: Final = ("runs", "raw")
#: Of the environment, and never in what a backup says of itself.
_SECRET: Final = frozenset(
    {"ACTION_ASSISTANT_TOKEN", "ACTION_ASSISTANT_DATABASE", "ACTION_ASSISTANT_METRICS_TOKEN"}
)


def _add_backup(backup: argparse.ArgumentParser) -> None:
    backup.epilog = (
        "example: action-assistant backup monday.zip --data ./data; exit code 1 if something "
        "is missing in it"
    )
    _add_places(backup, "of the editor; default: the one that was served last")
    backup.set_defaults(handler=_backup)


def _add_restore(back: argparse.ArgumentParser) -> None:
    back.epilog = "example: action-assistant restore monday.zip --data ./data"
    _add_places(
        back,
        "where the graphs shall be, an empty database; default: where those of the folder are",
    )
    back.set_defaults(handler=restore.restore)


def _add_places(command: argparse.ArgumentParser, database: str) -> None:
    command.add_argument("file", type=Path, metavar="FILE")
    command.add_argument(
        "--data", type=Path, default=paths.data(), metavar="DIR", help="default: %(default)s"
    )
    command.add_argument("--database", metavar="URL", default=settings.database(), help=database)


COMMANDS: Final = {"backup": _add_backup, "restore": _add_restore}


def _backup(options: argparse.Namespace) -> int:
    from action_assistant.editor.log import database_location

    data, target = options.data.resolve(), options.file.resolve()
    settings.settled(data)
    progress = Progress()
    url = database_location.journal_of(data, options.database)
    sources: dict[Branch, str] = {} if url is None else {"editor": url}
    if (data / "runner.db").is_file():
        sources["runner"] = f"sqlite:///{data / 'runner.db'}"
    if not sources:
        raise CannotStart(f"There is no journal in {data}.")
    with workshop(target.parent, ".backup-") as folder:
        events = {
            branch: _copied(source, branch, folder / f"{branch}.db", progress)
            for branch, source in sources.items()
        }
        packer = Packer(folder, progress)
        try:
            journals = {
                branch: packer.journal(branch, folder / f"{branch}.db", count)
                for branch, count in events.items()
            }
            missing = _fill(packer, data, folder, progress)
            about = about_now(
                made_at=time.time(),
                journals=journals,
                files=packer.files,
                database=None
                if url is None or database_location.is_own(data, url)
                else database_location.shown(url),
                settings=_settings(),
                missing=missing,
            )
            packer.close(about, target)
        finally:
            packer.abandon()
    progress.end()
    _tell(journals, packer, target, data)
    for each in missing:
        print(f"missing: {each}")
    return 1 if missing else 0


def _copied(source: str, branch: Branch, target: Path, progress: Progress) -> int:
    """A journal as it is at one moment, in a SQLite file; its events, all of which are sound."""
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
    return checked(target, branch, progress)


def _fill(packer: Packer, data: Path, folder: Path, progress: Progress) -> tuple[str, ...]:
    """Everything beside the journals, whose copies are in `folder`; what is missing, in sentences.
    Archives come after the journals: a run that goes into one meanwhile is in both."""
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
            continue  # it went into an archive, or was kept long enough
    if given:
        packer.text(f"{FILES}/{TOKEN_FILE}", f"{given}\n".encode())
    if f"{FILES}/{TOKEN_FILE}" not in packer.files and _links(folder / "editor.db"):
        missing.append(
            f"the token, by which links sign in: there is none in {data}. Set "
            "ACTION_ASSISTANT_TOKEN as for the server."
        )
    return (*missing, *_archives(packer, settings.keep(data).folder, folder / "runner.db"))


def _archives(packer: Packer, kept: Path, runner: Path) -> list[str]:
    """Take in all archives; those that the journal names and that are not as it says."""
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
    """Whether there are links that let people in."""
    if not editor.exists():
        return False
    open_ = select(invitation.c.id).where(invitation.c.revoked_at.is_(None)).limit(1)
    return bool(rows_of(editor, open_))


def _settings() -> dict[str, str]:
    """What the environment says, but for what is secret."""
    return {
        name: value
        for name in settings.VARIABLES
        if name not in _SECRET and (value := os.environ.get(name))
    }


def _tell(journals: Mapping[Branch, JournalCopy], packer: Packer, target: Path, data: Path) -> None:
    for branch, copied in journals.items():
        print(f"{branch}: {copied.events} events, all of them sound")
    if "editor" not in journals:
        print(f"editor: {data} holds no graphs, and no other database is known to hold any")
    for folder, what in ((ARCHIVE, "archives"), (FILES, "other files")):
        found = [held for name, held in packer.files.items() if name.startswith(f"{folder}/")]
        if found:
            print(f"{what}: {len(found)}, {sum(held.bytes for held in found)} bytes")
    print(f"written to {target}")
    if f"{FILES}/{TOKEN_FILE}" in packer.files:
        print(
            "It holds the keys of this server: whoever reads it can sign in as its owner. "
            "Only you can read it; keep it so."
        )
    for path in left_out(data):
        if path != target:
            print(f"left out, since it is not this program's: {path}", file=sys.stderr)
