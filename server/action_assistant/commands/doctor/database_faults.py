"""Why a database on a server does not answer, told apart."""

import socket
from collections.abc import Iterator
from typing import Final

import asyncpg  # type: ignore[import-untyped]
from sqlalchemy import make_url
from sqlalchemy.exc import DBAPIError

from action_assistant.journal.database import cause_of
from action_assistant.system.diagnostics import Diagnostic, found

_PASSWORD: Final = (
    asyncpg.InvalidPasswordError,
    asyncpg.InvalidAuthorizationSpecificationError,
)


def fault(url: str, error: Exception) -> Diagnostic:
    """What is wrong with a database that could not be asked. `url` has no password."""
    host = make_url(url).host or "this computer"
    causes = [*_causes(error)]
    if any(isinstance(each, socket.gaierror) for each in causes):
        return found(
            "database-host-unknown",
            url,
            f"The host {host} of the database is unknown: no name server knows an address of it.",
            "Correct the name in --database or ACTION_ASSISTANT_DATABASE; in compose it is the name of "
            "the service, and only containers of its network know it.",
        )
    if any(isinstance(each, _PASSWORD) for each in causes):
        return found(
            "database-password",
            url,
            f"The database refuses us: {cause_of(error)}.",
            "Give the right user and password in ACTION_ASSISTANT_DATABASE, PGPASSWORD or ~/.pgpass; "
            "a folder never remembers a password.",
        )
    if any(isinstance(each, asyncpg.InvalidCatalogNameError) for each in causes):
        return found(
            "database-absent",
            url,
            f"The server {host} answers, but has no such database: {cause_of(error)}.",
            "Correct its name, or create it (`createdb`) and restore a backup into it.",
        )
    why = "it does not answer in time" if isinstance(error, TimeoutError) else cause_of(error)
    return found(
        "database-unreachable",
        url,
        f"The database cannot be asked: {why}.",
        "Start its server, or open the way to it (port, firewall, pg_hba.conf); the graphs are there.",
    )


def _causes(error: BaseException) -> Iterator[BaseException]:
    """An error and all that it came from."""
    waiting: list[BaseException | None] = [error]
    seen: list[BaseException] = []
    while waiting:
        each = waiting.pop()
        if each is None or each in seen:
            continue
        seen.append(each)
        yield each
        waiting += [each.__cause__, each.__context__]
        if isinstance(each, DBAPIError):
            waiting.append(each.orig)
