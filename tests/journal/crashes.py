"""A disk under SQLite that remembers every write, so that its power can be cut anywhere, afterwards.

The real writer of a journal runs on it through `Driver`, which looks like `sqlite3` and is apsw.
"""

import itertools
import random
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final, TypeAlias

import apsw

#: One thing that happened to a file: a write (offset, bytes), a new length, a sync, its deletion.
Step: TypeAlias = tuple[str, str, int, bytes]
SECTOR: Final = 512
_NUMBERS: Final = itertools.count()


class Disk:
    """Records the steps of the files in order, and can make a step fail."""

    def __init__(self) -> None:
        self.name = f"recorder-{next(_NUMBERS)}"
        self.steps: list[Step] = []
        #: Called before each write and sync; what it raises is what SQLite gets.
        self.fault: Callable[[str], None] = lambda _: None
        self._vfs = _Vfs(self)

    def note(self, what: str, file: str, offset: int = 0, data: bytes = b"") -> None:
        """Remember a step."""
        self.steps.append((what, Path(file).name, offset, data))

    def image(self, until: int, chance: random.Random) -> dict[str, bytes]:
        """The files after a power cut just before step number `until`.

        What was synced is there. Of the rest every write may have come through or not, in any order,
        and whole sectors of it may be missing.
        """
        files: dict[str, bytearray] = {}
        waiting: dict[str, list[Step]] = {}
        for step in self.steps[:until]:
            what, file, _, _ = step
            if what == "sync":
                _apply(files, waiting.pop(file, []))
            elif what == "delete":
                waiting.pop(file, None)
                files.pop(file, None)
            else:
                waiting.setdefault(file, []).append(step)
        mood = chance.choice((0.0, 0.1, 0.5, 0.9, 1.0))
        for steps in waiting.values():
            _apply(files, (part for each in steps for part in _torn(each, mood, chance)))
        return {name: bytes(data) for name, data in files.items()}


def _apply(files: dict[str, bytearray], steps: Iterable[Step]) -> None:
    for what, file, offset, data in steps:
        content = files.setdefault(file, bytearray())
        if what == "truncate":
            del content[offset:]
        else:
            content.extend(bytes(max(0, offset - len(content))))
            content[offset : offset + len(data)] = data


def _torn(step: Step, mood: float, chance: random.Random) -> Iterator[Step]:
    what, file, offset, data = step
    if what != "write" or chance.random() < 0.7:
        if chance.random() < mood:
            yield step
        return
    for start in range(0, len(data), SECTOR):
        if chance.random() < mood:
            yield what, file, offset + start, data[start : start + SECTOR]


class _Vfs(apsw.VFS):
    def __init__(self, disk: Disk) -> None:
        self._disk = disk
        super().__init__(disk.name, "")

    def xOpen(self, name: Any, flags: list[int]) -> "_File":  # noqa: N802 - apsw's name
        return _File(self._disk, name, flags)

    def xDelete(self, filename: str, syncdir: bool) -> None:  # noqa: N802
        self._disk.note("delete", filename)
        super().xDelete(filename, syncdir)


class _File(apsw.VFSFile):
    def __init__(self, disk: Disk, name: Any, flags: list[int]) -> None:
        self._disk = disk
        self._name = name.filename() if isinstance(name, apsw.URIFilename) else name
        super().__init__("", name, flags)

    def xWrite(self, data: bytes, offset: int) -> None:  # noqa: N802
        self._disk.fault("write")
        super().xWrite(data, offset)
        self._disk.note("write", self._name, offset, bytes(data))

    def xTruncate(self, newsize: int) -> None:  # noqa: N802
        self._disk.fault("write")
        super().xTruncate(newsize)
        self._disk.note("truncate", self._name, newsize)

    def xSync(self, flags: int) -> None:  # noqa: N802
        self._disk.fault("sync")
        super().xSync(flags)
        self._disk.note("sync", self._name)


