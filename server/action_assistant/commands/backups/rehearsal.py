"""`restore --rehearse`: restores a backup into a scratch place, looks at all that is in it as the program
would, and throws it away. Nothing of it is served, and no robot is spoken to."""

import asyncio
import errno
import logging
import sqlite3
import tempfile
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Final, TypeAlias

import msgspec
from sqlalchemy import func, select

from action_assistant.commands.backups import restore
from action_assistant.commands.backups.backup_file import ARCHIVE, FILES, NoRoom, Package
from action_assistant.commands.backups.data_folder import checked, fold_of, sweep, workshop
from action_assistant.commands.backups.progress import Progress
from action_assistant.errors import CannotStart, Refused
from action_assistant.journal.copies import backup_state
from action_assistant.journal.copies.backup_state import BackupRehearsed
from action_assistant.journal.database import Branch
from action_assistant.journal.foreign_schema import remove_strangers
from action_assistant.journal.journal import Journal
from action_assistant.schema import editor_tables, runner_tables
from action_assistant.web.auth.keys import TOKEN_FILE

_PREFIX: Final = ".rehearsal-"
_DISK: Final = frozenset({errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO})
#: Says how far it has come.
Tell: TypeAlias = Callable[[str], None]


class Findings:
    """The results of a rehearsal, as sentences: what was checked, and what is wrong."""

    def __init__(self) -> None:
        self.looked_at: list[str] = []
        self.wrong: list[str] = []
        self.made_at: float | None = None


def rehearse(source: Path, data: Path) -> int:
    """Unpack the backup file `source` into a scratch folder, verify it as a restore would, and
    print the findings; record them in the folder `data` if it exists. Return 0 if the backup is
    sound, else 1. Raise CannotStart if there is no such file or the disk of the scratch folder
    fails or is full."""
    if not source.is_file():
        raise CannotStart(f"There is no file {source}.")
    begun, at, progress, found = time.monotonic(), time.time(), Progress(), Findings()
    place = data if data.is_dir() else Path(tempfile.gettempdir())
    sweep(place, _PREFIX)
    logging.disable(logging.ERROR)  # what readers complain of is said below, once
    try:
        with workshop(place, _PREFIX) as folder:
            _look(source, folder, found, progress)
    except NoRoom:
        raise
    except CannotStart as error:
        if _is_of_the_disk(error):
            raise CannotStart(f"It cannot be told whether {source} is sound. {error}") from error
        found.wrong.append(str(error))
    finally:
        logging.disable(logging.NOTSET)
    progress.end()
    done = BackupRehearsed(
        at=at,
        file=str(source),
        bytes=source.stat().st_size,
        seconds=round(time.monotonic() - begun, 3),
        made_at=found.made_at,
        why=" ".join(found.wrong) or None,
    )
    if data.is_dir():
        backup_state.rehearsed(data, done)
    return _tell(found, done)


