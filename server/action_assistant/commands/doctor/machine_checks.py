"""This computer, and the data folder on it.

Of the computer: the program itself, its page, descriptors, the clock, shared memory. Of the folder: whose it
is, who can read it, how full its disk is, its backups, the archive and the token.
"""

import argparse
import difflib
import os
import re
import shutil
import sqlite3
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Final

from action_assistant import interpreter, paths, settings
from action_assistant.commands.backups import options
from action_assistant.commands.doctor.database_checks import has_events, oldest_at
from action_assistant.commands.doctor.installation import Installation
from action_assistant.editor.log import database_location
from action_assistant.editor.people.offline_links import OfflineLink
from action_assistant.errors import CannotStart
from action_assistant.journal.copies import backup_state as backups
from action_assistant.journal.copies.backup_state import BackupState, backup_state
from action_assistant.journal.databases import database_of
from action_assistant.logs import log_settings
from action_assistant.private_files import (
    DamagedFile,
    holds_nothing_else,
    of_others,
    open_to_others,
    read_json,
)
from action_assistant.runner.runs import sight
from action_assistant.system import posix
from action_assistant.system.diagnostics import Diagnostic, fine, found
from action_assistant.version import described
from action_assistant.web.auth import (
    confirmations,
    graph_seals,
    passkeys,
    people_files,
    released_versions,
    session_files,
    tokens,
    view_links,
)
from action_assistant.web.auth.graph_rules import Rule
from action_assistant.web.auth.keys import TOKEN_FILE, Keys
from action_assistant.web.notifications.receivers import receivers_of

_NAMED: Final = 5  # files in one sentence
_PREFIX: Final = "ACTION_ASSISTANT_"
#: The small files of both processes, by their place in the data folder, and what each holds.
_SMALL: Final[Mapping[str, type[object]]] = {
    f"{people_files.FOLDER}/*.json": people_files.PersonFile,
    f"{people_files.FOLDER}/groups.json": dict[str, str],
    f"{people_files.FOLDER}/links/*.json": OfflineLink,
    f"{session_files.FOLDER}/*.json": session_files.NotedSession,
    f"{confirmations.FOLDER}/*.json": confirmations.Confirmation,
    f"{passkeys.FOLDER}/*.json": passkeys.PasskeyFile,
    f"{tokens.FOLDER}/*.json": tokens.TokenRecord,
    f"{view_links.FOLDER}/*.json": view_links.ViewRecord,
    f"{released_versions.FOLDER}/*.json": released_versions.Release,
    graph_seals.FILE: graph_seals.Statement,
    sight.FILE: dict[str, tuple[int, Rule]],
}
_HOST: Final = re.compile(r"[A-Za-z0-9_.:\[\]-]+")


def settings_mean_something(place: Installation) -> Iterator[Diagnostic]:
    """Check the values of all environment variables of this program; yield the findings."""
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
    if not value.strip():
        return
    try:
        if name in _TEXT_READERS:
            _TEXT_READERS[name](value)
        elif name in _READERS:
            _READERS[name]({name: value})
    except CannotStart as error:
        yield found("setting-wrong", name, str(error), f"Correct or unset {name}.")
    except argparse.ArgumentTypeError as error:
        yield found("setting-wrong", name, f"{error}.", f"Correct or unset {name}.")


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


#: Read a setting out of its text.
_TEXT_READERS: Final[Mapping[str, Callable[[str], object]]] = {
    "ACTION_ASSISTANT_TOKEN": lambda value: Keys(value, "ACTION_ASSISTANT_TOKEN"),
    "ACTION_ASSISTANT_DATABASE": database_of,
    "ACTION_ASSISTANT_URL": _url,
    "ACTION_ASSISTANT_HOSTS": _hosts,
    "ACTION_ASSISTANT_PUBLIC_URL": lambda value: settings.reached(value, ""),
    "ACTION_ASSISTANT_TRUSTED_PROXIES": lambda value: settings.reached("", value),
    "ACTION_ASSISTANT_NOTIFICATIONS": lambda value: receivers_of(Path(value)),
    "ACTION_ASSISTANT_BACKUP_EVERY": options.span,
    "ACTION_ASSISTANT_BACKUP_KEEP": options.rule,
}
#: Read a setting out of an environment.
_READERS: Final[Mapping[str, Callable[[dict[str, str]], object]]] = {
    **{
        name: settings.take_secrets_from_files
        for name in settings.VARIABLES
        if name.endswith("_FILE")
    },
    "ACTION_ASSISTANT_PORT": settings.port,
    interpreter.VARIABLE: interpreter.for_runner,
    "ACTION_ASSISTANT_KEEP_RUNS": partial(settings.keep, Path()),
    "ACTION_ASSISTANT_KEEP_RAW": partial(settings.keep, Path()),
    "ACTION_ASSISTANT_AUDIT_DAYS": settings.audit_days,
    "ACTION_ASSISTANT_TOKEN_DAYS": settings.token_days,
    "ACTION_ASSISTANT_FRAME_ORIGINS": settings.frame_origins,
    "ACTION_ASSISTANT_LIMITS": settings.load_limits,
    "ACTION_ASSISTANT_WATCHDOG": settings.watchdog,
    "ACTION_ASSISTANT_LOG_FORMAT": lambda environ: log_settings(environ=environ),
    "ACTION_ASSISTANT_LOG_LEVEL": lambda environ: log_settings(environ=environ),
    "ACTION_ASSISTANT_METRICS_TOKEN": settings.metrics_token,
    "ACTION_ASSISTANT_METRICS_TOKEN_FILE": settings.metrics_token,
    settings.INDEX_FOLDERS: partial(settings.index_folders, ()),
}


