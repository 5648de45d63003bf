"""Tokens of programs: made by a person, verified in each process by a file, ended by a mark.

`tokens/` in the data folder holds `ID.json` for each token, sealed under the token of the server, and
`ID.used`, its last use. The secret is not in it. A process reads the file itself, so it needs neither the
other process nor a database. A token ends with its file, with the mark `token-ID` in `revoked/`, with its
maker, and with the link by which its maker came.
"""

import contextlib
import hmac
import logging
import re
import secrets
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.errors import (
    BadInput,
    Conflict,
    Forbidden,
    NotFound,
    Unauthenticated,
    Unavailable,
    Withdrawn,
)
from action_assistant.private_files import sync, write_json
from action_assistant.random_ids import random_id
from action_assistant.safe_text import is_name
from action_assistant.settings import TOKEN_DAYS
from action_assistant.web.auth.identity import Identity, Scope, Token
from action_assistant.web.auth.keys import SKEW_S, Keys, Person, PersonRef
from action_assistant.web.auth.record_files import RecordFiles
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.roles import Permission, Role, allowed, rank
from action_assistant.web.auth.token_text import PREFIX, digest_of, new_text, proof, token_id

log: Final = logging.getLogger(__name__)

FOLDER: Final = "tokens"
DEFAULT_DAYS: Final = 90.0
NAME_LIMIT: Final = 60  # characters
_MOST: Final = 1000  # tokens
_MOST_OF_ONE: Final = 100  # tokens of one person
_DAY_S: Final = 24 * 3600
_ID: Final = re.compile(r"[A-Za-z0-9]{12}")

#: The scopes that a scope includes.
_INCLUDES: Final[dict[Scope, frozenset[Scope]]] = {
    "edit": frozenset({"read"}),
    "simulate": frozenset({"read"}),
    "operate": frozenset({"read", "simulate"}),
}
#: The permission that the maker needs for each scope. `hooks` is reserved, so nobody can give it.
_PERMISSION: Final[dict[Scope, Permission]] = {
    "read": "see",
    "edit": "edit",
    "simulate": "simulate",
    "operate": "operate",
    "scrape": "see",
}


