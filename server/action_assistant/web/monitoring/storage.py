"""Measures disk space in the background, so that nobody waits for a disk."""

import logging
import os
import shutil
import time
from collections.abc import Awaitable, Callable, Iterator, Mapping
from pathlib import Path
from typing import Final

import anyio
import msgspec
from anyio import to_thread

from action_assistant.errors import Refused
from action_assistant.journal.copies.backup_state import BackupState, backup_state
from action_assistant.web.monitoring.backups import families
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
        """Look at the storage again and again until cancelled."""
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(self._watch_folders)
            while True:
                try:
                    await self.look()
                except Exception:  # whoever only watches must not end a process
                    self.found = None
                    log.exception("storage was not looked at")
                await anyio.sleep(_LOOK_S)

    async def look(self) -> None:
        """Look at the disk, the database and the backups once."""
        try:
            disk = await to_thread.run_sync(shutil.disk_usage, self._data, abandon_on_cancel=True)
        except OSError as error:
            log.warning("the disk of %s cannot be looked at: %s", self._data, error.strerror)
            self.found = None  # what was once so is not what is
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
        """Yield the newest numbers as metrics."""
        found = self.found
        if found is None:
            return
        yield from families(self.backups)
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
