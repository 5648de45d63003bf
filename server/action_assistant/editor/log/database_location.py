"""Remembers which database holds the graphs of a data folder.

Most hold them themselves, in `editor.db`, and remember nothing. A folder that is served with
`--database` keeps the URL, without its password, in `editor.database`, so that no command overlooks
graphs that are elsewhere, and nobody finds an empty catalogue by leaving out an option.
"""

import logging
from pathlib import Path
from typing import Final

import msgspec
from sqlalchemy import URL, Connection, func, inspect, make_url, select
from sqlalchemy.exc import ArgumentError

from action_assistant.editor.log.epochs import MARK, EpochMark
from action_assistant.errors import CannotStart
from action_assistant.journal.databases import ask_once, database_of
from action_assistant.private_files import DamagedFile, read_json, replace_file
from action_assistant.schema import editor_tables

log: Final = logging.getLogger(__name__)

FILE: Final = "editor.database"
#: The journal of a folder that holds its graphs itself.
JOURNAL: Final = "editor.db"
_SECRET: Final = "password"  # names of parameters that hold one contain this
_event, _graph = editor_tables.editor_event.c, editor_tables.graph.c


class StoredLocation(msgspec.Struct, frozen=True):
    """The content of the file that names the database of a data folder."""

    database: str


def of(data: Path) -> str:
    """Return the URL of the database with the graphs of the data folder `data`, for a command
    without --database. Raise CannotStart if the graphs are in a database whose URL is not stored in
    the folder."""
    known = remembered(data)
    if known is not None:
        return known
    if not (data / JOURNAL).exists() and (data / MARK).exists():
        raise CannotStart(
            f"The graphs of {data} are in a database that this folder does not remember: "
            "name it by --database URL."
        )
    return _own(data)


def to_serve(data: Path, *, switch: bool) -> str:
    """Return the URL of the database that an editor without --database serves: the one that the data
    folder remembers, or its own one, also with `switch`. Raise CannotStart if the remembered one is
    a file that is missing, or cannot be read."""
    known = None if switch else remembered(data)
    return (known and journal_of(data, None)) or _own(data)


def journal_of(data: Path, given: str | None) -> str | None:
    """Return the URL of the journal with the graphs of the data folder `data`, or `given` if it is
    not None; None if the folder has no graphs. Raise CannotStart if the database is missing."""
    url = given or of(data)
    if not _is_nowhere(url):
        return url
    if given is None and is_own(data, url):
        return None
    raise CannotStart(f"There is no {make_url(url).database}, where the graphs of {data} are.")


def is_own(data: Path, url: str) -> bool:
    """Return whether a URL names the SQLite file in the data folder itself."""
    return same(url, _own(data))


def remembered(data: Path) -> str | None:
    """Return the stored URL of the database outside of the data folder; None if none is stored: the
    graphs are then in the folder itself, or do not exist yet. Raise CannotStart if the file with
    the URL cannot be read or is damaged."""
    try:
        return read_json(data / FILE, StoredLocation).database
    except FileNotFoundError:
        return None
    except OSError as error:
        raise CannotStart(f"Cannot read {data / FILE}: {error.strerror}.") from error
    except DamagedFile as error:
        raise CannotStart(
            f"{data / FILE} is damaged. Name the database by --database URL --switch-database."
        ) from error


def check(data: Path, url: str, *, switch: bool) -> None:
    """Raise CannotStart if the database at `url` lacks the graphs of the data folder `data`, unless
    `switch` is set."""
    if switch:
        return
    known = remembered(data)
    if known is None and not (data / JOURNAL).exists():
        # An older version did not write down which one it was; that it was another one is known.
        if (data / MARK).exists() and same(url, _own(data)):
            raise CannotStart(
                f"The graphs of {data} are in a database that this folder does not remember: name "
                "it by --database URL, or begin without them by --switch-database."
            )
        return
    known = known or _own(data)
    if same(known, url) or (count := _graphs(known)) == 0 or _holds(url, data / MARK):
        return
    raise CannotStart(_refusal(data, known, url, count))


