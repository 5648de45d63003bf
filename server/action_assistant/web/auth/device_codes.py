"""Adding a device: a code from a signed-in browser, typed in or scanned on another one.

The first browser shows a code of 8 characters for two minutes. The other one sends it, which uses the
code up, and waits. Both show the same number of two digits. When the person confirms on the first
browser, the other one gets a session of the same person. Codes are in memory only, and of several
editors in that of one (`Held`).
"""

import secrets
import time
from collections.abc import Callable
from typing import Final

import msgspec

from action_assistant.errors import Conflict, NotFound, TooMany, Unauthenticated
from action_assistant.kit.token_bucket import TokenBucket
from action_assistant.random_ids import random_id
from action_assistant.web.auth.keys import Session

CODE_SECONDS: Final = 120.0
_LETTERS: Final = "23456789ABCDEFGHJKMNPQRSTUVWXYZ"  # none that look alike; 8 of them are 39 bits
_LENGTH: Final = 8
_MOST: Final = 500  # that are open at a time
_GUESSES_AT_ONCE: Final = 300  # of all strangers together, right or wrong
_GUESSES_PER_MINUTE: Final = 100


class DeviceCode(msgspec.Struct, frozen=True):
    """A code that another browser may use. `seconds`: for how long it is valid."""

    id: str
    code: str
    seconds: float


class DeviceAsking(msgspec.Struct, frozen=True, omit_defaults=True):
    """The other browser, as the first one sees it. `browser` is missing while no browser has sent
    the code; `number` is shown on both."""

    id: str
    browser: str = ""
    address: str = ""
    number: str = ""
    answered: bool = False


class WaitingDevice(msgspec.Struct, frozen=True):
    """The answer to the browser that has sent a code: `claim`, with which it asks for its session,
    the name of the person, and the number that both browsers show."""

    claim: str
    person: str
    number: str


class Confirmed(msgspec.Struct, frozen=True):
    """The session that a confirmed device follows, and the name and address of its browser."""

    session: Session
    browser: str
    address: str


class _Pending:
    """A code, and then the browser that has sent it."""

    def __init__(self, session: Session, until: float) -> None:
        self.id: Final = random_id()
        self.code: Final = "".join(secrets.choice(_LETTERS) for _ in range(_LENGTH))
        self.number: Final = f"{secrets.randbelow(90) + 10}"
        self.session: Final = session
        self.until = until
        self.claim: str | None = None
        self.browser = ""
        self.address = ""
        self.answer: bool | None = None


class DeviceCodes:
    """The open codes, and the browsers that wait for an answer. For one event loop."""

    def __init__(self, clock: Callable[[], float] = time.monotonic, *, limits: bool = True) -> None:
        self._clock = clock
        self._pending: dict[str, _Pending] = {}
        self._guesses = (
            TokenBucket(_GUESSES_AT_ONCE, _GUESSES_PER_MINUTE / 60, clock) if limits else None
        )

    def open(self, session: Session) -> DeviceCode:
        """Make a code for a session; its earlier code is valid no more. Raise TooMany."""
        self._forget_old()
        for each in [p for p in self._pending.values() if p.session.id == session.id]:
            del self._pending[each.id]
        if len(self._pending) >= _MOST:
            raise TooMany("Many people add devices just now; try again in two minutes.")
        made = _Pending(session, self._clock() + CODE_SECONDS)
        self._pending[made.id] = made
        return DeviceCode(made.id, f"{made.code[:4]}-{made.code[4:]}", CODE_SECONDS)

    def claim(self, text: str, browser: str, address: str) -> WaitingDevice:
        """Use up the code `text`, which the new device `browser` has sent from the network address
        `address`. Return the claim by which that device asks whether it was confirmed, with the
        number that both devices show. A code works once, also if several devices send it at the
        same time. Raise Unauthenticated for an unknown, expired or used code, TooMany if all
        devices together have tried too many codes just now."""
        self._forget_old()
        if self._guesses is not None and not self._guesses.take():
            raise TooMany("Too many codes are tried just now; wait a minute, or ask for a link.")
        code = "".join(filter(str.isalnum, text.upper())).encode(errors="replace")
        found = next(
            (p for p in self._pending.values() if secrets.compare_digest(p.code.encode(), code)),
            None,
        )
        if found is None or found.claim is not None:
            raise Unauthenticated("This code is not valid, or was used already. Ask for a new one.")
        found.claim = secrets.token_urlsafe(32)
        found.browser, found.address = browser, address
        found.until = self._clock() + CODE_SECONDS
        return WaitingDevice(found.claim, found.session.person.name, found.number)

    def text(self, id_: str, session: Session) -> str:
        """Return the code itself, which no other browser has sent yet. Raise NotFound or Conflict."""
        found = self._of(id_, session)
        if found.claim is not None:
            raise Conflict("A device has sent this code already.")
        return found.code

    def look(self, id_: str, session: Session) -> DeviceAsking:
        """Return which browser has sent the code of this session. Raise NotFound when it is over."""
        found = self._of(id_, session)
        if found.claim is None:
            return DeviceAsking(id_)
        is_answered = found.answer is not None
        return DeviceAsking(id_, found.browser, found.address, found.number, is_answered)

    def answer(self, id_: str, session: Session, *, is_mine: bool) -> None:
        """Confirm or refuse the browser that has sent the code. Raise NotFound or Conflict."""
        found = self._of(id_, session)
        if found.claim is None:
            raise Conflict("No device has sent this code yet.")
        if found.answer is not None:
            raise Conflict("This device was answered already.")
        found.answer = is_mine

    def cancel(self, id_: str, session: Session) -> None:
        """Make a code invalid. Raise NotFound when it is over."""
        found = self._of(id_, session)  # before the look-up below: it puts another dict there
        del self._pending[found.id]

    def confirmed(self, claim: str) -> Confirmed | None:
        """Return the session that the other browser follows; None while the person has not answered.
        Raise Unauthenticated if they refused, or the time is over."""
        self._forget_old()
        for found in self._pending.values():
            if found.claim is not None and secrets.compare_digest(
                found.claim.encode(), claim.encode(errors="replace")
            ):
                if found.answer is None:
                    return None
                if found.answer:
                    return Confirmed(found.session, found.browser, found.address)
                raise Unauthenticated("The other device was answered with no.")
        raise Unauthenticated("Nobody has confirmed this device in time. Ask for a new code.")

    def collect(self, claim: str) -> Confirmed:
        """Return the session that a confirmed browser follows, and forget the code. Raise Unauthenticated as
        `confirmed` does, and for all but the first of several that collect it."""
        found = self.confirmed(claim)
        if found is None:
            raise Unauthenticated("Nobody has confirmed this device yet.")
        self._pending = {p.id: p for p in self._pending.values() if p.claim != claim}
        return found

    def _of(self, id_: str, session: Session) -> _Pending:
        self._forget_old()
        found = self._pending.get(id_)
        if found is None or found.session.id != session.id:
            raise NotFound("This code is over. Make a new one.")
        return found

    def _forget_old(self) -> None:
        now = self._clock()
        self._pending = {p.id: p for p in self._pending.values() if now < p.until}