_DESCRIPTORS: Final = 1024
_SHM: Final = Path("/dev/shm")
_SHM_MIB: Final = 32  # Fast DDS takes half a MiB for each process, and some for large messages
_ASSET: Final = re.compile(r'(?:src|href)="\.?/?(assets/[^"]+)"')


def program(place: Installation) -> Iterator[Diagnostic]:
    """Yield the versions of this program, of Python and of SQLite; never a fault."""
    del place
    python = f"{sys.version_info.major}.{sys.version_info.minor}.{sys.version_info.micro}"
    yield fine(
        "program",
        f"Version {described()} on Python {python} with SQLite {sqlite3.sqlite_version}.",
    )


def page_is_built(place: Installation) -> Iterator[Diagnostic]:
    """Check that the built page is there and complete and, in a checkout, not older than its
    sources. Yield the findings."""
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
    """Return a source file of the page that is newer than the built page (`built`: seconds since
    1970); None if no file is or this is no checkout."""
    sources = paths.page_sources()
    if sources is None:
        return None
    for folder, _, names in os.walk(sources):
        for each in (Path(folder, name) for name in names if ".test." not in name):
            if each.stat().st_mtime > built + 1:
                return each.relative_to(sources.parent)
    return None


def descriptors_suffice(place: Installation) -> Iterator[Diagnostic]:
    """Check that a process may have enough files and connections open; yield the finding."""
    del place
    most = posix.descriptors_allowed()
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
    """Check that the clock of this computer is not earlier than the files of this program; yield
    the finding. Other checks compare it with events and processes."""
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
    """Check that the shared memory that workers and ROS 2 use on Linux can be written and has
    space. Yield the findings."""
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


# --- the data folder ----------------------------------------------------------------------------

_WORTH_S: Final = 7 * 86_400.0  # seconds of use after which there should be a backup
_OLD_S: Final = 30 * 86_400.0
_BACK_UP: Final = "Make one: `action-assistant backup FILE`, and keep it elsewhere."
_LEAST_MIB: Final = 100
_SHOWN: Final = 5


def backups_are_made(place: Installation) -> Iterator[Diagnostic]:
    """Check that backups of the data folder exist and are not late; yield the findings."""
    state, where, now = backup_state(place.data), place.data / backups.FILE, time.time()
    if state is None:
        message = "What is known of backups cannot be read."
        yield found("backup-missing", where, message, f"Move the file away. {_BACK_UP}")
    elif state.last is None:
        used = _used_since(place)
        if used is not None and now - used > _WORTH_S:
            days = f"{(now - used) / 86_400:.0f} days"
            message = f"There is no backup, though this folder has been used for {days}."
            yield found("backup-missing", where, message, _BACK_UP)
        else:
            yield fine(where, "There is no backup yet.")
    elif trouble := _trouble(state, state.last.at, now):
        yield found("backup-old", where, trouble, _BACK_UP)
    else:
        yield fine(where, f"The last backup is of {_day(state.last.at)}.")


def _trouble(state: BackupState, last: float, now: float) -> str:
    """Return a sentence about what is wrong with the newest backup, made at `last` (seconds since
    1970, as `now`); "" if it is fine."""
    if state.failed is not None:
        return f"The last backup failed ({state.failed.why}); the newest is of {_day(last)}."
    if state.is_late(now) and state.schedule is not None:
        due = _day(state.schedule.next)
        return f"A backup was due on {due} and was not made; the newest is of {_day(last)}."
    if state.schedule is None and now - last > _OLD_S:
        return f"The newest backup is of {_day(last)}, and nobody makes them regularly."
    return ""


