"""Routes of the sign-in by an OpenID Connect provider: its offer, its begin, and its answer.

The provider sends the browser back to a page of ours, which hands the answer in. So our own cookie,
which other sites cannot send, is set and sent by requests of our own page, and a person who was away
at the provider is back where they wanted to go. What ties an answer to its begin is in a sealed cookie
of the browser that began; nothing is kept here for somebody who never comes back.
"""

import hmac
import logging
import re
import secrets
import time
from collections.abc import Callable
from typing import Annotated, Any, Final

import msgspec
from anyio import to_thread
from litestar import Request, Response, get, post
from litestar.datastructures import Cookie
from litestar.params import JSONBody
from litestar.types import ControllerRouterHandler

from action_assistant.editor.people.identity_provider import (
    IdentityProvider,
    ProviderIdentity,
    Question,
)
from action_assistant.editor.people.provided import provided, provided_id, refused
from action_assistant.editor.services import EditorState
from action_assistant.errors import Conflict, Forbidden, Unauthenticated, Unavailable
from action_assistant.random_ids import random_id
from action_assistant.safe_text import one_line
from action_assistant.settings import LOOPBACK
from action_assistant.web.audit.events import Confirmed, SessionEnded
from action_assistant.web.audit.log import AuditLog
from action_assistant.web.auth.access import (
    Open,
    client_address,
    cookie_values,
    live_session,
    session_of,
)
from action_assistant.web.auth.caller import Origin, acting_for
from action_assistant.web.auth.confirmations import Confirmations
from action_assistant.web.auth.desk import Held
from action_assistant.web.auth.keys import Keys, Session
from action_assistant.web.auth.people_files import NAME_LIMIT
from action_assistant.web.auth.session_files import SessionFiles
from action_assistant.web.auth.sessions import (
    Sessions,
    SignedIn,
    browser_of,
    signed_in,
)
from action_assistant.web.network.addresses import Addresses, host_name

log: Final = logging.getLogger(__name__)

#: Below the address of the page: the page to which a provider sends the browser back.
RETURN_PATH: Final = "/signed-in"
_LIFE_S: Final = 600.0
_KEPT: Final = 4  # sign-ins that one browser may have under way, besides the newest
_ASKED_S: Final = 5.0  # by which the provider may have asked before it was told to ask
_SKEW_S: Final = 120.0
_BODY: Final = 20_000  # bytes; strangers send it
_Short = Annotated[str, msgspec.Meta(max_length=200)]
_Long = Annotated[str, msgspec.Meta(max_length=4000)]
_Asking = Request[Any, Any, Any]


class ProviderOffer(msgspec.Struct, frozen=True):
    """The provider by which people may sign in from the address that they came to. `name`: null where
    there is none. `mine`: the person who asks came by it, and can prove by it that it is they."""

    name: str | None
    mine: bool = False