def _is_of_the_disk(error: BaseException | None) -> bool:
    """Return whether an error is the fault of the disk of the scratch folder, and not of the
    backup."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in _DISK:
            return True
        driver = getattr(error, "orig", error)
        if getattr(driver, "sqlite_errorcode", 0) & 0xFF in {
            sqlite3.SQLITE_FULL,
            sqlite3.SQLITE_IOERR,
        }:
            return True
        error = error.__cause__
    return False


def _tell(found: Findings, done: BackupRehearsed) -> int:
    for each in found.looked_at:
        print(each)
    for each in found.wrong:
        print(f"NOT sound: {each}")
    verdict = "is NOT sound" if found.wrong else "can be restored: all that was looked at is sound"
    print(f"{done.file} {verdict} ({done.bytes / 2**20:.1f} MiB, {done.seconds:.1f} s)")
    return 1 if found.wrong else 0


def _look(source: Path, folder: Path, found: Findings, progress: Progress) -> None:
    """Unpack the backup `source` into `folder`, verify all of it as a restore would, and add the
    results to `found`. Raise CannotStart if a part or a journal is damaged."""
    package = Package(source)
    try:
        about = package.about
        found.made_at = about.made_at
        restore.check_names(about, source)
        package.unpack(folder, progress)
    finally:
        package.close()
    found.looked_at.append(
        f"{len(about.files) + len(about.journals)} parts, each as it was written"
    )
    found.wrong += [f"missing in the backup: {each}" for each in about.missing]
    looks: dict[Branch, Callable[[Journal, Path, Findings, Tell], Awaitable[None]]] = {
        "editor": _look_at_graphs,
        "runner": _look_at_runs,
    }
    for branch, held in about.journals.items():
        path = folder / f"{branch}.db"
        found.wrong += [
            f"{branch}: this program has not made {each}; `restore` drops it."
            for each in remove_strangers(path, branch)
        ]
        events = checked(path, branch, progress, expected=held.events)
        found.looked_at.append(f"{branch}: {events} events, all of them sound")
        asyncio.run(_opened(path, branch, looks[branch], found, progress))
    token = folder / FILES / TOKEN_FILE
    if token.exists() and not token.read_text().strip():
        found.wrong.append("the token is empty, so that no link opens")


async def _opened(
    path: Path,
    branch: Branch,
    look: Callable[[Journal, Path, Findings, Tell], Awaitable[None]],
    found: Findings,
    progress: Progress,
) -> None:
    journal = await Journal.open(f"sqlite:///{path}", branch=branch, fold=fold_of(branch))
    try:
        await look(journal, path.parent, found, progress.tell)
    finally:
        await journal.close()


async def _look_at_graphs(journal: Journal, folder: Path, found: Findings, tell: Tell) -> None:
    """Read every document in the journal of the editor to its end, and check the digest of every
    version and every invitation; add the results to `found`. `tell`: is called with the progress.
    """
    from action_assistant.editor.crdt.loading import stored
    from action_assistant.editor.crdt.replica import ReplicaState
    from action_assistant.editor.documents import contents
    from action_assistant.editor.log.graph_events import graph_stream

    del folder
    graphs = await journal.query(select(editor_tables.graph).order_by(editor_tables.graph.c.id))
    for number, row in enumerate(graphs, 1):
        tell(f"graph {number} of {len(graphs)} is read")
        try:
            read = await stored(journal, graph_stream(row.id), learn=False)
            state = ReplicaState.state_of(read.document)
            contents.umrf(contents.GraphAtSeq(row.id, read.seq, state))
        except (Refused, ValueError) as error:
            found.wrong.append(f"graph {row.name!r} ({row.id}) cannot be read: {error}.")
            continue
        if read.damaged is not None:
            found.wrong.append(f"graph {row.name!r} ({row.id}): {read.damaged.why}.")
    versions = await _versions(journal, found, tell)
    counts = []
    for table, what in ((editor_tables.invitation, "links"), (editor_tables.person, "people")):
        (row,) = await journal.query(select(func.count().label("n")).select_from(table))
        counts.append(f"{row.n} {what}")
    for row in await journal.query(select(editor_tables.invitation)):
        if row.role not in {"viewer", "editor", "operator", "owner"}:
            found.wrong.append(f"the link {row.label!r} has the role {row.role!r}, which is none.")
    found.looked_at.append(f"{len(graphs)} graphs, {versions} versions, {', '.join(counts)}")


async def _versions(journal: Journal, found: Findings, tell: Tell) -> int:
    from action_assistant.editor.log.graph_events import VersionPublished
    from action_assistant.umrf.digest import digest
    from action_assistant.umrf.files import codec

    rows = await journal.query(select(editor_tables.version))
    for number, row in enumerate(rows, 1):
        tell(f"version {number} of {len(rows)} is read")
        try:
            (event,) = await journal.read(row.stream, after=row.event_seq - 1, upto=row.event_seq)
            published = msgspec.json.decode(event.body, type=VersionPublished)
            now = digest(codec.read(bytes(published.umrf)).graph)
        except (Refused, ValueError) as error:
            found.wrong.append(f"version {row.id} of graph {row.graph} cannot be read: {error}.")
            continue
        if now != row.digest:
            found.wrong.append(f"version {row.id} of graph {row.graph} has another digest.")
    return len(rows)


async def _look_at_runs(journal: Journal, folder: Path, found: Findings, tell: Tell) -> None:
    """Fold every run from its events, in the journal or an archive in `folder`; add the results to
    `found`. `tell`: is called with the progress."""
    from action_assistant.runner.archives.archive_store import ArchiveStore
    from action_assistant.runner.runs.history import RunHistory
    from action_assistant.web.workers.lanes import run_here

    run = runner_tables.run.c
    store = ArchiveStore(journal, folder / ARCHIVE, run_here)
    history = RunHistory(store)
    rows = await journal.query(select(run.id, run.number, run.archived_as).order_by(run.number))
    for number, row in enumerate(rows, 1):
        tell(f"run {number} of {len(rows)} is read")
        try:
            read, _ = await history.replayed(row.id)
            for piece in await store.pieces(row.id):  # of a led run
                await history.replayed(piece)
        except (Refused, ValueError) as error:
            found.wrong.append(f"run {row.number} cannot be read: {error}")
            continue
        if read is None:
            found.wrong.append(f"run {row.number} has no beginning.")
    (robots,) = await journal.query(
        select(func.count().label("n")).select_from(runner_tables.robot)
    )
    archived = sum(row.archived_as is not None for row in rows)
    found.looked_at.append(f"{len(rows)} runs, {archived} of them in archives, {robots.n} robots")