def _used_since(place: Installation) -> float | None:
    """Return the time of the first event in the SQLite databases of the editor and the runner, in
    seconds since 1970; None if there is no event. A database that cannot be read is skipped."""
    found_at: list[int] = []
    for name in ("editor.db", "runner.db"):
        file = place.data / name
        if not file.exists():
            continue
        try:
            database_of(f"sqlite:///{file}").look(
                lambda each: found_at.append(oldest_at(each) or 0) if has_events(each) else None
            )
        except CannotStart:  # reported by the checks of the databases
            continue
    return min(found_at) / 1e6 if found_at else None


def _day(at: float) -> str:
    return f"{datetime.fromtimestamp(at, UTC):%Y-%m-%d}"


def folder_is_ours(place: Installation) -> Iterator[Diagnostic]:
    """Check that the current user can use the data folder, and that no other user can. Yield the
    findings."""
    data = place.data
    if not data.exists():
        if blocked := _blocked(data):
            yield _unusable(data, blocked)
        else:
            yield fine(data, "The data folder is not there yet; serve makes it.")
        return
    if not data.is_dir() or not os.access(data, os.R_OK | os.W_OK | os.X_OK):
        yield _unusable(data, data)
        return
    strangers = of_others(data)
    if strangers:
        whose = posix.user_name(strangers[0].lstat().st_uid)
        owner = posix.user_name(data.stat().st_uid)
        yield found(
            "folder-of-others",
            data,
            f"{_listed(data, strangers)} {'is' if len(strangers) == 1 else 'are'} {whose}'s, the "
            f"folder is {owner}'s: this program was once started as another user.",
            f"Start it as {owner} only, and give the files back: sudo chown -R {owner} {data}",
        )
    yield from _readable(data)
    if not strangers:
        yield fine(data, "The data folder can be read and written.")


def _unusable(data: Path, why: Path) -> Diagnostic:
    if why.exists() and not why.is_dir():
        return found(
            "folder-unusable",
            data,
            f"{why} is no folder.",
            "Choose another data folder with --data, or move that file away.",
        )
    owner = posix.user_name(why.stat().st_uid) if why.exists() else "nobody"
    return found(
        "folder-unusable",
        data,
        f"{posix.own_name()} cannot read and write in {why}, which is {owner}'s.",
        f"Run this program as {owner}, mend the rights of the folder, or choose another with --data.",
    )


def _blocked(folder: Path) -> Path | None:
    """Return the file or link that prevents this program from creating a missing folder; None if
    there is no such obstacle."""
    above = next(each for each in folder.absolute().parents if each.exists())
    return None if above.is_dir() and os.access(above, os.W_OK | os.X_OK) else above


def _readable(data: Path) -> Iterator[Diagnostic]:
    exposed = open_to_others(data)
    token = data / TOKEN_FILE
    if token in exposed:
        yield found(
            "token-readable",
            token,
            "Other users of this computer may read the token, and sign in as the owner with it.",
            f"Run `chmod 600 {token}`; if others may have read it, delete it instead: the next start "
            "makes another, and links and sessions of the old one end.",
        )
    rest = [each for each in exposed if each != token]
    if not rest or not any(data.iterdir()):
        return  # the first start closes an empty folder, before anything is in it
    remedy = "The next start of this program closes them."
    if data in rest and not holds_nothing_else(data):
        remedy = (
            f"Run `chmod 700 {data}`, or move what else is in it; the start closes only our files."
        )
    yield found(
        "folder-readable",
        data,
        f"Other users of this computer can read {_listed(data, rest)}.",
        remedy,
    )


def _listed(data: Path, paths: list[Path]) -> str:
    """Return the first of the paths in one text, relative to the data folder, and how many more
    there are."""
    names = [str(path.relative_to(data)) if path != data else str(data) for path in paths]
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(names[:_SHOWN]) + more


def small_files_are_whole(place: Installation) -> Iterator[Diagnostic]:
    """Check that the files of persons, sessions, tokens, links and rules can be read. Yield the
    findings."""
    data = place.data
    kinds = {path: kind for name, kind in _SMALL.items() for path in sorted(data.glob(name))}
    broken = [
        f"{path.relative_to(data)} ({why})"
        for path, kind in kinds.items()
        if (why := _fault(path, kind))
    ]
    if not broken:
        yield fine(data, "The files of persons, sessions, tokens, links and rules can be read.")
        return
    more = f" and {len(broken) - _NAMED} more" if len(broken) > _NAMED else ""
    yield found(
        "file-unreadable",
        data,
        f"What these files say is not known: {', '.join(broken[:_NAMED])}{more}. Whoever they are about "
        "may look and stop, or less than before.",
        "Restore them from a backup, or move them away. The next start of the editor writes the files "
        "of persons, releases and graph-rules.json anew from its log.",
    )


