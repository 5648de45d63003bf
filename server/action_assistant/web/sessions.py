"""Signing in: the token is traded once for a cookie that either process can verify."""

from typing import Annotated, Any, Final

import msgspec
from litestar import Request, Response, delete, get, post
from litestar.datastructures import Cookie
from litestar.params import JSONBody
from litestar.types import ControllerRouterHandler

from action_assistant.errors import Unauthenticated
from action_assistant.web.access import cookie_name, known_person, session_of
from action_assistant.web.keys import SESSION_SECONDS, Keys, Person, Session

_NAME: Final = 60  # characters


class SignIn(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the page sends: the token on first sight, a name when the person gives one."""

    token: str | None = None
    name: Annotated[str, msgspec.Meta(max_length=_NAME)] | None = None


class SignedIn(msgspec.Struct, frozen=True):
    """Who the page is speaking for. `named` is false until the person has given a name."""

    person: Person
    named: bool


def session_routes(keys: Keys, page_port: int) -> list[ControllerRouterHandler]:
    """The routes under `/api/session`."""

    def signed_in(session: Session) -> Response[SignedIn]:
        body = SignedIn(session.person, bool(session.person.name))
        cookie = Cookie(
            key=cookie_name(page_port),
            value=keys.sealed(session),
            max_age=SESSION_SECONDS,
            httponly=True,
            samesite="strict",
            path="/",
        )
        return Response(body, status_code=200, cookies=[cookie])

    @get("/api/session", summary="Who is signed in")
    async def who(request: Request[Any, Any, Any]) -> SignedIn:
        session = _live(request)
        return SignedIn(session.person, bool(session.person.name))

    @post("/api/session", status_code=200, summary="Sign in, or change one's name")
    async def sign_in(
        data: JSONBody[SignIn], request: Request[Any, Any, Any]
    ) -> Response[SignedIn]:
        name = " ".join((data.name or "").split())
        if data.token is not None:
            if not keys.opens(data.token):
                raise Unauthenticated("This is not the token of this server.")
            known = known_person(request)
            if known is None:
                return signed_in(keys.new_session(name))
            # The link again, in a browser that is or was signed in: the same person, since what
            # older tabs have written belongs to them.
            return signed_in(keys.new_session(name or known.name, person_id=known.id))
        now = _live(request)
        return signed_in(
            keys.new_session(
                name or now.person.name,
                role=now.person.role,
                invitation=now.invitation,
                person_id=now.person.id,
            )
        )

    @delete("/api/session", summary="Sign out")
    async def sign_out() -> Response[None]:
        response: Response[None] = Response(None, status_code=204)
        response.delete_cookie(cookie_name(page_port), path="/")
        return response

    return [who, sign_in, sign_out]


def _live(request: Request[Any, Any, Any]) -> Session:
    session = session_of(request)
    if session is None:
        raise Unauthenticated("Open the link that the server printed.")
    return session
