"""Compares the data folders of all editors of a database: sessions, tokens, passkeys and what was
ended are files in it (decision 175), so an editor with another folder would let people in whom the
others have put out.

Each editor puts an empty file with a random name into its folder, and writes this name beside its
slot. The others look for that file in theirs, and write which ones they have found. A copy of a
folder lacks the files of those who came later, so it is no other editor's folder, however alike it
is.

An editor with another folder may have started while those that would have refused it were frozen or
cut off. It ends once they live again: of two editors the one that has a copy, which is the one that
finds the file of the other and whose own is not found, and else the one that came later.
"""

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any, Final

from sqlalchemy import Connection, text

from action_assistant.errors import CannotStart, Refused
from action_assistant.journal.journal import Journal
from action_assistant.journal.postgres import HELD_SLOT
from action_assistant.private_files import opener
from action_assistant.random_ids import random_id

log: Final = logging.getLogger(__name__)

_PREFIX: Final = ".probe-editor-"
_LOOK_S: Final = 0.3
_PATIENCE_S: Final = 15.0  # with the others
#: Looks at which another editor has not found our file, one after the other, until this one ends. They are
#: counted, since the time also goes on for a process that is frozen.
_LOOKS: Final = round(_PATIENCE_S / _LOOK_S)
_OLD_S: Final = 86_400.0  # of files that nobody needs any more
_NOW: Final = "(extract(epoch FROM clock_timestamp()) * 1000000)::bigint"
_ALIVE_US: Final = 2_000_000  # since the last beat of an editor that counts
_TIME: Final = text(f"SELECT {_NOW}")
_SHOW: Final = text("UPDATE editor SET mark = :mark, met = '' WHERE slot = :slot")
_MEET: Final = text("UPDATE editor SET met = :met WHERE slot = :slot AND mark = :mark")
_ALL: Final = text(
    "SELECT url, mark, coalesce(met, '') AS met FROM editor WHERE mark IS NOT NULL AND"
    f" (mark = :mark OR (beat_at > {_NOW} - {_ALIVE_US} AND {HELD_SLOT.format('slot')})) ORDER BY slot"
)


@asynccontextmanager
async def in_one_folder(
    journal: Journal, data: Path, give_up: Callable[[CannotStart], object]
) -> AsyncIterator[None]:
    """Return a context during which other editors find out that this one has their data folder
    (`data`). Raise CannotStart if a living one has another folder, Unavailable if the database does
    not answer. `give_up`: called with the reason if this editor has to end for that later."""
    now = await journal.ask(lambda connection: connection.execute(_TIME).scalar_one())
    folder = _Folder(journal, data, now)
    try:
        await asyncio.to_thread(folder.prepare)
    except OSError as error:
        raise CannotStart(f"Cannot write to the data folder {data}: {error.strerror}.") from error
    try:
        await folder.compare()
        task = asyncio.create_task(folder.keep_looking(give_up), name="data folder")
        try:
            yield
        finally:
            task.cancel()
            await asyncio.wait([task])
    finally:
        await asyncio.to_thread(folder.leave)


class _Folder:
    """The data folder of one editor, which came at the time `now` (µs) by the clock of the database."""

    def __init__(self, journal: Journal, data: Path, now: int) -> None:
        self._journal = journal
        self._data = data
        self._mark = f"{now:017}-{random_id()}"  # in order of time
        self._path = self._path_of(self._mark)
        self._known: frozenset[str] = frozenset()  # the marks found at the last look
        self._is_read = True

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
                raise self._not_found_by(next(iter(missing.values())))
            await asyncio.sleep(_LOOK_S)

    async def keep_looking(self, give_up: Callable[[CannotStart], object]) -> None:
        """Look for the files of editors that come. If one that lives does not find the file of this one
        and it is for this one to end, call `give_up` and return."""
        missed: dict[str, int] = {}
        while True:
            await asyncio.sleep(_LOOK_S)
            try:
                missing = await self.look()
            except Refused as error:  # nobody can come while the database is away
                log.info("it cannot be read which editors there are: %s", error.detail)
                continue
            # A fault must not end the loop: no editor could start beside this one any more.
            except Exception:
                log.exception("the data folder cannot be compared with those of other editors")
                continue
            missed = {mark: missed.get(mark, 0) + 1 for mark in missing}
            if 1 in missed.values():
                await asyncio.to_thread(self._renew)
            for mark, looks in missed.items():
                if looks >= _LOOKS and self._yields_to(mark):
                    why = self._not_found_by(missing[mark])
                    log.error("this editor ends: %s", why)
                    give_up(why)
                    return

    def _renew(self) -> None:
        """Write the file of this editor again: after a day, who starts removes it."""
        try:
            self._path.touch(0o600)
        except OSError as error:
            log.warning("cannot write %s: %s", self._path, error.strerror)

    def _yields_to(self, mark: str) -> bool:
        """Return whether of two editors with different folders this one has to end, and not the one with
        `mark`, which does not find the file of this one. The other one comes to the opposite answer."""
        return mark in self._known or mark < self._mark

    def _not_found_by(self, url: str) -> CannotStart:
        return CannotStart(
            f"The editor at {url} does not find {self._path}, which this one has written. All editors of "
            "one database need the same data folder: start them with the same --data, and on several "
            "computers share that folder over the network."
        )

    async def look(self) -> dict[str, str]:
        """Write which editors have this folder, and return the URLs of those that have not found
        the file of this one, by their marks. Raise Unavailable if the database does not answer."""
        rows = await self._journal.ask(
            lambda connection: connection.execute(_ALL, {"mark": self._mark}).all()
        )
        ours = next((row for row in rows if row.mark == self._mark), None)
        if ours is None:  # it has another slot by now
            await self._write(_SHOW, {"mark": self._mark})
        others = [row for row in rows if row is not ours]
        marks = [row.mark for row in others]
        self._known = await asyncio.to_thread(self._found, marks)
        met = " ".join(sorted(self._known))
        if ours is not None and ours.met != met:
            await self._write(_MEET, {"mark": self._mark, "met": met})
        return {row.mark: row.url for row in others if self._mark not in row.met.split()}

    def _found(self, marks: list[str]) -> frozenset[str]:
        """Return the marks whose files are in the folder. Those that were found keep counting while the
        folder cannot be read or is another one, without our own file: that is no fault of their editors."""
        errors: list[OSError] = []

        def has(mark: str) -> bool:
            try:
                return self._path_of(mark).exists()
            except OSError as error:
                errors.append(error)
                return mark in self._known

        is_ours = has(self._mark)
        found = frozenset(each for each in marks if (has(each) if is_ours else each in self._known))
        if errors and self._is_read:
            log.warning("the data folder %s cannot be read: %s", self._data, errors[0].strerror)
        self._is_read = not errors
        return found

    def _path_of(self, mark: str) -> Path:
        return self._data / f"{_PREFIX}{mark}"

    async def _write(self, statement: Any, values: dict[str, Any]) -> None:
        def write(connection: Connection) -> None:
            connection.execute(statement, {**values, "slot": self._journal.slot})

        await self._journal.derive(write)
