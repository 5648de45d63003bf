"""Sign-in: a token or an invitation is traded for a cookie that either process can verify."""

import contextlib
import hmac
import time
from collections.abc import Awaitable, Callable
from typing import Annotated, Any, Final, Literal, Protocol, TypeAlias

import msgspec
from anyio import to_thread
from litestar import Request, Response, delete, get, post, put
from litestar.datastructures import Cookie
from litestar.params import FromPath, JSONBody
from litestar.types import ControllerRouterHandler
from msgspec.structs import replace

from action_assistant.errors import BadInput, Forbidden, TooMany, Unauthenticated, Unavailable
from action_assistant.kit.token_bucket import TokenBuckets
from action_assistant.random_ids import random_id
from action_assistant.web.auth.access import (
    Needs,
    Open,
    client_address,
    cookie_name,
    device_cookie_name,
    device_of,
    expired_session,
    identity_of,
    live_session,
    session_of,
)
from action_assistant.web.auth.browser_names import browser_name
from action_assistant.web.auth.caller import Origin, acting_for, client_network
from action_assistant.web.auth.confirmations import is_sure
from action_assistant.web.auth.desk import Held
from action_assistant.web.auth.device_codes import DeviceCodes, WaitingDevice
from action_assistant.web.auth.keys import SESSION_SECONDS, Keys, Person, PersonRef, Session
from action_assistant.web.auth.people_files import NAME_LIMIT, PeopleFiles, PersonFile
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.roles import OWNER, Role, rank
from action_assistant.web.auth.standing import Standings
from action_assistant.web.http.problems import PROBLEM_JSON, problem_of
from action_assistant.web.network.addresses import Addresses

_BODY: Final = 10_000  # bytes; strangers send it
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
    name: Annotated[str, msgspec.Meta(max_length=NAME_LIMIT)] | None = None


class SignedIn(msgspec.Struct, frozen=True):
    """The person who is signed in. `named` is false until the person has given a name. `personal`:
    an owner has given it, since the person came by a personal link."""

    person: Person
    named: bool
    personal: bool = False


