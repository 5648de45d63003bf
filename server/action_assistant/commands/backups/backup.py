"""The commands `backup` and `restore`. Backups are made once, as cron calls it, or again and again beside the
processes; old ones go by a rule, and a command may take each finished one elsewhere."""

import argparse
import contextlib
import os
import select
import shlex
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import msgspec

from action_assistant import settings
from action_assistant.commands.backups import restore
from action_assistant.commands.backups.backup_file import ARCHIVE, FILES, Package
from action_assistant.commands.backups.data_folder import left_out, sweep
from action_assistant.commands.backups.making import WORK, FinishedBackup, make_backup
from action_assistant.commands.backups.options import (
    add_rules,
    moment_of,
    name_at,
    parse_retention,
    span,
    superfluous,
)
from action_assistant.commands.backups.progress import Progress
from action_assistant.commands.place import add_data, add_database
from action_assistant.errors import CannotStart
from action_assistant.journal.copies import backup_state
from action_assistant.journal.copies.backup_state import BackupSchedule, OffSite
from action_assistant.private_files import make_folder, opener
from action_assistant.system import posix
from action_assistant.system.parent import pipe_of_parent
from action_assistant.web.auth.keys import TOKEN_FILE

_LOCK: Final = ".action-assistant.lock"
_COMMAND_TIMEOUT_S: Final = 6 * 3600.0  # for the command that takes a backup elsewhere
_RETRY_S: Final = 15 * 60.0  # until a failed backup is tried again
_WAIT_FOR_JOURNALS_S: Final = 10.0  # until a folder without journals is read again
_JOURNALS: Final = ("editor.db", "editor.database", "runner.db")
_MOST_SAID: Final = 500  # characters of a command's output
_NICE: Final = 19  # the lowest priority


