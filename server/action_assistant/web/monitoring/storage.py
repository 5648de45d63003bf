"""Measures disk space, and reads the state of backups, in the background: nobody waits for a disk."""

import logging
import os
import shutil
import time
from collections.abc import Awaitable, Callable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import anyio
import msgspec
from anyio import to_thread

from action_assistant.errors import Refused
from action_assistant.journal.copies.backup_state import BackupState, backup_state
from action_assistant.web.monitoring.gauges import Family
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

_LOOK_S: Final = 15.0
_FOLDERS_S: Final = 300.0  # between two looks into folders, which may hold many files


class Storage(msgspec.Struct, frozen=True, kw_only=True):
    """Bytes, as they were at `at` (seconds since 1970). `database` and `wal` are missing where they could
    not be asked for; `folders` until they were looked into."""

    at: float
    free: int
    size: int
    database: int | None = None
    wal: int | None = None
    folders: Mapping[str, int] = {}


class StorageWatch:
    """Measures disk, database and folders periodically. `folders`: paths by the name that people
    read; they are counted in a worker. `backups`: also read the state of backups."""

    def __init__(
        self,
        data: Path,
        database: Callable[[], Awaitable[Mapping[str, int]]],
        folders: Mapping[str, Path],
        run_in_worker: RunInWorker,
        *,
        backups: bool,
    ) -> None:
        self.found: Storage | None = None
        self.backups: BackupState | None = None
        self._reads_backups = backups
        self._data = data
        self._database = database
        self._folders = folders
        self._run_in_worker = run_in_worker
        self._counted: Mapping[str, int] = {}

    async def run(self) -> None:
        """Measure the storage periodically until cancelled."""
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(self._watch_folders)
            while True:
                try:
                    await self.look()
                except Exception:  # a fault in monitoring must not end a process
                    self.found = None
                    log.exception("storage was not looked at")
                await anyio.sleep(_LOOK_S)

    async def look(self) -> None:
        """Measure the disk, the database and the backups once, and keep the result in `found`.
        `found` becomes None if the disk cannot be measured."""
        try:
            disk = await to_thread.run_sync(shutil.disk_usage, self._data, abandon_on_cancel=True)
        except OSError as error:
            log.warning("the disk of %s cannot be looked at: %s", self._data, error.strerror)
            self.found = None  # an old measurement says nothing about now
            return
        if self._reads_backups:
            self.backups = await to_thread.run_sync(backup_state, self._data)
        used: Mapping[str, int] = {}
        try:
            with anyio.move_on_after(_LOOK_S):
                used = await self._database()
        except (Refused, OSError) as error:
            log.debug("the size of the database is not known: %s", error)
        self.found = Storage(
            at=time.time(),
            free=disk.free,
            size=disk.total,
            database=used.get("database"),
            wal=used.get("wal"),
            folders=self._counted,
        )

    async def _watch_folders(self) -> None:
        while self._folders:
            try:
                self._counted = await self._run_in_worker(bytes_below, dict(self._folders))
            except Refused as error:
                log.warning("folders were not counted: %s", error.detail)
            except Exception:
                log.exception("folders were not counted")
            await anyio.sleep(_FOLDERS_S)

    def families(self) -> Iterator[Family]:
        """Yield the newest measurement as metrics."""
        found = self.found
        if found is None:
            return
        yield from backup_families(self.backups)
        yield Family("disk_free_bytes", "Room left on the disk of the data folder.", found.free)
        yield Family("disk_size_bytes", "Size of the disk of the data folder.", found.size)
        if found.database is not None:
            yield Family("database_bytes", "Size of the database of this process.", found.database)
        if found.wal is not None:
            yield Family("database_wal_bytes", "Size of the write-ahead log beside it.", found.wal)
        yield Family(
            "folder_bytes",
            "Size of what is kept beside the database, counted each five minutes.",
            {(name,): size for name, size in found.folders.items()},
            ("folder",),
        )


def bytes_below(folders: Mapping[str, Path]) -> dict[str, int]:
    """Return the total size of all files in each folder, in bytes, by the name of the folder. A
    folder that does not exist has 0 bytes."""
    return {name: sum(_sizes(path)) for name, path in folders.items()}


def _sizes(folder: Path) -> Iterator[int]:
    for at, _, names in os.walk(folder):
        for name in names:
            try:
                yield os.lstat(os.path.join(at, name)).st_size  # noqa: PTH118 - many files
            except OSError:
                continue  # gone meanwhile


class BackupsShown(msgspec.Struct, frozen=True, kw_only=True):
    """The last backup and what it lacks, the failure since then, the last restore rehearsal, and
    when the next backup is due. Fields are null where there was none."""

    made_at: datetime | None = None
    bytes: int | None = None
    seconds: float | None = None
    missing: tuple[str, ...] = ()
    off_site: str | None = None
    failed_at: datetime | None = None
    failed_why: str | None = None
    proven_at: datetime | None = None
    unsound: str | None = None
    next_at: datetime | None = None
    keep: str | None = None
    is_late: bool = False


def backups_shown(state: BackupState | None) -> BackupsShown | None:
    """Return the state of backups in the form for people; None if it cannot be read, which does not
    mean that no backups exist."""
    if state is None:
        return None
    last, failed, schedule = state.last, state.failed, state.schedule
    return BackupsShown(
        made_at=_time(last.at if last else None),
        bytes=last.bytes if last else None,
        seconds=last.seconds if last else None,
        missing=last.missing if last else (),
        off_site=last.off_site.why if last and last.off_site else None,
        failed_at=_time(failed.at if failed else None),
        failed_why=failed.why if failed else None,
        proven_at=_time(state.proven.at if state.proven else None),
        unsound=state.rehearsed.why if state.rehearsed else None,
        next_at=_time(schedule.next if schedule else None),
        keep=schedule.keep if schedule else None,
        is_late=state.is_late(time.time()),
    )


def backup_families(state: BackupState | None) -> Iterator[Family]:
    """Yield the metrics of backups, without those of events that never happened; no metrics if the
    state is not known (None)."""
    if state is None:
        return
    if (last := state.last) is not None:
        yield Family("backup_last_timestamp_seconds", "When the last backup was begun.", last.at)
        yield Family("backup_last_bytes", "Size of the last backup.", last.bytes)
        yield Family("backup_last_duration_seconds", "How long it took.", last.seconds)
        away = last.off_site is not None and last.off_site.why is not None
        yield Family("backup_off_site_failed", "1 if it could not be taken elsewhere.", away)
    if state.proven is not None:
        told = "When a backup was last restored for a trial, and sound."
        yield Family("backup_proven_timestamp_seconds", told, state.proven.at)
    if state.last is not None or state.failed is not None or state.schedule is not None:
        failed = state.failed is not None
        yield Family("backup_failed", "1 if the newest backup came to nothing.", failed)
    if state.schedule is not None:
        late = state.is_late(time.time())
        yield Family("backup_late", "1 if a backup should have been made by now.", late)


def _time(seconds: float | None) -> datetime | None:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC)