class Driver:
    """apsw as a module of the kind that SQLAlchemy knows, on a disk of ours."""

    paramstyle = "qmark"
    sqlite_version_info = tuple(int(part) for part in apsw.sqlite_lib_version().split("."))
    sqlite_version = apsw.sqlite_lib_version()
    PARSE_DECLTYPES = PARSE_COLNAMES = 0

    def __init__(self, disk: Disk, synchronous: str = "FULL") -> None:
        self._disk = disk
        self._synchronous = synchronous

    def __getattr__(self, name: str) -> Any:
        return getattr(sqlite3, name)  # Error, OperationalError, Binary …

    def connect(self, path: str, timeout: float = 5, **_: object) -> "_Connection":
        """A connection."""
        connection = apsw.Connection(path, vfs=self._disk.name)
        connection.set_busy_timeout(int(timeout * 1000))
        return _Connection(connection, self._synchronous)


class _Connection:
    isolation_level: str | None = None
    text_factory: Any = str

    def __init__(self, connection: apsw.Connection, synchronous: str) -> None:
        self._open = connection
        self._synchronous = synchronous

    def cursor(self) -> "_Cursor":
        return _Cursor(self._open.cursor(), self._synchronous)

    def execute(self, sql: str, values: Sequence[Any] = ()) -> "_Cursor":
        return self.cursor().execute(sql, values)

    def executemany(self, sql: str, rows: Iterable[Sequence[Any]]) -> "_Cursor":
        return self.cursor().executemany(sql, rows)

    def create_function(self, *_: object, **__: object) -> None:
        """SQLAlchemy's regular expressions: not used here."""

    @property
    def in_transaction(self) -> bool:
        return self._open.in_transaction

    def commit(self) -> None:
        if self._open.in_transaction:
            self.execute("COMMIT")

    def rollback(self) -> None:
        if self._open.in_transaction:
            self.execute("ROLLBACK")

    def close(self) -> None:
        with translated():
            self._open.close()


class _Cursor:
    lastrowid = None
    arraysize = 1

    def __init__(self, cursor: apsw.Cursor, synchronous: str) -> None:
        self._cursor = cursor
        self._synchronous = synchronous
        self._rows: list[Any] = []
        self.rowcount = -1  # rows that the last statement changed
        self.description: Any = None
        cursor.exec_trace = self._describe

    def _describe(self, cursor: apsw.Cursor, *_: object) -> bool:
        """The columns, also of a result without rows: known only before the first step."""
        found = cursor.get_description()
        self.description = [(name, *[None] * 6) for name, _ in found] or None
        return True

    def execute(self, sql: str, values: Sequence[Any] = ()) -> "_Cursor":
        if sql == "PRAGMA synchronous=FULL":
            sql = f"PRAGMA synchronous={self._synchronous}"
        with translated():
            self.description = None
            before = self._cursor.connection.total_changes()
            self._cursor.execute(sql, tuple(values))
            self._rows = list(self._cursor)
            self.rowcount = self._cursor.connection.total_changes() - before
        return self

    def executemany(self, sql: str, rows: Iterable[Sequence[Any]]) -> "_Cursor":
        with translated():
            self._cursor.executemany(sql, list(rows))
        return self

    def fetchone(self) -> Any:
        return self._rows.pop(0) if self._rows else None

    def fetchall(self) -> list[Any]:
        rows, self._rows = self._rows, []
        return rows

    def fetchmany(self, size: int = 1) -> list[Any]:
        rows, self._rows = self._rows[:size], self._rows[size:]
        return rows

    def close(self) -> None:
        with translated():
            self._cursor.close(True)


class translated:  # noqa: N801 - reads as a word
    """apsw's errors as sqlite3's."""

    def __enter__(self) -> None:
        pass

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        match error:
            case None:
                pass
            case apsw.ConstraintError():
                raise sqlite3.IntegrityError(str(error)) from error
            case apsw.Error():
                raise sqlite3.OperationalError(str(error)) from error
