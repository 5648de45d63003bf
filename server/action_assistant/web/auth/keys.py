"""The secret of local mode: a token for programs, and sessions sealed with it for browsers.

A session cookie is `payload.signature`, both base64url; the payload is JSON `[id, person id, name,
expires, role, invitation, personal, begun, added]`. Either process can verify it by itself, because both read the same token.
Cookies of before there were roles end after `expires`: they were traded for the token, so they are an
owner's. Cookies without `begun` are of before sessions could be idle, and expire by `expires` alone.
"""

import base64
import hashlib
import hmac
import os
import secrets
import time
from functools import cached_property
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.errors import CannotStart
from action_assistant.random_ids import random_id
from action_assistant.web.auth.roles import OWNER, Role

METRICS: Final = "/metrics"
TOKEN_FILE: Final = "token"
SESSION_SECONDS: Final = 30 * 24 * 3600
#: Seconds by which the clock of another computer may be ahead.
SKEW_S: Final = 300.0
_MIN_TOKEN: Final = 32  # characters; the tokens made here have 43 (256 bit)


class PersonRef(msgspec.Struct, frozen=True):
    """A person who acted. `id` is opaque and stable for a browser; people choose `name` themselves."""

    id: str
    name: str


#: The id of whoever has the server's token. Its name is the user of the computer, which no person chose.
SERVER_OWNER: Final = "local"


class Person(PersonRef, frozen=True):
    """A person with a role, which says what they may do."""

    role: Role = "viewer"


class Session(msgspec.Struct, frozen=True):
    """A browser that has presented the token or an invitation. `expires` and `begun`: seconds since
    1970; `begun` is 0 in cookies of earlier versions. `invitation`: the id of the group link; None
    for the token and for personal links. `personal`: whether the person came by a personal link,
    so that an owner gives name, role and groups. `added`: another session of the person let it in, and
    nobody had confirmed that session shortly before."""

    id: str
    person: Person
    expires: float
    invitation: str | None = None
    personal: bool = False
    begun: float = 0.0
    added: bool = False

    @property
    def expired(self) -> bool:
        """Return whether the session has expired: it then allows nothing but Stop. So has one that
        begins later than now: the clock was set back, and nobody knows for how long it lasts."""
        now = time.time()
        return now >= self.expires or self.begun > now + SKEW_S


class Sealed(msgspec.Struct, frozen=True, array_like=True):
    """The payload of a session cookie."""

    id: str
    person: str
    name: str
    expires: float
    role: Role = OWNER
    invitation: str | None = None
    personal: bool = False
    begun: float = 0.0
    added: bool = False


class ServerProof(msgspec.Struct, frozen=True):
    """The proof that a server knows the token.

    It is an HMAC over a challenge and over the address, `HOST:PORT`, that accepted the connection.
    `token_proof`: the same under the digest of a program's token; "" if none was asked about.
    """

    address: str
    proof: str
    token_proof: str = ""


