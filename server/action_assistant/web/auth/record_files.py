"""Records of links and of tokens: each a file in a folder of the data folder, with its last use beside it.

Both processes read the files, and may write them. A record is read anew when its file has changed.
"""

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final, Generic, TypeVar

import msgspec

from action_assistant.private_files import (
    DamagedFile,
    FileState,
    log_unreadable,
    read_json,
    replace_file,
    state_of,
)
from action_assistant.random_ids import random_id

log: Final = logging.getLogger(__name__)

_USE_S: Final = 60.0  # between two writes of the last use of one record

R = TypeVar("R")
U = TypeVar("U")


class RecordFiles(Generic[R, U]):
    """Reads the records of one kind from `ID.json`, and keeps their last uses in `ID.used`."""

    def __init__(
        self,
        folder: Path,
        record: type[R],
        use: type[U],
        accepts: Callable[[str, R], bool],
        *,
        most: int,
    ) -> None:
        """`accepts`: returns whether a record belongs to this id and this process; it may raise
        DamagedFile. `most`: the number of records that there may be."""
        self.folder: Final = folder
        #: The last uses that this process has seen.
        self.uses: Final[dict[str, U]] = {}
        self._record, self._use = record, use
        self._accepts = accepts
        self._most = most
        self._known: dict[str, tuple[FileState, R | None]] = {}
        self._written: dict[str, float] = {}  # the last write of a use, on the monotonic clock

    def path(self, id_: str, suffix: str = ".json") -> Path:
        """Return the path of a file of this record."""
        return self.folder / f"{id_}{suffix}"

    def get(self, id_: str) -> R | None:
        """Return a record; None without a file that is accepted. If the whole folder is gone or cannot
        be read, what was read before counts."""
        known = self._known.get(id_)
        try:
            state = state_of(self.path(id_))
            if known is None or known[0] != state:
                if len(self._known) > 2 * self._most:
                    self._known.clear()
                known = self._known[id_] = (state, self._read(id_))
        except FileNotFoundError:
            if known is None or self.folder.is_dir():
                self._known.pop(id_, None)
                return None
        except OSError:  # the disk is gone, for which nobody is put out
            pass
        return None if known is None else known[1]

    def every(self) -> Iterator[R]:
        """Yield all records. Ends where the folder cannot be read."""
        with contextlib.suppress(OSError):
            for path in list(self.folder.glob("*.json")):
                if (found := self.get(path.stem)) is not None:
                    yield found

    def stored_use(self, id_: str) -> U | None:
        """Return the last use in the file; None where it cannot be read: only that is lost."""
        try:
            return read_json(self.path(id_, ".used"), self._use)
        except (OSError, DamagedFile):
            return None

    def note_use(self, id_: str, use: U) -> None:
        """Remember the last use of a record, and write it at most once a minute, on a thread. Call it
        in the event loop."""
        self.uses[id_] = use
        now = time.monotonic()
        if now - self._written.get(id_, -_USE_S) >= _USE_S:
            self._written[id_] = now
            asyncio.get_running_loop().run_in_executor(None, self._write_use, id_)

    def _read(self, id_: str) -> R | None:
        try:
            found = read_json(self.path(id_), self._record)
            return found if self._accepts(id_, found) else None
        except DamagedFile as error:
            log_unreadable(self.path(id_), error)
            return None

    def _write_use(self, id_: str) -> None:
        use, path = self.uses.get(id_), self.path(id_, ".used")
        if use is None or not self.path(id_).exists():  # it was revoked meanwhile
            return
        try:
            part = path.with_suffix(f".{random_id()}.part")  # the other process may write too
            replace_file(path, msgspec.json.encode(use), part=part, is_durable=False)
        except OSError as error:
            log.warning("the use of %s could not be noted: %s", path.stem, error.strerror)
