"""Compares the data folders of all editors of a database: sessions, tokens, passkeys and what was
ended are files in it (decision 175), so an editor with another folder would let people in whom the
others have put out.

Each editor puts an empty file with a random name into its folder, and writes this name beside its
slot. The others look for that file in theirs, and write which ones they have found. A copy of a
folder lacks the files of those who came later, so it is no other editor's folder, however alike it
is.
"""

import asyncio
import logging
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any, Final

from sqlalchemy import Connection, text

from action_assistant.errors import CannotStart, Refused
from action_assistant.journal.journal import Journal
from action_assistant.private_files import opener
from action_assistant.random_ids import random_id

log: Final = logging.getLogger(__name__)

_PREFIX: Final = ".probe-editor-"
_LOOK_S: Final = 0.3
_PATIENCE_S: Final = 15.0  # with the others
_OLD_S: Final = 86_400.0  # of files that nobody needs any more
_NOW: Final = "(extract(epoch FROM clock_timestamp()) * 1000000)::bigint"
_ALIVE_US: Final = 2_000_000  # since the last beat of an editor that counts
_SHOW: Final = text("UPDATE editor SET mark = :mark, met = '' WHERE slot = :slot")
_MEET: Final = text("UPDATE editor SET met = :met WHERE slot = :slot AND mark = :mark")
_ALL: Final = text(
    "SELECT url, mark, coalesce(met, '') AS met FROM editor WHERE mark IS NOT NULL AND"
    f" (mark = :mark OR beat_at > {_NOW} - {_ALIVE_US}) ORDER BY slot"
)


@asynccontextmanager
async def in_one_folder(journal: Journal, data: Path) -> AsyncIterator[None]:
    """Return a context during which other editors find out that this one has their data folder
    (`data`). Raise CannotStart if a living one has another folder, Unavailable if the database does
    not answer."""
    folder = _Folder(journal, data)
    try:
        await asyncio.to_thread(folder.prepare)
    except OSError as error:
        raise CannotStart(f"Cannot write to the data folder {data}: {error.strerror}.") from error
    try:
        await folder.compare()
        task = asyncio.create_task(folder.keep_looking(), name="data folder")
        try:
            yield
        finally:
            task.cancel()
            await asyncio.wait([task])
    finally:
        await asyncio.to_thread(folder.leave)


class _Folder:
    def __init__(self, journal: Journal, data: Path) -> None:
        self._journal = journal
        self._data = data
        self._mark = random_id()
        self._path = data / f"{_PREFIX}{self._mark}"

    def prepare(self) -> None:
        """Put the file of this editor into the folder. Raise OSError if that fails."""
        for path in self._data.glob(f"{_PREFIX}*"):
            with suppress(OSError):
                if time.time() - path.stat().st_mtime > _OLD_S and path.name != self._path.name:
                    path.unlink()
        with open(self._path, "xb", opener=opener):
            pass

    def leave(self) -> None:
        """Remove the file of this editor."""
        with suppress(OSError):
            self._path.unlink()

    async def compare(self) -> None:
        """Wait until all living editors have found the file of this one."""
        await self._write(_SHOW, {"mark": self._mark})
        patience = time.monotonic() + _PATIENCE_S
        while missing := await self.look():
            if time.monotonic() > patience:
                raise CannotStart(
                    f"The editor at {missing[0]} does not find {self._path}, which this one has just "
                    "written. All editors of one database need the same data folder: start them with "
                    "the same --data, and on several computers share that folder over the network."
                )
            await asyncio.sleep(_LOOK_S)

    async def keep_looking(self) -> None:
        """Look for the files of editors that come."""
        while True:
            await asyncio.sleep(_LOOK_S)
            try:
                await self.look()
            except Refused as error:  # nobody can come while the database is away
                log.info("it cannot be read which editors there are: %s", error.detail)

    async def look(self) -> list[str]:
        """Write which editors have this folder, and return the URLs of those that have not found
        the file of this one. Raise Unavailable if the database does not answer."""
        rows = await self._journal.ask(
            lambda connection: connection.execute(_ALL, {"mark": self._mark}).all()
        )
        ours = next((row for row in rows if row.mark == self._mark), None)
        if ours is None:  # it has another slot by now
            await self._write(_SHOW, {"mark": self._mark})
        others = [row for row in rows if row is not ours]
        found = await asyncio.to_thread(self._found, [row.mark for row in others])
        if ours is not None and ours.met != found:
            await self._write(_MEET, {"mark": self._mark, "met": found})
        return [row.url for row in others if self._mark not in row.met.split()]

    def _found(self, marks: list[str]) -> str:
        return " ".join(sorted(each for each in marks if self._has(each)))

    def _has(self, mark: str) -> bool:
        return (self._data / f"{_PREFIX}{mark}").exists()

    async def _write(self, statement: Any, values: dict[str, Any]) -> None:
        def write(connection: Connection) -> None:
            connection.execute(statement, {**values, "slot": self._journal.slot})

        await self._journal.derive(write)
