"""Sign-in of a program by a device code: the program shows a code, a person confirms it on the page.

The codes live in memory only, and of several editors in that of one (`Held`). A restart ends them, and the program asks for a new one. The token is made
when the program fetches it, so nothing is left of a code that nobody used.
"""

import contextlib
import hashlib
import secrets
import time
from collections.abc import Awaitable, Callable
from typing import Final, Literal, TypeAlias

import msgspec
from msgspec.structs import replace

from action_assistant.errors import Conflict, NotFound, Refused, TooMany, Unavailable
from action_assistant.kit.token_bucket import Clock, TokenBuckets
from action_assistant.web.auth.desk import Held
from action_assistant.web.auth.identity import Identity, Scope
from action_assistant.web.auth.tokens import MadeToken

#: No vowels, so that no words arise, and nothing that is mistaken for a digit (RFC 8628, 6.1).
_LETTERS: Final = "BCDFGHJKLMNPQRSTVWXZ"
_CODE: Final = 8  # letters: 2.56e10 codes
_LIFE_S: Final = 600.0
_INTERVAL_S: Final = 2
_SLOWER_S: Final = 2  # more, each time that a program asks too early
_LONGEST_S: Final = 30
_EARLY_S: Final = 0.5  # by which a program may ask too early
_MOST: Final = 100  # codes
_MOST_OF_ADDRESS: Final = 10  # codes of one address
_TRIES: Final = 10  # of one person at once, and in a minute after that

ClaimState: TypeAlias = Literal["waiting", "slower", "granted", "refused", "gone"]


class LoginRequest(msgspec.Struct, frozen=True, omit_defaults=True):
    """A login that waits for a person, as that person sees it. `address`: from where the program
    asks, "" for the server's own computer. `state`: `confirmed` until the program has fetched its
    token. `expires_in`: seconds.
    """

    code: str
    name: str
    scopes: tuple[Scope, ...]
    address: str
    expires_in: int
    state: Literal["waiting", "confirmed", "fetched"]
    days: float | None = None


class LoginBegun(msgspec.Struct, frozen=True):
    """The code for the person, and the secret with which the program fetches its token. `interval`:
    seconds between two questions."""

    code: str
    secret: str
    interval: int
    expires_in: int


class Claimed(msgspec.Struct, frozen=True, omit_defaults=True):
    """The answer to a program that waits. `slower`: it asked too early, and waits `interval` seconds
    from now on. `gone`: the code has expired, was cancelled, or was used already."""

    state: ClaimState
    interval: int = _INTERVAL_S
    made: MadeToken | None = None


class _Login:
    """One code and its state."""

    def __init__(
        self,
        code: str,
        name: str,
        scopes: tuple[Scope, ...],
        days: float | None,
        address: str,
        network: str,
    ) -> None:
        self.network: Final = network
        self.code: Final = code
        self.name: Final = name
        self.scopes: Final = scopes
        self.days: Final = days
        self.address: Final = address
        self.ends_at = 0.0
        self.asked_at = -_LONGEST_S * 1.0
        self.interval = _INTERVAL_S
        self.state: Literal["waiting", "confirmed", "refused", "fetching", "fetched"] = "waiting"
        self.confirmed: Confirmed | None = None


class Confirmed(msgspec.Struct, frozen=True):
    """The word of a person for a login."""

    by: Identity
    name: str
    scopes: tuple[Scope, ...]
    days: float | None


class Fetching(msgspec.Struct, frozen=True):
    """The answer to a program, still without its token; `word`: by which the token may be made now."""

    claimed: Claimed
    word: Confirmed | None = None