def _fault(path: Path, kind: type[object]) -> str:
    """Return why a small file cannot be read; "" if it can, or is gone."""
    try:
        read_json(path, kind)
    except FileNotFoundError:
        return ""
    except OSError as error:
        return error.strerror or type(error).__name__
    except DamagedFile as error:
        return str(error)
    return ""


def token_is_there(place: Installation) -> Iterator[Diagnostic]:
    """Check that a data folder that was served has a token, unless the environment gives one. Yield
    the finding."""
    data, token = place.data, place.data / TOKEN_FILE
    served = any(
        (data / name).exists()
        for name in (database_location.JOURNAL, database_location.FILE, "runner.db")
    )
    if os.environ.get("ACTION_ASSISTANT_TOKEN"):
        yield fine("ACTION_ASSISTANT_TOKEN", "The token is the environment's.")
    elif not served and not token.exists():
        yield fine(token, "There is no token yet; serve makes it.")
    elif served and not token.exists():
        yield found(
            "token-missing",
            token,
            "The token is gone, though this folder was served: the next start makes another, with "
            "which no link and no session of before opens.",
            "Restore the file from a backup; or set ACTION_ASSISTANT_TOKEN here, if the server has "
            "its token from there; or start anew and send new links.",
        )
    else:
        try:
            Keys.known(data)
        except CannotStart as error:
            yield found(
                "token-unusable",
                token,
                str(error),
                "Restore the file from a backup, or delete it: the next start makes another, and links "
                "and sessions of the old one end.",
            )
        else:
            yield fine(token, "The token can be read.")


def nothing_was_interrupted(place: Installation) -> Iterator[Diagnostic]:
    """Yield a finding for a restore that was interrupted, after which no process of this program
    starts."""
    mark = place.data / settings.RESTORING
    if mark.exists():
        yield found(
            "restore-unfinished",
            mark,
            "A restore was interrupted, so the folder holds parts of a backup and nothing starts.",
            f"Run the same `action-assistant restore FILE --data {place.data}` again.",
        )


def archive_is_usable(place: Installation) -> Iterator[Diagnostic]:
    """Check that the folder of archives, if it exists, can be read and written, or else be created.
    Yield the findings."""
    try:
        folder = settings.keep(place.data).folder
    except CannotStart:  # reported with the settings
        return
    problem = ""
    if folder.exists():
        if not folder.is_dir():
            problem = f"{folder} is no folder"
        elif not os.access(folder, os.R_OK | os.W_OK | os.X_OK):
            problem = f"{posix.own_name()} cannot read and write in it"
    elif blocked := _blocked(folder):
        problem = f"it is not there, and cannot be made in {blocked}"
    if problem and folder != place.data / settings.ARCHIVE:
        yield found(
            "archive-unusable",
            folder,
            f"Runs cannot go into the archive: {problem}; archived runs do not open.",
            "Mount its disk or mend its rights, or name another folder in ACTION_ASSISTANT_ARCHIVE.",
        )
    elif problem and place.data.is_dir():
        yield found(
            "archive-unusable",
            folder,
            f"Runs cannot go into the archive: {problem}; archived runs do not open.",
            "Mend its rights, or move what stands in its place away.",
        )
    else:
        yield fine(folder, "The archive of runs can be used.")


def disk_has_room(place: Installation) -> Iterator[Diagnostic]:
    """Check the free space on the disks of the data folder and of the folder of archives; yield the
    findings."""
    folders = [place.data]
    with suppress(CannotStart):  # reported with the settings
        folders.append(settings.keep(place.data).folder)
    seen: set[int] = set()
    for folder in folders:
        above = next(each for each in (folder, *folder.absolute().parents) if each.exists())
        if above.stat().st_dev in seen:
            continue
        seen.add(above.stat().st_dev)
        free = shutil.disk_usage(above).free // 2**20
        if free < _LEAST_MIB:
            yield found(
                "disk-full",
                folder,
                f"Its disk has {free} MiB left: soon no edit can be saved and no run recorded.",
                "Make room there, move the data folder, or let older runs go into archives elsewhere "
                "(`action-assistant runs archive`, ACTION_ASSISTANT_ARCHIVE).",
            )
        else:
            yield fine(folder, f"Its disk has {free} MiB left.")
