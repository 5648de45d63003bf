"""Routes of links that show one thing, in both processes: owners make, list and revoke them."""

from collections import Counter
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any, Final, Protocol

import msgspec
from anyio import to_thread
from litestar import Request, Response, get, post
from litestar.params import FromPath, JSONBody
from litestar.types import ControllerRouterHandler

from action_assistant.errors import TooMany
from action_assistant.web.auth.access import Needs, person_of
from action_assistant.web.auth.identity import View
from action_assistant.web.auth.view_links import DAYS, ViewLink, ViewLinks, ViewRecord

_Asking = Request[Any, Any, Any]
_THING: Final = 100  # characters of an id
_OF_A_LINK: Final = 100  # open streams
_OF_ALL: Final = 300


class NewViewLink(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The graph or run that a new link shows, by its id, and for how many days."""

    thing: Annotated[str, msgspec.Meta(min_length=1, max_length=_THING)]
    label: str = ""
    days: float = DAYS


class ViewStreams:
    """Counts the open streams of links, which must not use up what persons need."""

    def __init__(self) -> None:
        self._open: Counter[str] = Counter()

    def require(self, view: View) -> None:
        """Raise TooMany if this link, or all links together, have too many streams open."""
        if self._open[view.id] >= _OF_A_LINK or self._open.total() >= _OF_ALL:
            raise TooMany("Too many people look at once; try again in a minute.")

    @contextmanager
    def opened(self, view: View) -> Iterator[None]:
        """Return a context during which an open stream of this link is counted."""
        self._open[view.id] += 1
        try:
            yield
        finally:
            self._open[view.id] -= 1
            if not self._open[view.id]:
                del self._open[view.id]


class ViewAudit(Protocol):
    """Keeps which links to one thing were made and revoked."""

    def view_link_made(self, link: ViewRecord, author: str) -> None:
        """Keep that a person made a link."""

    def view_link_revoked(self, link: ViewRecord, author: str) -> None:
        """Keep that a person revoked a link."""


def view_link_routes(
    links: ViewLinks, require: Callable[[str], Awaitable[object]], audit: ViewAudit
) -> list[ControllerRouterHandler]:
    """Return the routes by which owners make, list and revoke the links of a process. `require`
    raises NotFound if there is no thing with this id; `audit` keeps who made and revoked them."""
    kind = links.kind

    @get(
        "/api/view-links",
        summary=f"Links that show one {kind} to people without a name, the newest first",
        operation_id="listViewLinks",
        guards=[Needs("share")],
    )
    async def list_links(thing: str | None = None) -> list[ViewLink]:
        return await to_thread.run_sync(links.every, thing)

    @post(
        "/api/view-links",
        summary=f"Make a link that shows one {kind}, read-only, to everybody who has it",
        operation_id="makeViewLink",
        guards=[Needs("share")],
    )
    async def make(data: JSONBody[NewViewLink], request: _Asking) -> Response[ViewLink]:
        await require(data.thing)
        by = person_of(request)
        made = await to_thread.run_sync(links.make, data.thing, data.label, data.days, by)
        audit.view_link_made(made, by.id)
        return Response(made, status_code=201)

    @post(
        "/api/view-links/{link:str}/revoke",
        status_code=204,
        summary="End a link at once, also where it is open",
        operation_id="revokeViewLink",
        guards=[Needs("share")],
    )
    async def revoke(link: FromPath[str], request: _Asking) -> None:
        ended = await to_thread.run_sync(links.revoke, link)
        audit.view_link_revoked(ended, person_of(request).id)

    return [list_links, make, revoke]