class LoginCodes:
    """The logins that wait. All methods run in the event loop, so that of two who use a code at
    once one wins."""

    def __init__(self, clock: Clock = time.monotonic) -> None:
        self._clock = clock
        self._logins: dict[str, _Login] = {}  # by the hash of the secret
        self._tries = TokenBuckets(_TRIES, _TRIES / 60, clock)

    def __len__(self) -> int:
        return len(self._logins)

    def begin(
        self,
        name: str,
        scopes: tuple[Scope, ...],
        days: float | None,
        address: str,
        network: str = "",
    ) -> LoginBegun:
        """Begin a login. `network`: the network of the address, "" for the address itself. Raise
        TooMany if too many logins wait, from this network or from all."""
        network = network or address
        self._forget()
        of_network = sum(each.network == network for each in self._logins.values())
        if len(self._logins) >= _MOST or of_network >= _MOST_OF_ADDRESS:
            raise TooMany("Too many logins wait to be confirmed; try again in some minutes.")
        taken = {each.code for each in self._logins.values()}
        while (code := "".join(secrets.choice(_LETTERS) for _ in range(_CODE))) in taken:
            pass
        secret = secrets.token_urlsafe(32)
        login = _Login(code, name, scopes, days, address, network)
        login.ends_at = self._clock() + _LIFE_S
        self._logins[_hash(secret)] = login
        return LoginBegun(shown(code), secret, _INTERVAL_S, int(_LIFE_S))

    def look(self, code: str, person: str) -> LoginRequest:
        """Return the login with a code. Raise NotFound if there is none, TooMany if this person
        tries too often."""
        login = self._find(code, person)
        if login.state == "refused":
            raise NotFound("This login was refused.")
        return LoginRequest(
            shown(login.code),
            login.name,
            login.scopes,
            login.address,
            max(0, int(login.ends_at - self._clock())),
            "confirmed" if login.state == "fetching" else login.state,
            login.days,
        )

    def confirm(self, code: str, word: Confirmed) -> None:
        """Confirm a login. Raise NotFound or TooMany as `look` does, Conflict if somebody was
        faster."""
        login = self._find(code, word.by.person.id)
        if login.state != "waiting":
            raise Conflict("This code was used already.")
        login.state, login.confirmed = "confirmed", word

    def refuse(self, code: str, person: str) -> None:
        """Refuse the login with this code. `person`: the id of the person who refuses it. Raise
        NotFound if there is no such login, TooMany if this person tries too often, Conflict if the
        login was confirmed or refused already."""
        login = self._find(code, person)
        if login.state != "waiting":
            raise Conflict("This code was used already.")
        login.state = "refused"

    def cancel(self, secret: str) -> None:
        """Forget the login of this secret, if there is one."""
        self._logins.pop(_hash(secret), None)

    def begin_fetch(self, secret: str) -> "Fetching":
        """Return how far the login with this secret is. If a person has confirmed it, its token may be made
        now, by the first of several calls; `end_fetch` has to follow."""
        self._forget()
        login = self._logins.get(_hash(secret))
        if login is None or login.state in {"fetching", "fetched"}:
            return Fetching(Claimed("gone"))
        if login.state == "refused":
            self.cancel(secret)
            return Fetching(Claimed("refused"))
        now = self._clock()
        early = now - login.asked_at < login.interval - _EARLY_S
        login.asked_at = now
        word = login.confirmed
        if word is None:
            if early:
                login.interval = min(_LONGEST_S, login.interval + _SLOWER_S)
            return Fetching(Claimed("slower" if early else "waiting", login.interval))
        login.state = "fetching"
        return Fetching(Claimed("granted", login.interval), word)

    def end_fetch(self, secret: str, *, is_made: bool) -> None:
        """Note that the token was made, or that it may be fetched again."""
        login = self._logins.get(_hash(secret))
        if login is not None:
            login.state = "fetched" if is_made else "confirmed"

    def _find(self, code: str, person: str) -> _Login:
        """Return the login with a code that a person types, with or without the hyphen."""
        self._forget()
        tries = self._tries.of(person)
        if not tries.take():
            raise TooMany("Too many wrong codes; wait a minute.")
        plain = "".join(filter(str.isalnum, code)).upper()
        for login in self._logins.values():
            if secrets.compare_digest(login.code.encode(), plain.encode()):
                tries.spend(-1)  # only wrong codes count
                return login
        raise NotFound("No program waits with this code. It may have expired.")

    def _forget(self) -> None:
        now = self._clock()
        for key in [key for key, each in self._logins.items() if each.ends_at <= now]:
            del self._logins[key]


async def claim(
    codes: Held[LoginCodes], secret: str, make: Callable[[Confirmed], Awaitable[MadeToken]]
) -> Claimed:
    """Return how far the login with this secret is, with its token when a person has confirmed it. `make`
    makes the token; one of several calls at once gets it. Raise what `make` raises; after Unavailable the
    program may ask again."""
    fetching = await codes.call(LoginCodes.begin_fetch, secret)
    if fetching.word is None:
        return fetching.claimed
    try:
        made = await make(fetching.word)
    except Unavailable:
        with contextlib.suppress(Refused):  # or the program asks for a new code
            await codes.call(LoginCodes.end_fetch, secret, is_made=False)
        raise
    except BaseException:
        with contextlib.suppress(Refused):
            await codes.call(LoginCodes.cancel, secret)
        raise
    with contextlib.suppress(Refused):  # nobody else gets the token that is made: the code expires
        await codes.call(LoginCodes.end_fetch, secret, is_made=True)
    return replace(fetching.claimed, made=made)


def shown(code: str) -> str:
    """Return a code in two groups, as people read it."""
    return f"{code[:4]}-{code[4:]}"


def _hash(secret: str) -> str:
    return hashlib.sha256(secret.encode(errors="replace")).hexdigest()
