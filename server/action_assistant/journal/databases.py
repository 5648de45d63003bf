"""Chooses SQLite or Postgres by the URL of a database, and upgrades its tables."""

import asyncio
from collections.abc import Callable
from typing import TypeVar

from sqlalchemy import Connection, make_url
from sqlalchemy.exc import ArgumentError

from action_assistant.errors import CannotStart, Unavailable
from action_assistant.journal.database import Branch, Database, cause_of
from action_assistant.journal.migrate import recognize, upgrade_to

T = TypeVar("T")


def database_of(url: str, *, several: bool = False) -> Database:
    """Return the PostgreSQL or SQLite database that a URL names, without connecting to it. `several`:
    other processes may write to it, too. Raise CannotStart for a malformed URL, a database that is
    neither, or a file for several."""
    try:
        parsed = make_url(url)
    except ArgumentError as error:
        # The URL is not quoted, since its faulty part may be a password.
        raise CannotStart("--database is not a URL such as sqlite:////data/editor.db.") from error
    if parsed.drivername in {"postgresql", "postgres"} and parsed.database:
        from action_assistant.journal.postgres import Postgres

        return Postgres(parsed, several=several)
    if several:
        raise CannotStart("Several editors need a Postgres database: --database postgresql://…")
    if parsed.get_backend_name() == "sqlite" and parsed.database:
        from action_assistant.journal.sqlite import Sqlite

        return Sqlite(parsed.database)
    raise CannotStart(f"Databases of the kind {parsed.drivername!r} are not supported.")


def migrate(url: str, branch: Branch, revision: str = "head") -> str:
    """Upgrade the database `url` of a branch to a revision, "head" for the newest, and return its
    revision then. All of it is one transaction: if the process is killed, the database is
    unchanged. Raise CannotStart if it cannot be used or belongs to another process."""
    database = database_of(url)
    database.look(recognize)
    return database.migrate(upgrade_to(branch, revision))


def ask_once(url: str, question: Callable[[Connection], T]) -> T:
    """Call `question` with a connection to the database `url` that reads one consistent snapshot,
    and return its result; create and change nothing. It blocks: call it only where no event loop
    runs. Raise CannotStart if the database cannot be read."""
    database = database_of(url)
    try:
        return asyncio.run(_asked_once(database, question))
    except database.faults as error:
        raise CannotStart(f"{database.name} cannot be read: {cause_of(error)}.") from error


def ask_from_worker(url: str, question: Callable[[Connection], T]) -> T:
    """Call `question` in a worker process, and return its result. Its connection to the database
    `url` shows one consistent snapshot, whatever another process writes meanwhile. Raise
    Unavailable if the database cannot be read."""
    database = database_of(url)
    try:
        return asyncio.run(_asked_once(database, question))
    except database.faults as error:
        raise Unavailable(f"The journal cannot be read: {cause_of(error)}.") from error


async def _asked_once(database: Database, question: Callable[[Connection], T]) -> T:
    try:
        return await database.at_one_moment(question)
    finally:
        await database.close()