class TokenRecord(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A token as its file has it, without the secret. `sha256`: of the whole text, in hex. `made_at`
    and `expires`: seconds since 1970. `invitation`: the link by which the maker came, if any.
    `seal`: proves that a server with the same token made it."""

    id: str
    name: str
    sha256: str
    scopes: tuple[Scope, ...]
    role: Role
    person: PersonRef
    made_at: float
    expires: float
    invitation: str | None = None
    seal: str = ""


class TokenUse(msgspec.Struct, frozen=True):
    """The last use of a token, up to a minute old. `at`: seconds since 1970. `address`: "" for the
    server's own computer.
    """

    at: float
    address: str


class TokenShown(msgspec.Struct, frozen=True, omit_defaults=True):
    """A token in a list. `used` is missing if the process never saw it."""

    record: TokenRecord
    used: TokenUse | None = None


class TokenList(msgspec.Struct, frozen=True):
    """The tokens of a server. `most_days`: the longest life that a new one may get."""

    tokens: list[TokenShown]
    most_days: float


class MadeToken(msgspec.Struct, frozen=True):
    """A new token. `token`: its text, which is not stored and never shown again."""

    token: str
    record: TokenRecord


def completed(scopes: Iterable[Scope]) -> frozenset[Scope]:
    """Return scopes together with those that they include."""
    given = frozenset(scopes)
    return given.union(*(_INCLUDES.get(each, frozenset()) for each in given))


class TokenFiles:
    """Makes, verifies and ends tokens of programs. `most_days`: the longest life that a person may
    give to one."""

    def __init__(
        self, data: Path, keys: Keys, revoked: Revocations, *, most_days: float = TOKEN_DAYS
    ) -> None:
        self.most_days: Final = most_days
        self._keys = keys
        self._revoked = revoked
        self._files = RecordFiles(data / FOLDER, TokenRecord, TokenUse, self._accepts, most=_MOST)
        self._nothing = secrets.token_hex(32)  # the hash of a token that does not exist

    def opens(self, text: str) -> Token | None:
        """Return the token with this text; None if the text does not begin as a token does. Raise
        Unauthenticated or Withdrawn if it opens nothing. An expired token is returned."""
        if not text.startswith(PREFIX):
            return None
        name = token_id(text)
        if name is None:
            raise Unauthenticated("This token was cut short or mistyped.")
        record = self._files.get(name)
        expected = self._nothing if record is None else record.sha256
        is_right = hmac.compare_digest(digest_of(text).encode(), expected.encode())
        if record is None or not is_right:
            raise Unauthenticated(
                f"The token {name} was revoked, or it is of another server. Make another one."
            )
        if self._revoked.holds(record.invitation):
            raise Withdrawn(
                f"The token {name} ended with the link by which its maker came. Make another one."
            )
        person = Person(record.person.id, record.person.name, record.role)
        was_set_back = (
            record.made_at > time.time() + SKEW_S
        )  # the clock: how long it lasts is unknown
        return Token(
            record.id,
            record.name,
            person,
            frozenset(record.scopes),
            0.0 if was_set_back else record.expires,
            record.invitation,
        )

    def make(
        self, maker: Identity, name: str, scopes: Iterable[Scope], days: float | None = None
    ) -> MadeToken:
        """Make a token that acts for `maker`, and store it durably. Raise Forbidden if a token asks,
        or if the maker's role lacks a scope; BadInput for a bad name, scope or number of days;
        Conflict if there are too many; Unavailable if the disk cannot take it."""
        wanted = completed(scopes)
        name = self.require(maker, name, wanted, days)
        every = self.every()
        if len(every) >= _MOST or _number_of(maker.person.id, every) >= _MOST_OF_ONE:
            raise Conflict(
                f"There are {_MOST_OF_ONE} tokens of one person, or {_MOST} of all, already; "
                "revoke some."
            )
        made = random_id()
        text, now = new_text(made), time.time()
        record = TokenRecord(
            id=made,
            name=name,
            sha256=digest_of(text),
            scopes=tuple(sorted(wanted)),
            role=maker.person.role,
            person=PersonRef(maker.person.id, maker.person.name),
            made_at=now,
            expires=now + (min(DEFAULT_DAYS, self.most_days) if days is None else days) * _DAY_S,
            invitation=None if maker.session is None else maker.session.invitation,
        )
        record = msgspec.structs.replace(record, seal=self._seal(record))
        self._write(record)
        return MadeToken(text, record)

    def require(
        self, maker: Identity, name: str, scopes: frozenset[Scope], days: float | None
    ) -> str:
        """Return the name as it is stored. Raise what `make` raises for what its maker may not give,
        or for values that it does not take."""
        if maker.token is not None:
            raise Forbidden("A program's token cannot make tokens: it takes a person.")
        self._require_scopes(scopes, maker.person.role)
        return self.check(name, days)

    def adopt(self, record: TokenRecord) -> None:
        """Store a token that the editor of the same server made, in a process with a data folder of
        its own. Raise BadInput if it is not sealed by this server, Conflict if it was revoked,
        Unavailable if the disk cannot take it."""
        if _ID.fullmatch(record.id) is None or not self._is_sealed(record):
            raise BadInput("This server did not make the token.")
        if self._revoked.token_ended(record.id):
            raise Conflict(f"The token {record.id} was revoked.")
        if self._files.get(record.id) is None:
            self._write(record)

    def every(self, person: str | None = None) -> list[TokenShown]:
        """Return the tokens that were not revoked, the newest first; with `person`, only those of
        that person."""
        found = [
            TokenShown(record, self._used(record.id))
            for record in self._files.every()
            if person in {None, record.person.id} and not self._has_ended(record)
        ]
        return sorted(found, key=lambda each: each.record.made_at, reverse=True)

    def get(self, token: str) -> TokenRecord:
        """Return one token. Raise NotFound if there is none with this id, or if it was revoked."""
        record = self._files.get(token) if _ID.fullmatch(token) else None
        if record is None or self._has_ended(record):
            raise NotFound(f"There is no token {token!r}.")
        return record

    def revoke(self, token: str) -> None:
        """End a token, at once and for good. Raise NotFound if there is none; raise Unavailable if
        the disk could store neither the mark nor the removal of the file."""
        self.get(token)
        unwritten: Unavailable | None = None
        try:
            self._revoked.end_token(token)
        except Unavailable as error:
            unwritten = error
        try:
            self._files.path(token).unlink(missing_ok=True)
            sync(self._files.folder)
        except OSError:
            if unwritten is not None:
                raise unwritten from None
        self._files.uses.pop(token, None)
        with contextlib.suppress(OSError):
            self._files.path(token, ".used").unlink(missing_ok=True)
        log.info("token %s is revoked", token)

    def note_use(self, token: str, address: str) -> None:
        """Remember the use of a token. Call it in the event loop."""
        self._files.note_use(token, TokenUse(time.time(), address))

    def prove(self, token: str, challenge: str, address: str) -> str:
        """Return the proof that this process knows a token, before a program shows it. For an
        unknown token the proof is that of no token, so that strangers do not learn which exist."""
        record = self._files.get(token) if _ID.fullmatch(token) else None
        return proof(self._nothing if record is None else record.sha256, challenge, address)

    def check(self, name: str, days: float | None) -> str:
        """Return the name of a token as it is stored. Raise BadInput for a bad name or number of
        days."""
        name = " ".join(name.split())
        if not name or len(name) > NAME_LIMIT:
            raise BadInput(
                f"A token has a name of up to {NAME_LIMIT} characters.", where={"path": "/name"}
            )
        if not is_name(name):
            raise BadInput("A name has no control characters.", where={"path": "/name"})
        if days is not None and not 0 < days <= self.most_days:
            raise BadInput(
                f"A token lasts at most {self.most_days:g} days here.", where={"path": "/days"}
            )
        return name

    def _require_scopes(self, scopes: frozenset[Scope], role: Role) -> None:
        if not scopes:
            raise BadInput("A token needs a scope.", where={"path": "/scopes"})
        for scope in sorted(scopes):
            permission = _PERMISSION.get(scope)
            if permission is None:
                raise BadInput(f"The scope {scope} is reserved.", where={"path": "/scopes"})
            if not allowed(role, permission):
                raise Forbidden(f"You are here as {role}: you cannot give the scope {scope}.")

    def _has_ended(self, record: TokenRecord) -> bool:
        return (
            self._revoked.token_ended(record.id)
            or self._revoked.person_ended(record.person.id)
            or self._revoked.holds(record.invitation)
        )

    def _write(self, record: TokenRecord) -> None:
        try:
            self._files.folder.mkdir(mode=0o700, exist_ok=True)
            write_json(self._files.path(record.id), record)
            sync(self._files.folder)
        except OSError as error:
            raise Unavailable(
                f"The token cannot be stored in {self._files.folder}: {error.strerror}."
            ) from error

    def _used(self, token: str) -> TokenUse | None:
        """Return the newest use of which this process or the other one has told."""
        ours, stored = self._files.uses.get(token), self._files.stored_use(token)
        if ours is None or stored is None:
            return ours or stored
        return stored if ours.at < stored.at else ours

    def _accepts(self, token: str, record: TokenRecord) -> bool:
        return record.id == token and self._is_sealed(record)

    def _seal(self, record: TokenRecord) -> str:
        fields = (
            record.id,
            record.name,
            record.sha256,
            record.scopes,
            record.role,
            (record.person.id, record.person.name),
            record.made_at,
            record.expires,
            record.invitation,
        )
        return self._keys.token_seal(msgspec.json.encode(fields))

    def _is_sealed(self, record: TokenRecord) -> bool:
        return hmac.compare_digest(
            self._seal(record).encode(), record.seal.encode(errors="replace")
        )


def lower(role: Role, other: Role) -> Role:
    """Return the role that may do less."""
    return min(role, other, key=rank)


def _number_of(person: str, tokens: list[TokenShown]) -> int:
    return sum(each.record.person.id == person for each in tokens)
