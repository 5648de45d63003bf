"""The identity behind a request: the person, and the session or token by which they act.

Decision 115 says which credentials there are. This module knows nothing of HTTP.
"""

import time
from typing import Final, Literal, NamedTuple, Protocol, TypeAlias

import msgspec

from action_assistant.web.auth.keys import Person, Session

#: The areas for which a token of a program is valid; `hooks` is reserved.
Scope: TypeAlias = Literal["read", "edit", "simulate", "operate", "scrape", "hooks"]


class Token(msgspec.Struct, frozen=True):
    """A token of a program, without its secret.

    `person`: the person for whom the program acts, with the role that counts for it. `expires`:
    seconds since 1970; None for a token that does not expire. `invitation`: the link by which that
    person came, with which the token ends; None without one.
    """

    id: str
    name: str
    person: Person
    scopes: frozenset[Scope]
    expires: float | None = None
    invitation: str | None = None

    @property
    def expired(self) -> bool:
        """Return whether the token has expired: it then allows nothing but Stop."""
        return self.expires is not None and time.time() >= self.expires


#: The kinds of things that a link can show to people without a name.
ViewKind: TypeAlias = Literal["graph", "run"]
#: Stands for whoever looks by such a link. It is no person, and no `Identity` holds it.
_NOBODY: Final = Person("view", "", "viewer")


class View(msgspec.Struct, frozen=True):
    """A link that shows one graph or run to people without a name, without its secret. `thing`: the
    id of the graph or run; `expires`: seconds since 1970."""

    id: str
    kind: ViewKind
    thing: str
    expires: float
    invitation: None = None

    @property
    def person(self) -> Person:
        """Return a person who is nobody."""
        return _NOBODY

    @property
    def expired(self) -> bool:
        """Return whether the link has expired: it then shows nothing."""
        return time.time() >= self.expires


#: The credentials that somebody can end. The owner's token is none of them.
Credential: TypeAlias = Session | Token | View


class Standing(NamedTuple):
    """The present worth of a credential. `expired`: good for nothing but Stop. `confirmed_at`: when
    the person of the session was last confirmed, in seconds since 1970; None if never. `ask_again`:
    minutes after which what only owners do needs a newer one; 0: never."""

    person: Person
    groups: frozenset[str]
    expired: bool
    confirmed_at: float | None = None
    ask_again: int = 0


class Identity(msgspec.Struct, frozen=True):
    """The person who sends a request, and by which means.

    `groups`: ids of the groups to which an owner has added the person. `session` and `token` are
    both None for the owner's token. `device`: the id of the browser; "" if unknown. `address`: the
    address of the client on the network; "" for this computer itself. `confirmed_at`: when the person
    last proved, in this session, that it is they, in seconds since 1970; None if never, and always
    for programs. `asked_at`: when the request was made, the moment at which a confirmation must not
    be too old, in seconds since 1970; None for now. `ask_again`: minutes after which what only owners
    do needs a newer confirmation; 0: never.
    """

    person: Person
    groups: frozenset[str] = frozenset()
    session: Session | None = None
    token: Token | None = None
    device: str = ""
    address: str = ""
    confirmed_at: float | None = None
    asked_at: float | None = None
    ask_again: int = 0

    @property
    def scopes(self) -> frozenset[Scope] | None:
        """Return the scopes of the program's token; None for people and for the owner's token."""
        return None if self.token is None else self.token.scopes


#: Somebody whom no rule names: may see what everybody may see.
ANYBODY: Final = Identity(Person("", "", "viewer"))


class Tokens(Protocol):
    """Knows the tokens of programs."""

    def opens(self, text: str) -> Token | None:
        """Return the token with this text; None if the text is no token of a program. Raise
        Unauthenticated or Withdrawn if it is one that opens nothing. Called at each request."""

    def note_use(self, token: str, address: str) -> None:
        """Remember that a token was used, and from where. Called at each request."""

    def prove(self, token: str, challenge: str, address: str) -> str:
        """Return the proof that this process knows a token, as `token_text.proof` makes it."""


class Views(Protocol):
    """Knows the links that show one graph or run."""

    def opens(self, text: str) -> View | None:
        """Return the link with this key; None if the text is no key of such a link. Raise
        Unauthenticated or Withdrawn if it is one that shows nothing. Called at each request."""


class NoViews:
    """Accepts no link: used where a process shows nothing to strangers."""

    def opens(self, text: str) -> View | None:
        """Return None for every text."""
        return None


class NoTokens:
    """Accepts no token: used where a process knows of no programs."""

    def opens(self, text: str) -> Token | None:
        """Return None for every text."""
        return None

    def note_use(self, token: str, address: str) -> None:
        """Forget at once that a token was used."""

    def prove(self, token: str, challenge: str, address: str) -> str:
        """Return an empty text, which proves nothing."""
        return ""
