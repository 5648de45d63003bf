"""Sign-in: a token or an invitation is traded for a cookie that either process can verify."""

from collections.abc import Callable
from typing import Annotated, Any, Final, Protocol

import msgspec
from anyio import to_thread
from litestar import Request, Response, delete, get, post
from litestar.datastructures import Cookie
from litestar.params import JSONBody
from litestar.types import ControllerRouterHandler

from action_assistant.errors import BadInput, TooMany, Unauthenticated, Unavailable
from action_assistant.kit.token_bucket import TokenBuckets
from action_assistant.web.auth.access import (
    Needs,
    cookie_name,
    device_cookie_name,
    device_of,
    known_person,
    live_session,
    session_of,
)
from action_assistant.web.auth.keys import SESSION_SECONDS, Keys, Person, PersonRef, Session
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.roles import Role, rank
from action_assistant.web.auth.session_files import SessionFiles
from action_assistant.web.http.problems import PROBLEM_JSON, problem_of
from action_assistant.web.network.addresses import Addresses

_BODY: Final = 10_000  # bytes; strangers send it
_NAME: Final = 60  # characters
_TRIES_AT_ONCE: Final = 60  # of one address: a class may sit behind one
_TRIES_PER_MINUTE: Final = 30  # after that
_DEVICE_SECONDS: Final = 400 * 24 * 3600  # browsers keep none for longer
_Asking = Request[Any, Any, Any]


