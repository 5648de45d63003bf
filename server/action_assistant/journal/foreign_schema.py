"""Finds parts of the schema of a SQLite journal that this program did not make.

A trigger may change what is stored, and a view or a table may stand for one of ours. What this program
makes is known: the schema is compared with that of an empty journal of the same revision.
"""

import re
import sqlite3
from collections.abc import Iterable
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeAlias

from sqlalchemy import NullPool, create_engine

from action_assistant.errors import CannotStart
from action_assistant.journal.database import Branch
from action_assistant.journal.migrate import revisions_of, upgrade_to
from action_assistant.journal.sqlite import reads
from action_assistant.schema.branches import VERSIONS

#: SQLite makes these by itself.
_OF_SQLITE: Final = frozenset({"sqlite_sequence", "sqlite_stat1", "sqlite_stat4"})
_AUTOMATIC: Final = "sqlite_autoindex_"
#: A table whose text has one of these and not ours refuses, changes or computes what is stored in it.
_BINDING: Final = frozenset(
    {
        *("AS", "CHECK", "COLLATE", "CONFLICT", "FOREIGN", "GENERATED", "REFERENCES"),
        *("STRICT", "UNIQUE", "USING", "VIRTUAL", "WITHOUT"),
    }
)
_QUOTED: Final = re.compile(
    r"'(?:[^']|'')*'|\"(?:[^\"]|\"\")*\"|`[^`]*`|\[[^]]*\]|--[^\n]*|/\*.*?\*/", re.DOTALL
)
#: Before a table goes, what speaks of it goes.
_ORDER: Final = ("trigger", "view", "index", "table")


class SchemaObject(NamedTuple):
    """A table, index, view or trigger, and the table that it belongs to."""

    kind: str
    name: str
    table: str

    def __str__(self) -> str:
        on = "" if self.name == self.table else f" on {self.table!r}"
        return f"the {self.kind} {self.name!r}{on}"


#: The definition of an object, in an order that does not depend on how it was created.
_Shape: TypeAlias = tuple[object, ...]


class Findings(NamedTuple):
    """Objects of a schema that this program did not make, and objects of this program that were
    altered."""

    strangers: tuple[SchemaObject, ...]
    altered: tuple[str, ...]

    def sentences(self) -> list[str]:
        """Return one sentence for each object that was found."""
        strange = [f"{each} was not made by this program" for each in self.strangers]
        return [*strange, *self.altered]


def look(path: Path, branch: Branch) -> Findings:
    """Compare the schema of the journal in the SQLite file `path` with the schema of this program,
    without changing it. An empty file has no findings. Raise CannotStart for a database of another
    program, sqlite3.Error if it cannot be read."""
    with closing(sqlite3.connect(f"{path.as_uri()}?{reads(path)}", uri=True)) as connection:
        return _compared(connection, branch)


def remove_strangers(path: Path, branch: Branch) -> list[str]:
    """Drop all objects from the schema of the copy of a journal (`path`) that are not this
    program's; return them in words. Raise CannotStart if an object of this program is altered,
    sqlite3.Error if the file cannot be read."""
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        found = _compared(connection, branch)
        if found.altered:
            raise CannotStart(
                f"The journal of the {branch} has another schema than this program makes: "
                f"{'; '.join(found.altered)}."
            )
        connection.execute("BEGIN")
        for each in sorted(found.strangers, key=lambda each: _ORDER.index(each.kind)):
            connection.execute(f"DROP {each.kind.upper()} IF EXISTS {_quoted(each.name)}")
        connection.execute("COMMIT")
        if left := _compared(connection, branch).strangers:
            raise CannotStart(f"The journal of the {branch} keeps {left[0]}, which is not ours.")
    return [str(each) for each in found.strangers]


def _compared(connection: sqlite3.Connection, branch: Branch) -> Findings:
    connection.execute("PRAGMA trusted_schema=OFF")
    revision = _revision(connection, branch)
    if revision is None:  # a newer version's, which whoever opens it refuses
        return Findings((), ())
    there, ours = _shapes(connection), _shapes_of(branch, revision)
    strangers = [each for each in there if each not in ours and _may_go(each, ours)]
    altered = [f"{each} is not as it should be" for each, shape in there.items()
               if each in ours and shape != ours[each]]  # fmt: skip
    altered += [
        f"{each} stands in the place of one of ours"
        for each in there
        if each not in ours and each not in strangers
    ]
    missing = [f"{each} is missing" for each in ours if each not in there and each.kind == "table"]
    return Findings(
        tuple(sorted(strangers)), tuple(sorted([*altered, *(missing if there else [])]))
    )


def _may_go(found: SchemaObject, ours: Iterable[SchemaObject]) -> bool:
    """Return whether an object of another program can be dropped by its name: it is a trigger, or
    no object of this program (`ours`) has the same name."""
    return found.kind == "trigger" or found.name not in {each.name for each in ours}


def _revision(connection: sqlite3.Connection, branch: Branch) -> str | None:
    """Return the schema revision that the journal of a branch states; the newest one if it states
    none; None if this version of the program does not know the revision."""
    found: set[object] = set()
    # A view of this name could go on for ever.
    kind = connection.execute("SELECT type FROM sqlite_master WHERE name = ?", [VERSIONS.name])
    if kind.fetchone() == ("table",):
        found = {row[0] for row in connection.execute(f"SELECT * FROM {VERSIONS.name} LIMIT 9")}
    known = revisions_of(branch)
    if not found:
        return known[-1]
    return next((each for each in reversed(known) if each in found), None)


@cache
def _shapes_of(branch: Branch, revision: str) -> dict[SchemaObject, _Shape]:
    """Return the objects in the schema of an empty journal of a branch at this revision."""
    engine = create_engine("sqlite://", poolclass=NullPool, isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        upgrade_to(branch, revision)(connection)
        raw: Any = connection.connection.dbapi_connection
        return _shapes(raw)


def _shapes(connection: sqlite3.Connection) -> dict[SchemaObject, _Shape]:
    rows = connection.execute("SELECT type, name, tbl_name, sql FROM sqlite_master").fetchall()
    return {
        SchemaObject(kind, name, table): _shape(connection, kind, name, table, sql or "")
        for kind, name, table, sql in rows
        if not _is_of_sqlite(kind, name, sql)
    }


def _is_of_sqlite(kind: str, name: str, sql: str | None) -> bool:
    if kind == "index":
        return sql is None and name.startswith(_AUTOMATIC)
    return kind == "table" and name in _OF_SQLITE


def _shape(connection: sqlite3.Connection, kind: str, name: str, table: str, sql: str) -> _Shape:
    words = frozenset(re.findall(r"\w+", _QUOTED.sub(" ", sql).upper())) & _BINDING
    match kind:
        case "table" if "VIRTUAL" not in words:
            columns = connection.execute(f"PRAGMA table_xinfo({_quoted(name)})").fetchall()
            return (words, *sorted(tuple(map(repr, column[1:])) for column in columns))
        case "index":
            columns = connection.execute(f"PRAGMA index_xinfo({_quoted(name)})").fetchall()
            lists = connection.execute(f"PRAGMA index_list({_quoted(table)})").fetchall()
            kinds = [tuple(each[2:]) for each in lists if each[1] == name]
            # The number of a column depends on how its table came about.
            return (words, *kinds, *(tuple(map(repr, column[2:])) for column in columns))
        case _:
            return (sql,)


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'