def _add_backup(backup: argparse.ArgumentParser) -> None:
    backup.epilog = (
        "example: action-assistant backup monday.zip --data ./data; "
        "action-assistant backup --into /backups --every 24h; exit code 1 if something is missing in "
        "it, or if it could not be taken elsewhere"
    )
    backup.add_argument("file", type=Path, nargs="?", metavar="FILE", help="the backup to write")
    add_data(backup)
    add_database(backup, "of the editor; default: the one that was served last")
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
    add_data(back)
    add_database(
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


class RegularBackups(msgspec.Struct, frozen=True):
    """The settings of regular backups: source, target folder, retention rule, and the command that
    is called with each finished backup."""

    data: Path
    database: str | None
    into: Path
    keep: str
    after: str | None


def back_up(plan: RegularBackups, progress: Progress) -> tuple[FinishedBackup, OffSite | None]:
    """Make a backup by `plan`, record its outcome in the data folder, and delete superfluous older
    backups. Return it, and how the command that takes it elsewhere ended, None if no such command
    is set. Raise CannotStart if the backup fails."""
    try:
        with _alone(plan.into):
            target = _free(plan.into)
            done = make_backup(plan.data, plan.database, target, progress)
            progress.end()
            off_site = _taken_away(plan.after, target)
            backup_state.made(plan.data, msgspec.structs.replace(done.made, off_site=off_site))
            if not done.made.missing:  # otherwise an older backup may have the missing part
                ours = (path for path in plan.into.iterdir() if not _is_anothers(path, done))
                for path in superfluous(ours, parse_retention(plan.keep), datetime.now(UTC)):
                    path.unlink(missing_ok=True)
    except (CannotStart, OSError) as error:
        why = str(error) if isinstance(error, CannotStart) else f"{plan.into}: {error.strerror}."
        backup_state.failed(plan.data, why)
        raise CannotStart(why) from error
    return done, off_site


def keep_making(plan: RegularBackups, every: float) -> int:
    """Make a backup every `every` seconds by `plan`, until SIGTERM or the end of the parent
    process; return the exit code. The process gets a low priority."""
    os.nice(_NICE)
    signal.signal(signal.SIGTERM, _end)
    parent = pipe_of_parent()
    due = _first(plan, every)
    try:
        while True:
            backup_state.scheduled(
                plan.data,
                BackupSchedule(into=str(plan.into), every=every, keep=plan.keep, next=due),
            )
            if not _wait_until(due, parent):
                return 0
            begun = time.time()
            if not any((plan.data / name).exists() for name in _JOURNALS):
                due = begun + min(
                    every, _WAIT_FOR_JOURNALS_S
                )  # the processes are only just starting
                continue
            try:
                done, off_site = back_up(plan, Progress())
            except CannotStart as error:
                due = time.time() + min(every, _RETRY_S)
                _say(f"no backup was made: {error} It is tried again in {due - time.time():.0f} s.")
                continue
            due = max(begun + every, time.time())
            _say(told(done, off_site))
    except KeyboardInterrupt:
        return 0


def told(done: FinishedBackup, off_site: OffSite | None) -> str:
    """Return the line to print about a finished backup. `off_site`: how the command that takes it
    elsewhere ended, None if no such command is set."""
    made = done.made
    text = f"backup {made.file}: {made.bytes / 2**20:.1f} MiB in {made.seconds:.1f} s, proven"
    if made.missing:
        text += f"; {len(made.missing)} missing: {' '.join(made.missing)}"
    if off_site is not None:
        text += f"; NOT taken elsewhere: {off_site.why}" if off_site.why else "; taken elsewhere"
    return text


@contextlib.contextmanager
def _alone(into: Path) -> Iterator[None]:
    """Return a context during which no other process makes a backup into the folder, and remove
    what a killed one has left there. Raise CannotStart if another process makes one now."""
    make_folder(into)
    lock = opener(str(into / _LOCK), os.O_RDWR | os.O_CREAT)
    try:
        if not posix.lock_file(lock):
            raise CannotStart(f"Another backup is just being made into {into}.")
        sweep(into, WORK)
        yield
    finally:
        os.close(lock)


def _free(into: Path) -> Path:
    """Return a file name, by the time, that no backup in the folder has yet; wait up to a second
    for one."""
    while (target := into / name_at(datetime.now(UTC))).exists():
        time.sleep(0.1)  # names tell the second
    return target


def _is_anothers(path: Path, done: FinishedBackup) -> bool:
    """Return whether the file `path` is a backup of another server, which has another token than in
    `done`. Servers may share a folder."""
    if moment_of(path) is None or not zipfile.is_zipfile(path):
        return False
    try:
        package = Package(path)
    except CannotStart:
        return True  # of a newer version, for one
    package.close()
    token = f"{FILES}/{TOKEN_FILE}"
    held, ours = package.about.files.get(token), done.files.get(token)
    return held is not None and held != ours


def _taken_away(command: str | None, path: Path) -> OffSite | None:
    """Run the command that takes a finished backup elsewhere, with the path of the backup as its
    last argument, and wait for its end; its output goes to the log. Return the result; None without
    a command."""
    if not command:
        return None
    begun = time.monotonic()
    why: str | None = None
    try:
        process = subprocess.Popen(
            [*shlex.split(command), str(path)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            said, _ = process.communicate(timeout=_COMMAND_TIMEOUT_S)
        except BaseException:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            raise
        if process.returncode:
            lines = said.decode(errors="replace").strip().splitlines()
            last = f": {lines[-1][:_MOST_SAID]}" if lines else " and said nothing"
            why = f"`{command}` ended with {process.returncode}{last}"
    except subprocess.TimeoutExpired:
        why = f"`{command}` did not end within {_COMMAND_TIMEOUT_S / 3600:.0f} hours"
    except (OSError, ValueError) as error:
        why = f"`{command}` cannot be run: {error}"
    return OffSite(round(time.monotonic() - begun, 3), why)


def _first(plan: RegularBackups, every: float) -> float:
    """Return when the first backup is due, in seconds since 1970: `every` seconds after the last
    backup if that still exists in the folder of the plan, else now; never a time in the past."""
    state = backup_state.backup_state(plan.data)
    last = state.last if state is not None else None
    if last is None or Path(last.file).parent != plan.into or not Path(last.file).exists():
        return time.time()
    return max(time.time(), min(last.at, time.time()) + every)


def _wait_until(due: float, parent: int | None) -> bool:
    """Wait until `due` (seconds since 1970). Return False if the parent process, which holds the
    other end of the pipe `parent`, ends first. It waits in slices, since clocks may be changed."""
    while (left := due - time.time()) > 0:
        ends = [] if parent is None else [parent]
        if select.select(ends, [], [], min(left, 60.0))[0]:
            return False
    return True


def _end(*_: object) -> None:
    raise KeyboardInterrupt


def _say(text: str) -> None:
    sys.stderr.write(f"action-assistant: {text}\n")
    sys.stderr.flush()