class SignIn(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The body of a sign-in: the token or an invitation, and optionally the person's name. A
    signed-in person may send only a new name.

    An invitation is `ID.SECRET`, as its link has it.
    """

    token: str | None = None
    invitation: Annotated[str, msgspec.Meta(max_length=200)] | None = None
    name: Annotated[str, msgspec.Meta(max_length=_NAME)] | None = None


class SignedIn(msgspec.Struct, frozen=True):
    """The person who is signed in. `named` is false until the person has given a name."""

    person: Person
    named: bool


class InvitationQuestion(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An invitation about which a person asks before using it."""

    invitation: Annotated[str, msgspec.Meta(max_length=200)]


class Invited(msgspec.Struct, frozen=True):
    """The role that a link invites to, and who made the link."""

    id: str
    role: Role
    by: str


class Revocation(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The invitation that is revoked or the session that is ended: one of the two."""

    invitation: str | None = None
    session: str | None = None


class InvitationRegistry(Protocol):
    """Knows the invitations and the people who came in by them."""

    def look(self, proof: str) -> Invited:
        """Return the invitation that a link proves. Raise Unauthenticated if the link is not valid."""

    async def welcome(self, invitation: str, person: PersonRef) -> None:
        """Record that a person came in by an invitation."""


class Sessions:
    """Trades tokens and invitations for sessions."""

    def __init__(
        self,
        keys: Keys,
        page_port: int,
        reception: Callable[[], InvitationRegistry],
        *,
        addresses: Addresses | None,
        limits: bool,
    ) -> None:
        self._keys = keys
        self._cookie = cookie_name(page_port)
        self._device = device_cookie_name(page_port)
        self._reception = reception
        self._addresses = addresses
        self._pace = TokenBuckets(_TRIES_AT_ONCE, _TRIES_PER_MINUTE / 60) if limits else None

    def look(self, invitation: str, request: _Asking) -> Invited:
        """Return the invitation of a link. Raise Unauthenticated if the link is not valid, TooMany
        if this address tries too often."""
        self._admit(request)
        return self._reception().look(invitation)

    async def session(self, data: SignIn, request: _Asking) -> Session:
        """Return the session for a sign-in. Raise Unauthenticated, TooMany or BadInput."""
        name = " ".join((data.name or "").split())
        match data:
            case SignIn(token=None, invitation=None):
                return _renamed(self._keys, live_session(request), name)
            case SignIn(token=str(token), invitation=None):
                if not self._keys.opens(token):
                    self._admit(request)
                    raise Unauthenticated("This is not the token of this server.")
                # The link again, in a browser that is or was signed in: the same person, since what
                # older tabs have written belongs to them.
                known, now = known_person(request), session_of(request)
                return self._keys.new_session(
                    name or _name(known),
                    person_id=known.id if known else None,
                    session_id=now.id if now else None,
                )
            case SignIn(token=None, invitation=str(proof)):
                self._admit(request)
                return await _invited(self._keys, self._reception(), proof, name, request)
            case _:
                raise BadInput("Send the token or an invitation, not both.")

    def answer(self, session: Session, request: _Asking) -> Response[SignedIn]:
        """Return the answer that sets the cookie of a session."""
        secure, path = self._jar(request)
        cookie = Cookie(
            key=self._cookie,
            value=self._keys.sealed(session),
            max_age=SESSION_SECONDS,
            httponly=True,
            samesite="strict",
            secure=secure,
            path=path,
        )
        return Response(
            _signed_in(session), status_code=200, cookies=[cookie, *self._device_cookie(request)]
        )

    def _device_cookie(self, request: _Asking) -> list[Cookie]:
        """Return a new cookie that identifies this browser; an empty list if it has one."""
        if device_of(request):
            return []
        secure, path = self._jar(request)
        made = Cookie(
            key=self._device,
            value=self._keys.new_device(),
            max_age=_DEVICE_SECONDS,
            httponly=True,
            samesite="strict",
            secure=secure,
            path=path,
        )
        return [made]

    def farewell(self, request: _Asking, unwritten: Unavailable | None = None) -> Response[None]:
        """Return the answer that deletes the session cookie. `unwritten`: why other processes may
        not know of the end of the session."""
        content: Any = None if unwritten is None else problem_of(unwritten)
        response: Response[None] = Response(
            content,
            status_code=204 if unwritten is None else unwritten.status,
            media_type=None if unwritten is None else PROBLEM_JSON,
        )
        response.delete_cookie(self._cookie, path=self._jar(request)[1])
        return response

    def _jar(self, request: _Asking) -> tuple[bool, str]:
        """Return whether the client's cookie is `Secure`, and its path."""
        if self._addresses is None:
            return False, "/"
        return self._addresses.jar(request.headers.get("host", ""))

    def _admit(self, request: _Asking) -> None:
        address = request.client.host if request.client is not None else ""
        if self._pace is not None and not self._pace.of(address).take():
            raise TooMany("Too many tries from your address; wait a minute.")


def session_routes(
    keys: Keys,
    page_port: int,
    *,
    reception: Callable[[], InvitationRegistry],
    revoked: Revocations,
    browsers: SessionFiles,
    addresses: Addresses | None = None,
    limits: bool = True,
) -> list[ControllerRouterHandler]:
    """Return the routes under `/api/session`."""
    sessions = Sessions(keys, page_port, reception, addresses=addresses, limits=limits)

    @get("/api/session", summary="Who is signed in", operation_id="getSession")
    async def who(request: _Asking) -> SignedIn:
        session = live_session(request)
        await to_thread.run_sync(browsers.note, session)
        return _signed_in(session)

    @post(
        "/api/session",
        status_code=200,
        summary="Sign in, or change one's name",
        operation_id="signIn",
        request_max_body_size=_BODY,
    )
    async def sign_in(data: JSONBody[SignIn], request: _Asking) -> Response[SignedIn]:
        session = await sessions.session(data, request)
        await to_thread.run_sync(browsers.note, session)
        return sessions.answer(session, request)

    @post(
        "/api/session/invitation",
        status_code=200,
        summary="What an invitation leads to",
        operation_id="lookAtInvitation",
        request_max_body_size=_BODY,
    )
    async def look(data: JSONBody[InvitationQuestion], request: _Asking) -> Invited:
        return sessions.look(data.invitation, request)

    @delete(
        "/api/session",
        status_code=204,
        summary="Sign out: this session ends, everywhere",
        operation_id="signOut",
    )
    async def sign_out(request: _Asking) -> Response[None]:
        try:
            await _end(revoked, request)
        except Unavailable as unwritten:
            return sessions.farewell(request, unwritten)
        return sessions.farewell(request)

    return [who, sign_in, look, sign_out]


def revocation(revoked: Revocations) -> list[ControllerRouterHandler]:
    """Return the route by which the editor ends sessions in a process without invitations: the
    runner, which may be on another computer."""

    @post(
        "/api/revocations",
        status_code=204,
        summary="End every session that came in by an invitation, or one session",
        operation_id="revokeSessions",
        guards=[Needs("share")],
    )
    async def revoke(data: JSONBody[Revocation]) -> None:
        try:
            match data:
                case Revocation(invitation=str(invitation), session=None):
                    await to_thread.run_sync(revoked.add, invitation)
                case Revocation(invitation=None, session=str(session)):
                    await to_thread.run_sync(revoked.end, session)
                case _:
                    raise BadInput("Name an invitation or a session, one of the two.")
        except ValueError as error:
            raise BadInput(f"{error}.", where={"path": "/invitation"}) from error

    @delete(
        "/api/session",
        status_code=204,
        summary="Sign out: this session ends, everywhere",
        operation_id="signOut",
    )
    async def sign_out(request: _Asking) -> None:
        await _end(revoked, request)

    return [revoke, sign_out]


async def _end(revoked: Revocations, request: _Asking) -> None:
    """End every session that this browser holds, also expired ones. Raise Unavailable if that
    cannot be stored."""
    sessions: list[Session] = request.scope["state"].get("sessions", [])
    unwritten: Unavailable | None = None
    for each in dict.fromkeys(session.id for session in sessions):
        try:
            await to_thread.run_sync(revoked.end, each)
        except Unavailable as error:  # it holds here; so shall the others
            unwritten = error
    if unwritten is not None:
        raise unwritten


async def _invited(
    keys: Keys, reception: InvitationRegistry, proof: str, name: str, request: _Asking
) -> Session:
    """Return a session for a person who comes in by an invitation. A person whose present role is
    higher keeps their session."""
    invited = reception.look(proof)
    now = session_of(request)
    if now is not None and rank(now.person.role) >= rank(invited.role):
        return _renamed(keys, now, name)
    known = known_person(request)
    session = keys.new_session(
        name or _name(known),
        role=invited.role,
        invitation=invited.id,
        person_id=known.id if known is not None else None,
        session_id=now.id if now is not None else None,
    )
    await reception.welcome(invited.id, session.person)
    return session


def _signed_in(session: Session) -> SignedIn:
    return SignedIn(session.person, bool(session.person.name))


def _renamed(keys: Keys, session: Session, name: str) -> Session:
    person = session.person
    return keys.new_session(
        name or person.name,
        role=person.role,
        invitation=session.invitation,
        person_id=person.id,
        session_id=session.id,
    )


def _name(known: Person | None) -> str:
    return known.name if known is not None else ""