class Keys:
    """Checks tokens and seals sessions. `origin` is where a token was found, for people."""

    def __init__(self, token: str, origin: str = "The token") -> None:
        if len(token) < _MIN_TOKEN:
            what = "is empty" if not token else f"has {len(token)} characters"
            raise CannotStart(
                f"{origin} {what}; a token must have at least {_MIN_TOKEN} characters. Without one, "
                "the next start makes it; links and sessions of another one end."
            )
        self.token: Final = token
        self._seal: Final = hashlib.sha256(b"action-assistant session\0" + token.encode()).digest()

    @classmethod
    def of(cls, data: Path) -> "Keys":
        """Return the keys of a data folder, made if it has none. A token in the environment takes
        precedence."""
        return cls._given() or cls(_token_in(data), _named(data))

    @classmethod
    def known(cls, data: Path) -> "Keys":
        """Return the existing keys of a data folder or of the environment. Raise CannotStart if
        there are none."""
        given = cls._given()
        if given is not None:
            return given
        try:
            return cls((data / TOKEN_FILE).read_text().strip(), _named(data))
        except (OSError, UnicodeDecodeError) as error:
            why = error.strerror if isinstance(error, OSError) else "it is no text"
            raise CannotStart(
                f"No token in {data} ({why}); name the data folder of the server with --data, or "
                "set ACTION_ASSISTANT_TOKEN."
            ) from error

    @classmethod
    def _given(cls) -> "Keys | None":
        given = os.environ.get("ACTION_ASSISTANT_TOKEN")
        return cls(given, "ACTION_ASSISTANT_TOKEN") if given else None

    def opens(self, token: str) -> bool:
        """Return whether a text is the token of this server."""
        return hmac.compare_digest(token.encode(errors="replace"), self.token.encode())

    def new_session(
        self,
        name: str,
        *,
        role: Role = OWNER,
        invitation: str | None = None,
        person_id: str | None = None,
        session_id: str | None = None,
        personal: bool = False,
        added: bool = False,
        seconds: float = SESSION_SECONDS,
    ) -> Session:
        """Make a session that begins now, and expires after `seconds`. `invitation`: the group link
        by which the person came. `person_id`: the id of a person who is known already.
        `session_id`: the id of a browser's session that goes on, so that revoking it ends all
        cookies of this browser. `personal`: the person came by a personal link. `added`: as in
        `Session`."""
        person = Person(person_id or random_id(), name, role)
        begun = time.time()
        return Session(
            session_id or random_id(), person, begun + seconds, invitation, personal, begun, added
        )

    def secret_of(self, invitation: str) -> str:
        """Return the secret of an invitation (256 bit), which cannot be derived from its id without
        the token."""
        return _text(hmac.digest(self._seal, b"invitation\0" + invitation.encode(), "sha256"))

    def token_seal(self, record: bytes) -> str:
        """Return the seal of a program's token, which only a server with this token can make."""
        return _text(hmac.digest(self._seal, b"program token\0" + record, "sha256"))

    def confirmation_seal(self, record: bytes) -> str:
        """Return the seal of a confirmation, which only a server with this token can make."""
        return _text(hmac.digest(self._seal, b"confirmation\0" + record, "sha256"))

    def view_secret(self, link: bytes) -> str:
        """Return the secret (256 bit) of a link that shows one thing. `link`: its id, thing and
        end as bytes, which the secret seals."""
        return _text(hmac.digest(self._seal, b"view\0" + link, "sha256"))

    @property
    def relay_key(self) -> bytes:
        """The key under which editors of one server seal what they relay to each other."""
        return hmac.digest(self._seal, b"relay between editors", "sha256")

    def end_seal(self, session: str, person: str) -> str:
        """Return the seal by which a person ends one of their sessions at a process that does not
        know whose it is. It proves nothing else."""
        told = b"end of session\0" + f"{session}\0{person}".encode(errors="replace")
        return _text(hmac.digest(self._seal, told, "sha256"))

    def prove(self, challenge: str, address: str) -> ServerProof:
        """Prove to a client that this server knows the token, before the client shows it.
        `challenge`: the text that the client chose. `address`: the address (`HOST:PORT`) that
        accepted the connection of the client."""
        return ServerProof(address, self._proof(challenge, address))

    def proven(self, challenge: str, proof: ServerProof, *, at: str | None = None) -> bool:
        """Return whether the proof that another server has given shows that the other server knows
        our token.

        `challenge`: the text that we sent to the other server, over which the proof is computed.
        With `at`, the proof must also name this address (`HOST:PORT`) as the one that accepted our
        connection.
        """
        if at is not None and proof.address != at:
            return False
        expected = self._proof(challenge, proof.address)
        return hmac.compare_digest(expected.encode(), proof.proof.encode(errors="replace"))

    def _proof(self, challenge: str, address: str) -> str:
        text = f"{challenge}\0{address}".encode(errors="replace")
        return _text(hmac.digest(self._proving, text, "sha256"))

    @cached_property
    def _proving(self) -> bytes:
        """Derive the key for proofs from the token. The derivation is slow on purpose: strangers
        may ask for proofs, and guessing a weak token from a proof must take long."""
        salt = b"action-assistant server"
        return hashlib.scrypt(self.token.encode(), salt=salt, n=1 << 14, r=8, p=1, dklen=32)

    def sealed(self, session: Session) -> str:
        """Return the value of the cookie for a session."""
        person = session.person
        fields = Sealed(
            session.id,
            person.id,
            person.name,
            session.expires,
            person.role,
            session.invitation,
            session.personal,
            session.begun,
            session.added,
        )
        payload = _text(msgspec.json.encode(fields))
        return f"{payload}.{_text(self._sign(payload))}"

    def sealed_question(self, question: bytes) -> str:
        """Return the value of the cookie that holds a sign-in by a provider while it goes on."""
        payload = _text(question)
        return f"{payload}.{self._question_seal(payload)}"

    def question(self, cookie: str) -> bytes | None:
        """Return the content of a cookie of `sealed_question`; None if this server did not seal it."""
        payload, _, seal = cookie.partition(".")
        expected = self._question_seal(payload)
        if not hmac.compare_digest(expected.encode(), seal.encode(errors="replace")):
            return None
        return base64.urlsafe_b64decode(payload + "=" * (-len(payload) % 4))

    def _question_seal(self, payload: str) -> str:
        return _text(self._sign(f"provider\0{payload}"))

    def new_device(self) -> str:
        """Return a new cookie that identifies a browser, whoever signs in."""
        made = random_id()
        return f"{made}.{self._device_seal(made)}"

    def device(self, cookie: str) -> str:
        """Return the id of the browser behind a device cookie; "" if this server did not seal it."""
        found, _, seal = cookie.partition(".")
        return (
            found if hmac.compare_digest(self._device_seal(found).encode(), seal.encode()) else ""
        )

    def _device_seal(self, device: str) -> str:
        return _text(self._sign(f"device\0{device}"))

    def session(self, cookie: str) -> Session | None:
        """Return the session behind a cookie, expired or not; None if this server did not seal it."""
        payload, _, signature = cookie.partition(".")
        if not hmac.compare_digest(_text(self._sign(payload)).encode(), signature.encode()):
            return None
        try:
            raw = base64.urlsafe_b64decode(payload + "=" * (-len(payload) % 4))
            found = msgspec.json.decode(raw, type=Sealed)
        except (ValueError, msgspec.DecodeError):
            return None
        person = Person(found.person, found.name, found.role)
        return Session(
            found.id,
            person,
            found.expires,
            found.invitation,
            found.personal,
            found.begun,
            found.added,
        )

    def _sign(self, payload: str) -> bytes:
        return hmac.digest(self._seal, payload.encode(errors="replace"), "sha256")


