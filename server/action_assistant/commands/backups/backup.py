"""Commands that keep a copy of everything and bring it back: backup; restore is beside it."""

import argparse
import sys
from pathlib import Path
from typing import Final

from action_assistant import paths, settings
from action_assistant.commands.backups import restore
from action_assistant.commands.backups.backup_file import ARCHIVE, FILES
from action_assistant.commands.backups.data_folder import left_out
from action_assistant.commands.backups.making import FinishedBackup, make_backup
from action_assistant.commands.backups.options import add_rules, span
from action_assistant.commands.backups.progress import Progress
from action_assistant.commands.backups.regular import RegularBackups, back_up, keep_making
from action_assistant.errors import CannotStart
from action_assistant.journal.copies import backup_state
from action_assistant.journal.copies.backup_state import OffSite
from action_assistant.web.auth.keys import TOKEN_FILE


def _add_backup(backup: argparse.ArgumentParser) -> None:
    backup.epilog = (
        "example: action-assistant backup monday.zip --data ./data; "
        "action-assistant backup --into /backups --every 24h; exit code 1 if something is missing in "
        "it, or if it could not be taken elsewhere"
    )
    backup.add_argument("file", type=Path, nargs="?", metavar="FILE", help="the backup to write")
    _add_data(backup)
    _add_database(backup, "of the editor; default: the one that was served last")
    backup.add_argument(
        "--into",
        type=Path,
        metavar="DIR",
        help="write it there, named by its time, instead of to FILE, and let old ones go",
    )
    add_rules(backup, "--")
    backup.add_argument(
        "--every",
        type=span,
        metavar="TIME",
        help="stay, and make one so often (30m, 24h, 7d); beside `editor` and `runner`",
    )
    backup.set_defaults(handler=_backup)


def _add_restore(back: argparse.ArgumentParser) -> None:
    back.epilog = (
        "example: action-assistant restore monday.zip --data ./data; "
        "action-assistant restore --rehearse monday.zip"
    )
    back.add_argument("file", type=Path, metavar="FILE")
    _add_data(back)
    _add_database(
        back,
        "where the graphs shall be, an empty database; default: where those of the folder are",
    )
    back.add_argument(
        "--rehearse",
        action="store_true",
        help="restore it into a scratch place, look at all that is in it, and throw that away; "
        "exit code 1 if it is not sound",
    )
    back.set_defaults(handler=_restore)


COMMANDS: Final = {"backup": _add_backup, "restore": _add_restore}


def _add_data(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--data", type=Path, default=paths.data(), metavar="DIR", help="default: %(default)s"
    )


def _add_database(command: argparse.ArgumentParser, text: str) -> None:
    command.add_argument("--database", metavar="URL", default=settings.database(), help=text)


def _backup(options: argparse.Namespace) -> int:
    data = options.data.resolve()
    into = options.into or (Path(found) if (found := settings.backup_rule("TO")) else None)
    if options.file is not None and (options.into is not None or options.every is not None):
        raise CannotStart("Name a FILE, or a folder by --into, and not both.")
    if options.file is not None:
        return _once(data, options.database, options.file.resolve())
    if into is None:
        raise CannotStart("Name the file of the backup, or a folder by --into DIR.")
    plan = RegularBackups(data, options.database, into.resolve(), options.keep, options.after)
    if options.every is not None:
        return keep_making(plan, options.every)
    progress = Progress()
    done, off_site = back_up(plan, progress)
    return _tell(done, data, off_site)


def _once(data: Path, database: str | None, target: Path) -> int:
    progress = Progress()
    try:
        done = make_backup(data, database, target, progress)
    except CannotStart as error:
        if data.is_dir():
            backup_state.failed(data, str(error))
        raise
    backup_state.made(data, done.made)
    progress.end()
    return _tell(done, data, None)


def _restore(options: argparse.Namespace) -> int:
    if not options.rehearse:
        return restore.restore(options)
    from action_assistant.commands.backups import rehearsal  # loads all that reads graphs and runs

    return rehearsal.rehearse(options.file.resolve(), options.data.resolve())


def _tell(done: FinishedBackup, data: Path, off_site: OffSite | None) -> int:
    for branch, copied in done.journals.items():
        print(f"{branch}: {copied.events} events, all of them sound")
    if "editor" not in done.journals:
        print(f"editor: {data} holds no graphs, and no other database is known to hold any")
    for folder, what in ((ARCHIVE, "archives"), (FILES, "other files")):
        found = [held for name, held in done.files.items() if name.startswith(f"{folder}/")]
        if found:
            print(f"{what}: {len(found)}, {sum(held.bytes for held in found)} bytes")
    made = done.made
    print(f"written to {made.file} and read back: {made.bytes} bytes in {made.seconds:.1f} s")
    if f"{FILES}/{TOKEN_FILE}" in done.files:
        print(
            "It holds the keys of this server: whoever reads it can sign in as its owner. "
            "Only you can read it; keep it so."
        )
    if off_site is not None and off_site.why is None:
        print(f"taken elsewhere in {off_site.seconds:.1f} s")
    for path in left_out(data):
        if path != Path(made.file):
            print(f"left out, since it is not this program's: {path}", file=sys.stderr)
    for each in done.strangers:
        print(f"left out, since it is not this program's: {each}", file=sys.stderr)
    for each in made.missing:
        print(f"missing: {each}")
    if off_site is not None and off_site.why is not None:
        print(f"NOT taken elsewhere: {off_site.why}", file=sys.stderr)
        return 1
    return 1 if made.missing else 0