def remember(data: Path, url: str) -> None:
    """Write down in the data folder that its graphs are in the database `url` from now on."""
    path = data / FILE
    parsed = make_url(url)
    if parsed.get_backend_name() == "sqlite":  # wherever commands are started
        url = f"sqlite:///{Path(parsed.database or '').resolve()}"
    try:
        if same(url, _own(data)):
            path.unlink(missing_ok=True)
            return
        content = msgspec.json.encode(StoredLocation(shown(url)))
        replace_file(path, content, part=path.with_name(f".{FILE}.part"))
    except OSError as error:  # the editor works all the same; the next start tries again
        log.warning("cannot write %s: %s", path, error.strerror)


def shown(url: str) -> str:
    """Return a URL without its password and other secrets, to be shown to people."""
    parsed = make_url(url)
    query = {name: value for name, value in parsed.query.items() if _SECRET not in name}
    return URL.create(
        parsed.drivername,
        username=parsed.username,
        host=parsed.host,
        port=parsed.port,
        database=parsed.database,
        query=query,
    ).render_as_string()


def _own(data: Path) -> str:
    return f"sqlite:///{data / JOURNAL}"


def same(one: str, other: str) -> bool:
    """Return whether two URLs name the same database."""
    return _address(one) == _address(other)


def _address(url: str) -> tuple[object, ...]:
    try:
        parsed = make_url(url)
    except ArgumentError:
        return (url,)
    if parsed.get_backend_name() == "sqlite":
        return "sqlite", Path(parsed.database or "").resolve()
    return "postgresql", parsed.host, parsed.port or 5432, parsed.database, parsed.query.get("host")


def _graphs(url: str) -> int | None:
    """Return the number of graphs in the database at `url` that are not deleted; None if it cannot
    be read."""
    counted = select(func.count()).where(_graph.deleted_at.is_(None))

    def count(connection: Connection) -> int:
        if not inspect(connection).has_table(editor_tables.graph.name):
            return 0
        return connection.execute(counted).scalar_one()

    if _is_nowhere(url):
        return None
    try:
        return ask_once(url, count)
    except CannotStart:
        return None


def _holds(url: str, mark: Path) -> bool:
    """Return whether the database at `url` has the last event that the data folder has seen
    (`mark`: the file that names it): it is the same database by another name, or a copy. Raise
    CannotStart if it cannot be read."""
    if _is_nowhere(url):
        return False
    try:
        last = read_json(mark, EpochMark)
    except (OSError, DamagedFile):
        return False
    found = select(_event.chain).where(_event.position == last.position)

    def look(connection: Connection) -> bool:
        if not inspect(connection).has_table(editor_tables.editor_event.name):
            return False
        chain = connection.execute(found).scalar()
        return chain is not None and bytes(chain).hex() == last.chain

    return ask_once(url, look)


def _is_nowhere(url: str) -> bool:
    """Return whether a URL names a SQLite file that does not exist. Raise CannotStart for an
    invalid URL."""
    database_of(url)
    parsed = make_url(url)
    return parsed.get_backend_name() == "sqlite" and not Path(parsed.database or "").exists()


def _refusal(data: Path, known: str, url: str, count: int | None) -> str:
    own = _own(data)
    many = "The graphs" if count is None else f"{count} graph{'s' * (count != 1)}"
    where = str(data / JOURNAL) if known == own else shown(known)
    asked, before = (
        "without --database" if same(each, own) else f"with --database {shown(each)}"
        for each in (url, known)
    )
    return (
        f"{many} of {data} {'is' if count == 1 else 'are'} in {where}, and would not be seen {asked}. "
        f"Start {before}, which the folder remembers; or take everything along: `action-assistant backup FILE`, then `restore "
        "FILE` into the other database; or leave it there and go on with the other database: "
        "--switch-database."
    )