def _text(raw: bytes) -> str:
    return base64.urlsafe_b64encode(raw).rstrip(b"=").decode()


def _named(data: Path) -> str:
    return f"The token in {data / TOKEN_FILE}"


def _token_in(data: Path) -> str:
    """Return the token kept in a folder, made if there is none. If two processes make one at once,
    the first file counts."""
    file = data / TOKEN_FILE
    try:
        if not file.exists():
            fresh = data / f".{TOKEN_FILE}-{os.getpid()}"
            descriptor = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
            with os.fdopen(descriptor, "w") as out:
                out.write(secrets.token_urlsafe(32) + "\n")
            try:
                os.link(fresh, file)
            except FileExistsError:
                pass  # the other process was first; its token is read below
            finally:
                fresh.unlink()
        return file.read_text().strip()
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else f"{file} is no text"
        raise CannotStart(f"Cannot keep the token in {data}: {why}.") from error


class ScrapeToken:
    """The token for scraping metrics, which opens `/metrics` and nothing else.

    Tokens are compared in constant time. If no token is set, no request is accepted.
    """

    def __init__(self, token: str | None = None) -> None:
        self._digest = None if token is None else _digest(token)

    def opens(self, method: str, path: str, token: str) -> bool:
        """Return whether the token is right and the request is `GET /metrics`."""
        wanted = self._digest
        is_it = wanted is not None and hmac.compare_digest(_digest(token), wanted)
        return is_it and method == "GET" and path == METRICS


def _digest(token: str) -> bytes:
    """Return a digest of the token, which has the same length for every token."""
    return hashlib.sha256(token.encode(errors="replace")).digest()
