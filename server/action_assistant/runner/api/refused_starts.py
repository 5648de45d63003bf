"""Keeps in the audit the starts that are refused: a refused start becomes no run."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any, Final, Literal, TypeAlias

import msgspec
from litestar import Request
from litestar.connection import ASGIConnection
from litestar.handlers.base import BaseRouteHandler

from action_assistant.errors import Refused
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.start.admission import GroupRequest, StartRequest
from action_assistant.web.audit.events import StartRefused
from action_assistant.web.auth.access import Needs, PersonOnly, person_of
from action_assistant.web.auth.roles import Permission

_What: TypeAlias = Literal["start", "change", "go_on", "answer"]
_SHOWN: Final = 500  # characters of a reason
_LONGEST: Final = 100  # of an id or a name
_MOST: Final = 20  # robots


class StartNeeds(Needs):
    """A guard of a route that may set a robot going. A refusal by it is kept in the audit.
    `of_people`: programs' tokens are refused."""

    def __init__(
        self,
        services: RunnerServices,
        what: _What,
        permission: Permission = "simulate",
        *,
        of_people: bool = False,
    ) -> None:
        super().__init__(permission)
        self._services: Final = services
        self._what: Final[_What] = what
        self._of_people: Final = of_people

    async def __call__(
        self, connection: ASGIConnection[Any, Any, Any, Any], handler: BaseRouteHandler
    ) -> None:
        """Raise Forbidden if the person's role lacks the permission."""
        with self.noting(connection):
            if self._of_people:
                await PersonOnly()(connection, handler)
            await super().__call__(connection, handler)

    def noting(
        self, connection: ASGIConnection[Any, Any, Any, Any]
    ) -> AbstractContextManager[None]:
        """Return a context that keeps a refusal inside it in the audit."""
        run = str(connection.path_params.get("run", ""))[:_LONGEST]
        return noted(self._services, connection, StartRefused(what=self._what, why="", run=run))


@contextmanager
def noted(
    services: RunnerServices,
    connection: ASGIConnection[Any, Any, Any, Any] | Request[Any, Any, Any],
    refusal: StartRefused,
) -> Iterator[None]:
    """Return a context: a refusal that is raised inside it is recorded, as `refusal` with the
    reason, and raised again."""
    try:
        yield
    except Refused as refused:
        why = refused.detail[:_SHOWN]
        kept = msgspec.structs.replace(refusal, why=why)
        services.audit.note_repeated(kept, person_of(connection).id)
        raise


def refusal_of(asked: StartRequest | GroupRequest) -> StartRefused:
    """Return the event of a start that is refused. Its reason `why` is empty; the caller fills it
    in."""
    if isinstance(asked, GroupRequest):
        engines = asked.engines
    else:
        engines = tuple(dict.fromkeys(asked.robots.values())) or (asked.engine,)
    return StartRefused(
        what="start",
        why="",
        engines=tuple(each[:_LONGEST] for each in engines[:_MOST]),
        graph=(asked.graph or "")[:_LONGEST],
        version=asked.version[:_LONGEST],
    )
