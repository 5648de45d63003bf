"""Requests to confirm on another device that it is the same person; in memory only.

One session asks, and pages of the same person on other devices show that. Both show the same number of two
digits. A request has one answer, and is over after two minutes.
"""

import secrets
import time
from collections.abc import Callable
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.errors import Conflict, NotFound, TooMany
from action_assistant.kit.token_bucket import TokenBuckets
from action_assistant.random_ids import random_id
from action_assistant.web.auth.confirmations import Confirmation, may_confirm
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Session

REQUEST_S: Final = 120.0
_MOST: Final = 500  # requests that are open at a time
_AT_ONCE: Final = 5  # requests of one session
_PER_MINUTE: Final = 1  # after that: nobody presses yes to be left in peace

RequestState: TypeAlias = Literal["waiting", "confirmed", "refused"]


class ConfirmationShown(msgspec.Struct, frozen=True):
    """A request, as other devices of its person show it. `browser` and `address`: of the device that
    asks, "" for the computer of the server; `robots`: on which it wants to start; `seconds`: until it
    is over."""

    id: str
    number: str
    browser: str
    address: str
    robots: tuple[str, ...]
    seconds: float


class ConfirmationRequest:
    """A request and its state. `record`: the confirmation, once another device has said yes."""

    def __init__(
        self, identity: Identity, session: Session, browser: str, robots: tuple[str, ...]
    ) -> None:
        self.id: Final = random_id()
        self.number: Final = f"{secrets.randbelow(90) + 10}"
        self.identity: Final = identity
        self.session: Final = session
        self.browser: Final = browser
        self.robots: Final = robots
        self.until = 0.0
        self.state: RequestState = "waiting"
        self.is_answered = False
        self.record: Confirmation | None = None


class ConfirmationRequests:
    """The requests of the last minutes. For one event loop. `now`: seconds since 1970."""

    def __init__(
        self,
        clock: Callable[[], float] = time.monotonic,
        now: Callable[[], float] = time.time,
        *,
        limits: bool = True,
    ) -> None:
        self._clock = clock
        self._now = now
        self._requests: dict[str, ConfirmationRequest] = {}
        self._pace = TokenBuckets(_AT_ONCE, _PER_MINUTE / 60, clock) if limits else None
        self._changed: list[Callable[[str], None]] = []

    def watch(self, changed: Callable[[str], None]) -> None:
        """Call a function from now on with the id of the person whose requests have changed."""
        self._changed.append(changed)

    def ask(
        self, identity: Identity, session: Session, browser: str, robots: tuple[str, ...]
    ) -> ConfirmationRequest:
        """Make a request for a session; its earlier one is over. Raise TooMany."""
        self._forget_old()
        if self._pace is not None and not self._pace.of(session.id).take():
            raise TooMany("You have asked your other devices often enough; wait a minute.")
        for each in [r for r in self._requests.values() if r.session.id == session.id]:
            del self._requests[each.id]
        if len(self._requests) >= _MOST:
            raise TooMany("Many people confirm just now; try again in two minutes.")
        made = ConfirmationRequest(identity, session, browser, robots)
        made.until = self._clock() + REQUEST_S
        self._requests[made.id] = made
        self._tell(identity)
        return made

    def of(self, id_: str, session: Session) -> ConfirmationRequest:
        """Return a request of this session. Raise NotFound if it is over."""
        self._forget_old()
        found = self._requests.get(id_)
        if found is None or found.session.id != session.id:
            raise NotFound("This request is over. Ask again.")
        return found

    def left(self, request: ConfirmationRequest) -> float:
        """Return the seconds until a request is over."""
        return max(0.0, request.until - self._clock())

    def cancel(self, id_: str, session: Session) -> None:
        """Withdraw a request of this session. Raise NotFound if it is over."""
        found = self.of(id_, session)
        del self._requests[found.id]
        self._tell(found.identity)

    def shown_to(self, identity: Identity) -> list[ConfirmationShown]:
        """Return the requests that this identity can answer."""
        self._forget_old()
        return [
            ConfirmationShown(
                each.id,
                each.number,
                each.browser,
                each.identity.address,
                each.robots,
                self.left(each),
            )
            for each in self._requests.values()
            if not each.is_answered and self._can_answer(each, identity)
        ]

    def answer(self, id_: str, identity: Identity, *, yes: bool) -> ConfirmationRequest:
        """Take the one answer to a request, and return it: it waits on until the confirmation is kept
        if the answer is yes. Raise NotFound for a request that this identity cannot answer, Conflict
        if it was answered."""
        self._forget_old()
        found = self._requests.get(id_)
        if found is None or not self._can_answer(found, identity):
            raise NotFound("This request is over, or for other devices.")
        if found.is_answered:
            raise Conflict("This request was answered already.")
        found.is_answered = True
        if not yes:
            found.state = "refused"
        self._tell(identity)
        return found

    def _can_answer(self, request: ConfirmationRequest, identity: Identity) -> bool:
        session = identity.session
        return (
            session is not None
            and identity.person.id == request.identity.person.id
            and session.id != request.session.id
            and may_confirm(session, self._now())
        )

    def _tell(self, identity: Identity) -> None:
        for changed in self._changed:
            changed(identity.person.id)

    def _forget_old(self) -> None:
        now = self._clock()
        self._requests = {r.id: r for r in self._requests.values() if now < r.until}