class ProviderBegin(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The request to sign in by the provider. `goal`: the path of the page to be shown afterwards.
    `again`: the person is signed in, and proves that it is they."""

    goal: _Long = "/"
    again: bool = False


class ProviderVisit(msgspec.Struct, frozen=True):
    """The address of the provider to which the browser has to go now."""

    url: str


class ProviderAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The parameters with which the provider sent the browser back, as they stand in the address."""

    state: _Short
    code: _Long | None = None
    iss: _Long | None = None
    error: _Short | None = None
    error_description: _Long | None = None


class ProviderResult(msgspec.Struct, frozen=True):
    """The end of a sign-in. `goal`: the path of the page to be shown now. `signed_in`: null if a person
    who was signed in has only proved that it is they."""

    goal: str
    signed_in: SignedIn | None = None


class _UnderWay(Question, frozen=True):
    """A sign-in between its begin and its answer, as the sealed cookie holds it. `session`: of the
    person who proves that it is they; "" for a sign-in."""

    issuer: str = ""
    client_id: str = ""
    goal: str = "/"
    session: str = ""


class AnsweredStates:
    """The sign-ins that were answered, by their states, for as long as they could be answered."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._until: dict[str, float] = {}

    def add(self, state: str) -> bool:
        """Note that a sign-in is answered, and return whether it was not before."""
        now = self._clock()
        self._until = {each: until for each, until in self._until.items() if until > now}
        is_first = state not in self._until
        self._until.setdefault(state, now + _LIFE_S)
        return is_first


class ProviderSignIn:
    """Begins sign-ins, and takes their answers, each once."""

    def __init__(
        self,
        provider: IdentityProvider | None,
        app_state: EditorState,
        sessions: Sessions,
        keys: Keys,
        page_port: int,
        addresses: Addresses,
        browsers: SessionFiles,
        confirmations: Confirmations,
        audit: AuditLog,
        answers: "Held[AnsweredStates]",
    ) -> None:
        self._provider = provider
        self._app_state = app_state
        self._sessions = sessions
        self._keys = keys
        self._cookie: Final = f"aa_{page_port}_provider_"
        self._port = page_port
        self._addresses = addresses
        self._browsers = browsers
        self._confirmations = confirmations
        self._audit = audit
        self._clock = time.time
        self._answers = answers

    def offer(self, request: _Asking) -> ProviderOffer:
        """Return the provider that is offered at the address that the person came to."""
        if self._provider is None or self._page(request) is None:
            return ProviderOffer(None)
        session = session_of(request)
        mine = session is not None and self._knows(session.person.id)
        return ProviderOffer(self._provider.settings.name, mine)

    async def begin(self, data: ProviderBegin, request: _Asking) -> Response[ProviderVisit]:
        """Return the address of the provider, with the cookie of this sign-in. Raise Unavailable if
        the provider does not answer, Conflict if it is not offered here."""
        self._sessions.admit(request)
        provider, page = self._offered(request)
        session = ""
        if data.again:
            asking = live_session(request)
            if not self._knows(asking.person.id):
                raise Conflict(f"You did not come by {provider.settings.name}.")
            session = asking.id
        under_way = _UnderWay(
            state=f"{random_id()}.{secrets.token_urlsafe(32)}",
            nonce=secrets.token_urlsafe(32),
            verifier=secrets.token_urlsafe(32),
            redirect=page + RETURN_PATH,
            begun=self._clock(),
            issuer=provider.settings.issuer,
            client_id=provider.settings.client_id,
            goal=_goal(data.goal),
            session=session,
        )
        url = await provider.address(under_way, again=data.again)
        sealed = self._keys.sealed_question(msgspec.json.encode(under_way))
        cookies = [self._baked(request, under_way.state, sealed)]
        # A browser that begins over and over would send more cookies than a server takes.
        given = re.findall(f"{self._cookie}([A-Za-z0-9]+)=", request.headers.get("cookie", ""))
        cookies += [self._baked(request, each) for each in given[:-_KEPT]]
        return Response(ProviderVisit(url), status_code=200, cookies=cookies)

    async def answer(self, data: ProviderAnswer, request: _Asking) -> Response[ProviderResult]:
        """Sign the person in whom the provider has named, or take it as proof that it is they. Raise
        Unauthenticated, Withdrawn, Forbidden, Conflict or Unavailable, each with the reason."""
        self._sessions.admit(request)
        provider, _ = self._offered(request)
        under_way = self._begun(data.state, request, provider)
        if under_way is None or not await self._answers.call(AnsweredStates.add, data.state):
            raise Unauthenticated(
                "Nobody was signed in: this sign-in was not begun in this browser, was answered already, "
                "or is older than 10 minutes. Begin again."
            )
        await provider.check_sender(data.iss)
        if data.code is None:
            why = one_line((data.error_description or data.error or "nothing")[:200])
            raise Unauthenticated(f"Nobody was signed in: {provider.settings.name} says “{why}”.")
        found = await provider.identity(data.code, under_way)
        gone = self._baked(request, under_way.state)
        if under_way.session:
            await self._prove(found, under_way, request, provider)
            return Response(ProviderResult(under_way.goal), status_code=200, cookies=[gone])
        session = await self._come(found, request, provider)
        content = ProviderResult(under_way.goal, signed_in(session))
        response = self._sessions.answer(session, request, content)
        response.cookies.append(gone)
        return response

    def _offered(self, request: _Asking) -> tuple[IdentityProvider, str]:
        """Return the provider, and the address of the page. Raise Conflict if it is not offered at the
        address that the person came to."""
        page = self._page(request)
        if self._provider is None or page is None:
            raise Conflict(
                "Nobody signs in by a provider at this address: open the page by https, or on the "
                "computer of the server itself."
            )
        return self._provider, page

    def _knows(self, person: str) -> bool:
        """Return whether a person came by this provider."""
        _, record = self._app_state.services.members.known(person)
        known = None if self._provider is None else self._provider.settings.issuer
        return record is not None and record.issuer == known

    def _page(self, request: _Asking) -> str | None:
        """Return the address of the page as the person came to it; None unless the way is encrypted or
        does not leave this computer: what a provider sends back would be read on the way."""
        host = request.headers.get("host", "")
        public = self._addresses.public_at(host)
        page = public.page if public is not None else self._addresses.direct(host, self._port)
        return page if page.startswith("https:") or host_name(host) in LOOPBACK else None

    def _begun(self, state: str, request: _Asking, provider: IdentityProvider) -> _UnderWay | None:
        """Return the sign-in of an answer; None if this browser did not begin it, or it is too old."""
        now = self._clock()
        name = self._cookie + state.partition(".")[0]
        for value in cookie_values(request.headers.get("cookie", ""), name):
            found = _opened(self._keys.question(value))
            if (
                found is not None
                and hmac.compare_digest(found.state.encode(), state.encode())
                and found.issuer == provider.settings.issuer
                and found.client_id == provider.settings.client_id
                and 0 <= now - found.begun < _LIFE_S
            ):
                return found
        return None

    async def _come(
        self, found: ProviderIdentity, request: _Asking, provider: IdentityProvider
    ) -> Session:
        """Return the session of a person of whom the provider has spoken."""
        settings, members = provider.settings, self._app_state.services.members
        person = provided_id(found.issuer, found.subject)
        members.refuse_ended(person)
        role, address = settings.role(found.groups), client_address(request.scope)
        if role is None:
            with acting_for(person, Origin(found.name[:NAME_LIMIT], address=address)):
                await self._put_out(person, found)
            raise Forbidden(
                f"{settings.name} knows you, but none of your groups there may come in here. Ask "
                "the person who runs this server."
            )
        mapped = settings.groups.keys() & set(found.groups)
        now = session_of(request)
        goes_on = now is not None and now.personal and now.person.id == person
        id_ = now.id if now is not None and goes_on else random_id()
        with acting_for(person, Origin(found.name[:NAME_LIMIT], id_, address=address)):
            came = await provided(members, found.issuer, found.subject, found.name, role, mapped)
        session = await self._sessions.begin(came, id_, request)
        self._sessions.note_sign_in(session, "oidc", request)
        await to_thread.run_sync(self._browsers.note, session, browser_of(request), address)
        return session

    async def _put_out(self, person: str, found: ProviderIdentity) -> None:
        """End the sessions of a person whose groups give no access any more. Restrict their tokens,
        and sessions that nobody has noted, to Stop."""
        ended = await to_thread.run_sync(self._browsers.end_all_of, person)
        for session in ended.ids:
            self._audit.note(SessionEnded(session), person)
        left = [] if ended.left is None else [ended.left.detail]
        try:
            await refused(self._app_state.services.members, found.issuer, found.subject)
        except Unavailable as error:
            left.append(error.detail)
        if left:
            log.error(
                "%s may not come in any more, and is not quite out: %s", person, "; ".join(left)
            )

    async def _prove(
        self,
        found: ProviderIdentity,
        under_way: _UnderWay,
        request: _Asking,
        provider: IdentityProvider,
    ) -> None:
        """Take a fresh sign-in at the provider as proof that a session is used by its person."""
        session = live_session(request)
        if session.id != under_way.session:
            raise Unauthenticated("This browser is signed in otherwise by now. Begin again.")
        name = provider.settings.name
        if provided_id(found.issuer, found.subject) != session.person.id:
            raise Forbidden(f"You signed in at {name} as somebody else.")
        since = self._clock() - under_way.begun + _ASKED_S
        if found.asked_s is None or not -_SKEW_S <= found.asked_s <= since:
            raise Forbidden(f"{name} did not ask you again, so this proves nothing.")
        await to_thread.run_sync(self._confirmations.confirm, session.id, "oidc")
        self._audit.note(Confirmed(session.id, "oidc"), session.person.id)

    def _baked(self, request: _Asking, state: str, value: str = "") -> Cookie:
        """Return the cookie of a sign-in; without a value, one that deletes it. It comes along when
        the provider sends the browser back; other requests of other sites do not have it."""
        secure, path = self._sessions.jar(request)
        return Cookie(
            key=self._cookie + state.partition(".")[0],
            value=value,
            max_age=int(_LIFE_S) if value else 0,
            httponly=True,
            samesite="lax",
            secure=secure,
            path=path,
        )


def routes(sign_in: ProviderSignIn) -> list[ControllerRouterHandler]:
    """Return the routes under `/api/session/provider`."""

    @get(
        "/api/session/provider",
        summary="By which provider people may sign in at this address",
        operation_id="getProvider",
        guards=[Open()],
    )
    async def offer(request: _Asking) -> ProviderOffer:
        return sign_in.offer(request)

    @post(
        "/api/session/provider",
        status_code=200,
        summary="Begin to sign in by the provider: where the browser has to go",
        operation_id="beginProvider",
        request_max_body_size=_BODY,
        guards=[Open()],
    )
    async def begin(data: JSONBody[ProviderBegin], request: _Asking) -> Response[ProviderVisit]:
        return await sign_in.begin(data, request)

    @post(
        "/api/session/provider/answer",
        status_code=200,
        summary="Hand in the answer of the provider, which signs in or proves that it is the person",
        operation_id="answerProvider",
        request_max_body_size=_BODY,
        guards=[Open()],
    )
    async def answer(data: JSONBody[ProviderAnswer], request: _Asking) -> Response[ProviderResult]:
        return await sign_in.answer(data, request)

    return [offer, begin, answer]


def _opened(content: bytes | None) -> _UnderWay | None:
    """Return the sign-in in a cookie; None for a cookie that is not ours, or of another version."""
    try:
        return None if content is None else msgspec.json.decode(content, type=_UnderWay)
    except msgspec.DecodeError:
        return None


def _goal(path: str) -> str:
    """Return the path of a page of ours, or that of the first page for anything else: nobody is sent
    elsewhere after a sign-in."""
    ours = path.startswith("/") and not path.startswith(("//", "/\\")) and path.isprintable()
    return path if ours and not path.startswith("/api/") else "/"