class InvitationQuestion(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An invitation about which a person asks before using it."""

    invitation: Annotated[str, msgspec.Meta(max_length=200)]


class Invited(msgspec.Struct, frozen=True):
    """The role that a link invites to, and who made the link. `name`: of the one person for whom
    it is; null for a link for everybody who has it."""

    id: str
    role: Role
    by: str
    name: str | None = None


class CodeOfDevice(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The code that a browser of the person shows, typed in on another one."""

    code: Annotated[str, msgspec.Meta(max_length=40)]


class ClaimOfDevice(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The claim of a browser that waits to be confirmed."""

    claim: Annotated[str, msgspec.Meta(max_length=100)]


class DeviceAnswer(msgspec.Struct, frozen=True, omit_defaults=True):
    """The answer to a browser that waits: the session, or nothing while nobody has confirmed it."""

    signed_in: SignedIn | None = None


class Revocation(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The invitation or token that is revoked, or the session or person that is ended: exactly one
    of them."""

    invitation: str | None = None
    session: str | None = None
    person: str | None = None
    token: str | None = None


class SessionEnd(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The end of a session by its person. `seal`: from the editor's list of their devices."""

    session: Annotated[str, msgspec.Meta(max_length=40)]
    person: Annotated[str, msgspec.Meta(max_length=40)]
    seal: Annotated[str, msgspec.Meta(max_length=100)]


class InvitationRegistry(Protocol):
    """Knows the links, and the people who came in by them."""

    async def look(self, proof: str) -> Invited:
        """Return the invitation of a link, without using it. `proof`: the secret part of the link.
        Raise Unauthenticated if it is unknown, or the invitation has expired or was revoked."""

    async def come_in(self, link: str, session: str, browser: str, address: str) -> PersonFile:
        """Use a personal link for the session with this id, and return its person. Of several who use
        it at once, one comes in; raise Unauthenticated for the others."""

    async def welcome(self, invitation: str, person: PersonRef) -> None:
        """Record that a person came in by an invitation."""


#: The means by which somebody signs in.
SignInMeans: TypeAlias = Literal["token", "link", "personal", "device", "oidc"]


#: What can be ended for a process that has no people of its own.
EndableKind: TypeAlias = Literal["invitation", "session", "person", "token"]


class SessionAudit(Protocol):
    """Keeps who signed in and out."""

    def signed_in(self, session: Session, how: SignInMeans) -> None:
        """Keep that the person of a session has signed in."""

    def signed_out(self, session: Session) -> None:
        """Keep that the person of a session has ended it."""


class ToldAudit(SessionAudit, Protocol):
    """Keeps what people told a process without people of its own."""

    def ended_here(self, what: EndableKind, id_: str, author: str) -> None:
        """Record that the person `author` notified this process of the end of an invitation,
        session, person or token (`what`) with the id `id_`, which has ended in the process that
        has people."""

    def person_stored(self, person: PersonFile, author: str) -> None:
        """Keep that a person told this process the state of somebody."""


class NoAudit:
    """Ignores who signs in and out, for tests and programs without a log."""

    def signed_in(self, session: Session, how: SignInMeans) -> None:
        """Ignore that somebody has signed in."""

    def signed_out(self, session: Session) -> None:
        """Ignore that somebody has signed out."""


class Sessions:
    """Trades tokens and invitations for sessions. `audit` keeps who signed in and out."""

    def __init__(
        self,
        keys: Keys,
        page_port: int,
        reception: Callable[[], InvitationRegistry],
        revoked: Revocations,
        standings: Standings,
        *,
        addresses: Addresses | None = None,
        limits: bool = True,
        audit: SessionAudit | None = None,
    ) -> None:
        self._audit: SessionAudit = audit or NoAudit()
        self._keys = keys
        self._revoked = revoked
        self._standings = standings
        self._cookie = cookie_name(page_port)
        self._device = device_cookie_name(page_port)
        self._reception = reception
        self._addresses = addresses
        self._pace = TokenBuckets(_TRIES_AT_ONCE, _TRIES_PER_MINUTE / 60) if limits else None

    async def look(self, invitation: str, request: _Asking) -> Invited:
        """Return the invitation of a link. Raise Unauthenticated if the link is not valid, TooMany
        if this address tries too often."""
        self.admit(request)
        return await self._reception().look(invitation)

    def note_sign_in(self, session: Session, how: SignInMeans, request: _Asking) -> None:
        """Keep in the audit that somebody signed in. A person who keeps their session has not."""
        if session == session_of(request):
            return
        with acting_for(session.person.id, connection_of(session, request)):
            self._audit.signed_in(session, how)

    def note_end(self, request: _Asking) -> None:
        """Keep in the audit that the person of this browser signed out."""
        note_sign_out(self._audit, request)

    async def leave(self, request: _Asking) -> None:
        """End the session that this browser has, since another one replaces it."""
        now = session_of(request)
        if now is not None:
            note_sign_out(self._audit, request)
            with contextlib.suppress(Unavailable):  # it holds here
                await to_thread.run_sync(self._revoked.end, now.id)

    async def session(self, data: SignIn, request: _Asking) -> Session:
        """Return the session for a sign-in. Raise Unauthenticated, TooMany or BadInput."""
        name = " ".join((data.name or "").split())
        match data:
            case SignIn(token=None, invitation=None):
                return _renamed(self._keys, live_session(request), name)
            case SignIn(token=str(token), invitation=None):
                if not self._keys.opens(token):
                    self.admit(request)
                    raise Unauthenticated("This is not the token of this server.")
                # The link again, in a browser that is or was signed in: the same person, since what
                # older tabs have written belongs to them.
                return await self._begun(name, request)
            case SignIn(token=None, invitation=str(proof)):
                self.admit(request)
                return await self._invited(proof, name, request)
            case _:
                raise BadInput("Send the token or an invitation, not both.")

    def follow(self, first: Session) -> Session:
        """Return a new session, for another browser, of the person to whom the session `first`
        belongs. Raise Unauthenticated if `first` has ended meanwhile."""
        standing = self._standings.of(first)
        if self._revoked.ends(first) or standing.expired:
            raise Unauthenticated("The session that showed the code has ended.")
        return self._keys.new_session(
            standing.person.name,
            role=standing.person.role,
            invitation=first.invitation,
            person_id=first.person.id,
            personal=first.personal,
            added=not is_sure(standing.confirmed_at, time.time()),
            seconds=self._standings.limits[standing.person.role].longest,
        )

    async def _invited(self, proof: str, name: str, request: _Asking) -> Session:
        """Return a session for a person who comes in by a link. A person whose present role is
        higher keeps their session, unless the link is for one person."""
        invited = await self._reception().look(proof)
        if invited.name is not None:
            return await self._came(invited.id, request)
        now = session_of(request)
        if now is not None and rank(identity_of(request).person.role) >= rank(invited.role):
            return _renamed(self._keys, now, name)
        session = await self._begun(name, request, role=invited.role, invitation=invited.id)
        with acting_for(session.person.id, connection_of(session, request)):
            await self._reception().welcome(invited.id, session.person)
        return session

    async def _came(self, link: str, request: _Asking) -> Session:
        """Return the session of the person of a personal link."""
        browser, session = browser_of(request), random_id()
        address = client_address(request.scope)
        person = await self._reception().come_in(link, session, browser, address)
        return await self.begin(person, session, request)

    async def begin(self, person: PersonFile, session: str, request: _Asking) -> Session:
        """Return the session with this id of a person with rights of their own. The session that this
        browser had ends, unless it is this one, which goes on."""
        now = session_of(request)
        if now is None or now.id != session:
            await self.leave(request)
        return self._keys.new_session(
            person.name,
            role=person.role,
            person_id=person.id,
            session_id=session,
            personal=True,
            seconds=self._standings.limits[person.role].longest,
        )

    async def _begun(
        self,
        name: str,
        request: _Asking,
        *,
        role: Role = OWNER,
        invitation: str | None = None,
    ) -> Session:
        """Return a session by the token or a group link: of the person of this browser, under a
        new id where that is a new person. A person with a personal link stays who they are only by
        that. A session whose role rises gets a new id, and the old one ends: somebody who has put a
        cookie of their own into this browser shares nothing with it from then on."""
        now = session_of(request)
        session = now or expired_session(request)
        if session is not None and session.personal:
            now = session = None
        if now is not None and rank(role) > rank(identity_of(request).person.role):
            await self.leave(request)
            now = None
        known = None if session is None else session.person
        return self._keys.new_session(
            name or _name(known),
            role=role,
            invitation=invitation,
            person_id=known.id if known is not None else None,
            session_id=now.id if now is not None else None,
            added=now.added if now is not None else known is not None,
            seconds=self._standings.limits[role].longest,
        )

    def answer(self, session: Session, request: _Asking, content: Any = None) -> Response[Any]:
        """Return the answer that sets the cookie of a session; by default it says whose that is."""
        secure, path = self.jar(request)
        cookie = Cookie(
            key=self._cookie,
            value=self._keys.sealed(session),
            # An expired session still stops runs, so the browser keeps it for longer.
            max_age=int(session.expires - time.time()) + SESSION_SECONDS,
            httponly=True,
            samesite="strict",
            secure=secure,
            path=path,
        )
        return Response(
            content if content is not None else signed_in(session),
            status_code=200,
            cookies=[cookie, *self._device_cookie(request)],
        )

    def _device_cookie(self, request: _Asking) -> list[Cookie]:
        """Return a new cookie that identifies this browser; an empty list if it has one."""
        if device_of(request):
            return []
        secure, path = self.jar(request)
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
        """Return the answer that deletes the session cookie. `unwritten`: the error by which the
        end of the session was not stored, so that other processes may still accept it; the answer
        then has the status and body of this error."""
        content: Any = None if unwritten is None else problem_of(unwritten)
        response: Response[None] = Response(
            content,
            status_code=204 if unwritten is None else unwritten.status,
            media_type=None if unwritten is None else PROBLEM_JSON,
        )
        response.delete_cookie(self._cookie, path=self.jar(request)[1])
        return response

    def jar(self, request: _Asking) -> tuple[bool, str]:
        """Return whether the client's cookie is `Secure`, and its path."""
        if self._addresses is None:
            return False, "/"
        return self._addresses.jar(request.headers.get("host", ""))

    def admit(self, request: _Asking) -> None:
        """Raise TooMany if this address tries too often."""
        if self._pace is not None and not self._pace.of(client_network(request)).take():
            raise TooMany("Too many tries from your address; wait a minute.")


def session_routes(
    sessions: Sessions,
    *,
    revoked: Revocations,
    standings: Standings,
    codes: Held[DeviceCodes],
    device_added: Callable[[Session, str, str], Awaitable[None]] | None = None,
) -> list[ControllerRouterHandler]:
    """Return the routes under `/api/session`. `device_added` stores that a device was added, with
    its session, browser and address."""
    return [
        *_own_session(sessions, revoked, standings),
        *_new_device(sessions, standings, codes, device_added or _added),
    ]


async def _added(session: Session, browser: str, address: str) -> None:
    """Store nothing about a new device."""


def _new_device(
    sessions: Sessions,
    standings: Standings,
    codes: Held[DeviceCodes],
    added: Callable[[Session, str, str], Awaitable[None]],
) -> list[ControllerRouterHandler]:
    @post(
        "/api/session/device",
        status_code=200,
        summary="Send the code that a signed-in browser shows, to be added as a device",
        operation_id="sendDeviceCode",
        request_max_body_size=_BODY,
        guards=[Open()],
    )
    async def send(data: JSONBody[CodeOfDevice], request: _Asking) -> WaitingDevice:
        sessions.admit(request)
        browser, address = browser_of(request), client_address(request.scope)
        return await codes.call(DeviceCodes.claim, data.code, browser, address)

    @post(
        "/api/session/device/answer",
        status_code=200,
        summary="Ask whether the person has confirmed this device; it is then signed in",
        operation_id="collectDevice",
        request_max_body_size=_BODY,
        guards=[Open()],
    )
    async def collect(data: JSONBody[ClaimOfDevice], request: _Asking) -> Response[DeviceAnswer]:
        confirmed = await codes.call(DeviceCodes.confirmed, data.claim)
        if confirmed is None:
            return Response(DeviceAnswer(), status_code=200)
        await to_thread.run_sync(standings.browsers.require_room, confirmed.session.person.id)
        # Another request may have used the claim meanwhile.
        confirmed = await codes.call(DeviceCodes.collect, data.claim)
        session = sessions.follow(confirmed.session)
        with acting_for(session.person.id, connection_of(session, request)):
            await added(session, confirmed.browser, confirmed.address)
        await sessions.leave(request)
        sessions.note_sign_in(session, "device", request)
        await to_thread.run_sync(
            standings.browsers.note, session, confirmed.browser, confirmed.address
        )
        return sessions.answer(session, request, DeviceAnswer(signed_in(session)))

    return [send, collect]


def _own_session(
    sessions: Sessions, revoked: Revocations, standings: Standings
) -> list[ControllerRouterHandler]:
    async def note(session: Session, request: _Asking) -> None:
        await to_thread.run_sync(
            standings.browsers.note, session, browser_of(request), client_address(request.scope)
        )

    @get(
        "/api/session",
        summary="Who is signed in",
        operation_id="getSession",
        guards=[Open()],
    )
    async def who(request: _Asking) -> SignedIn:
        session = live_session(request)
        await note(session, request)
        return signed_in(replace(session, person=identity_of(request).person))

    @post(
        "/api/session",
        status_code=200,
        summary="Sign in, or change one's name",
        operation_id="signIn",
        request_max_body_size=_BODY,
        guards=[Open()],
    )
    async def sign_in(data: JSONBody[SignIn], request: _Asking) -> Response[SignedIn]:
        session = await sessions.session(data, request)
        await note(session, request)
        if data.token is not None or data.invitation is not None:
            by_link: SignInMeans = "personal" if session.personal else "link"
            sessions.note_sign_in(session, "token" if data.token else by_link, request)
        return sessions.answer(session, request)

    @post(
        "/api/session/invitation",
        status_code=200,
        summary="What an invitation leads to",
        operation_id="lookAtInvitation",
        guards=[Open()],
        request_max_body_size=_BODY,
    )
    async def look(data: JSONBody[InvitationQuestion], request: _Asking) -> Invited:
        return await sessions.look(data.invitation, request)

    @delete(
        "/api/session",
        status_code=204,
        summary="Sign out: this session ends, everywhere",
        operation_id="signOut",
        guards=[Open()],
    )
    async def sign_out(request: _Asking) -> Response[None]:
        sessions.note_end(request)
        try:
            await _end(revoked, request)
        except Unavailable as unwritten:
            return sessions.farewell(request, unwritten)
        return sessions.farewell(request)

    return [who, sign_in, look, sign_out]


def revocation(
    keys: Keys, revoked: Revocations, people: PeopleFiles, audit: ToldAudit, *, limits: bool
) -> list[ControllerRouterHandler]:
    """Return the routes by which owners end sessions and change persons in a process without
    people of its own: the runner, which may be on another computer. `audit` keeps who signed out;
    with `limits` each network ends so many sessions of its own."""
    pace = TokenBuckets(_TRIES_AT_ONCE, _TRIES_PER_MINUTE / 60) if limits else None

    @put(
        "/api/members/{person:str}",
        status_code=204,
        summary="Store the present name, role and groups of a person with a personal link",
        operation_id="storeMember",
        guards=[Needs("share")],
    )
    async def store(person: FromPath[str], data: JSONBody[PersonFile], request: _Asking) -> None:
        if person != data.id:
            raise BadInput("The path names another person than the body.", where={"path": "/id"})
        try:
            await to_thread.run_sync(people.write, data)
        except ValueError as error:
            raise BadInput(f"{error}.", where={"path": "/id"}) from error
        finally:
            if people.get(data.id) == data:  # also if only this process holds it
                audit.person_stored(data, identity_of(request).person.id)

    @post(
        "/api/revocations",
        status_code=204,
        summary="End every session of an invitation or a person, or one session or token",
        operation_id="revokeSessions",
        guards=[Needs("share")],
    )
    async def revoke(data: JSONBody[Revocation], request: _Asking) -> None:
        enders: dict[EndableKind, Callable[[str], None]] = {
            "invitation": revoked.add,
            "session": revoked.end,
            "person": revoked.end_person,
            "token": revoked.end_token,
        }
        named: dict[EndableKind, str] = {
            kind: id_ for kind in enders if (id_ := getattr(data, kind)) is not None
        }
        if len(named) != 1:
            raise BadInput("Name one invitation, session, person or token.")
        ((kind, id_),) = named.items()
        try:
            await to_thread.run_sync(enders[kind], id_)
        except ValueError as error:
            raise BadInput(f"{error}.", where={"path": f"/{kind}"}) from error
        except Unavailable:  # it holds here
            audit.ended_here(kind, id_, identity_of(request).person.id)
            raise
        audit.ended_here(kind, id_, identity_of(request).person.id)

    @delete(
        "/api/session",
        status_code=204,
        summary="Sign out: this session ends, everywhere",
        operation_id="signOut",
        guards=[Open()],
    )
    async def sign_out(request: _Asking) -> None:
        note_sign_out(audit, request)
        await _end(revoked, request)

    @post(
        "/api/sessions/ended",
        status_code=204,
        summary="Tell this process that a person has ended one of their own sessions",
        operation_id="tellEndedSession",
        description="For a runner with a data folder of its own.",
        request_max_body_size=_BODY,
        guards=[Open()],
    )
    async def end_own(data: JSONBody[SessionEnd], request: _Asking) -> None:
        if pace is not None and not pace.of(client_network(request)).take():
            raise TooMany("Too many sessions ended from your address; wait a minute.")
        expected = keys.end_seal(data.session, data.person)
        if not hmac.compare_digest(expected.encode(), data.seal.encode()):
            raise BadInput("This server did not seal the end of this session.")
        try:
            await to_thread.run_sync(revoked.end, data.session)
        finally:
            with acting_for(data.person, Origin(address=client_address(request.scope))):
                audit.ended_here("session", data.session, data.person)

    return [store, revoke, sign_out, end_own]


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


def connection_of(session: Session, request: _Asking) -> Origin:
    """Return the connection by which the person of a session sends this request."""
    return Origin(session.person.name, session.id, address=client_address(request.scope))


def note_sign_out(audit: SessionAudit, request: _Asking) -> None:
    """Keep in the audit that the sessions of this browser end by its person. Sessions that have ended
    before end no second time."""
    session = session_of(request) or expired_session(request)
    if session is not None:
        with acting_for(session.person.id, connection_of(session, request)):
            audit.signed_out(session)


def signed_in(session: Session) -> SignedIn:
    """Return the answer that says whose a session is."""
    return SignedIn(session.person, bool(session.person.name), session.personal)


def browser_of(request: _Asking) -> str:
    """Return the readable name of the browser that sent a request."""
    return browser_name(request.headers.get("user-agent", ""))


def _renamed(keys: Keys, session: Session, name: str) -> Session:
    """Return a session under another name. It expires when it would have expired."""
    if session.personal:
        if name and name != session.person.name:
            raise Forbidden("An owner has given you your name; only they change it.")
        return session
    person = Person(session.person.id, name or session.person.name, session.person.role)
    if session.begun:
        return replace(session, person=person)
    return keys.new_session(
        person.name,
        role=person.role,
        invitation=session.invitation,
        person_id=person.id,
        session_id=session.id,
        added=session.added,
    )


def _name(known: Person | None) -> str:
    return known.name if known is not None else ""
