"""The databases of graphs and runs: that they are there, of this version, sound, and nobody else's.

Files are looked at without opening them for writing, and of the events the newest: `verify` looks at all.
"""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import anyio
import msgspec
from sqlalchemy import Connection, func, inspect, make_url, select

from action_assistant.commands.doctor.database_faults import fault
from action_assistant.commands.doctor.installation import Installation
from action_assistant.commands.doctor.recent_events import first_damage, has_events, newest_at
from action_assistant.editor.log import database_location
from action_assistant.editor.log.epochs import MARK, marked
from action_assistant.errors import AnothersDatabase, CannotStart, NewerSchema
from action_assistant.journal.database import Database
from action_assistant.journal.databases import database_of
from action_assistant.journal.migrate import recognize
from action_assistant.journal.postgres import weakness
from action_assistant.schema.editor_tables import editor_event
from action_assistant.system.diagnostics import Diagnostic, fine, found

_PATIENCE_S: Final = 6.0
_CLOCK_S: Final = 120.0  # that an event may be in the future
_NEWER: Final = (
    "Install that version again, or restore a backup of before the upgrade into an empty folder."
)


def graphs_are_there(place: Installation) -> Iterator[Diagnostic]:
    """The editor's database, wherever it is."""
    data = place.data
    try:
        url = place.database or database_location.of(data)
        database_of(url)
    except CannotStart as error:
        lost = (data / MARK).exists() and not place.database
        yield found(
            "database-lost" if lost else "database-url",
            data,
            str(error),
            "Name the database by --database URL, or restore a backup into an empty folder.",
        )
        return
    if not url.startswith("sqlite:"):
        yield from _on_server(data, url)
        return
    file = Path(make_url(url).database or "")
    if file.exists():
        yield from _in_file("graphs", file)
    elif database_location.remembered(data) or _holds_events(data / "runner.db"):
        yield found(
            "database-lost",
            file,
            "The database of graphs is gone, though this folder was served with it.",
            "Put the file back or restore a backup; if the graphs are in another database, name it by "
            "--database URL. A start without them begins with an empty catalogue.",
        )
    else:
        yield fine(file, "There are no graphs yet; serve makes the database.")


def runs_are_there(place: Installation) -> Iterator[Diagnostic]:
    """The runner's database, which is always a file of the folder."""
    file = place.data / "runner.db"
    left = [place.data / name for name in ("archive", "recordings")]
    if file.exists():
        yield from _in_file("runs", file)
    elif any(each.is_dir() and any(each.iterdir()) for each in left):
        yield found(
            "database-lost",
            file,
            "The database of runs is gone, though archives or recordings of runs are here.",
            "Put the file back or restore a backup: a start without it has no robots and no runs.",
        )
    else:
        yield fine(file, "There are no runs yet; serve makes the database.")


class _DatabaseLook(msgspec.Struct):
    """What a look into a database has shown."""

    damage: str = ""
    newest: int | None = None
    weak: str = ""
    lacks: bool = False


def _holds_events(file: Path) -> bool:
    """Whether a journal has events; not where that cannot be told, which is told elsewhere."""
    held: list[bool] = []
    try:
        database_of(f"sqlite:///{file}").look(lambda each: held.append(has_events(each)))
    except CannotStart:
        return False
    return any(held)


def _in_file(what: str, file: Path) -> Iterator[Diagnostic]:
    database = database_of(f"sqlite:///{file}")
    seen = _DatabaseLook()
    try:
        database.look(lambda connection: _look(database, connection, seen))
    except CannotStart as error:
        yield _refused(file, error)
        return
    problems = [*_events(what, file, seen)]
    yield from problems
    if not problems:
        yield fine(file, f"The database of {what} can be read; its newest events are sound.")


def _look(database: Database, connection: Connection, seen: _DatabaseLook) -> None:
    """Into a database of this version or an earlier one. Raises CannotStart for others."""
    if recognize(connection):
        seen.damage = first_damage(database, connection)
        seen.newest = newest_at(connection)


def _refused(where: object, error: CannotStart) -> Diagnostic:
    if isinstance(error, NewerSchema):
        return found("schema-newer", where, str(error), _NEWER)
    if isinstance(error, AnothersDatabase):
        return found(
            "database-foreign", where, str(error), "Choose another data folder, or database."
        )
    return found(
        "database-unreadable",
        where,
        str(error),
        "Mend the rights of the file if they are the reason; else restore a backup.",
    )


def _events(what: str, where: object, seen: _DatabaseLook) -> Iterator[Diagnostic]:
    """What is wrong with the newest events."""
    if seen.damage:
        yield found(
            "events-damaged",
            where,
            f"Stored events of {what} are not what was written: {seen.damage}.",
            "Run `action-assistant verify` for all that is damaged, and restore the last backup that "
            "is sound; what is not damaged stays readable.",
        )
    ahead = (seen.newest or 0) / 1e6 - time.time()
    if ahead > _CLOCK_S:
        yield found(
            "clock-wrong",
            where,
            f"The newest events of {what} are {span(ahead)} in the future: the clock of this computer "
            "is behind, or was ahead when they were written.",
            "Set the clock (`timedatectl set-ntp true`): histories of runs are dated by it.",
        )


def span(seconds: float) -> str:
    """A time for people."""
    if abs(seconds) < 120:
        return f"{abs(seconds):.0f} s"
    return f"{abs(seconds) / 60:.0f} min" if abs(seconds) < 7200 else f"{abs(seconds) / 3600:.0f} h"


def _on_server(data: Path, url: str) -> Iterator[Diagnostic]:
    """A database on a server: it answers, keeps what it confirms, and has the graphs."""
    shown = database_location.shown(url)
    database = database_of(url)
    try:
        seen = anyio.run(_asked, database, data)
    except (NewerSchema, AnothersDatabase) as error:
        yield _refused(shown, error)
        return
    except (TimeoutError, CannotStart) as error:
        yield fault(shown, error)
        return
    except database.faults as error:
        yield fault(shown, error)
        return
    problems = [*_events("graphs", shown, seen)]
    if seen.lacks:
        problems.append(
            found(
                "database-lost",
                shown,
                f"The database answers, but lacks the graphs that {data} has seen in it.",
                "Name the right database by --database URL, or restore a backup into an empty one.",
            )
        )
    if seen.weak:
        problems.append(
            found(
                "database-unsafe",
                shown,
                f"No editor writes to this database: {seen.weak}.",
                "Change that in its postgresql.conf, and reload it.",
            )
        )
    yield from problems
    if not problems:
        yield fine(shown, "The database answers, and keeps what it confirms.")


async def _asked(database: Database, data: Path) -> _DatabaseLook:
    """What a look shows, for which nothing is made or changed. Raises what its driver raises,
    TimeoutError, CannotStart."""
    seen = _DatabaseLook()

    def question(connection: Connection) -> None:
        seen.weak = weakness(connection)
        seen.lacks = not _holds_mark(connection, data)
        _look(database, connection, seen)

    try:
        with anyio.fail_after(_PATIENCE_S):
            await database.at_one_moment(question)
    finally:
        await database.close()
    return seen


def _holds_mark(connection: Connection, data: Path) -> bool:
    """Whether the database goes as far as this folder has seen; true where it has seen nothing."""
    mark = marked(data / MARK)
    if mark is None or mark.position == 0:
        return True
    if not inspect(connection).has_table(editor_event.name):
        return False
    last = connection.execute(select(func.max(editor_event.c.position))).scalar()
    return (last or 0) >= mark.position
