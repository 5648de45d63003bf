"""Passkeys (WebAuthn): registered by a person, and shown again to confirm that it is they.

`passkeys/PERSON.json` in the data folder holds the public keys of one person, and after how many minutes
owners are asked again. Challenges are in memory only. Verification is that of py_webauthn
(docs/decisions/121).
"""

import functools
import ipaddress
import logging
import re
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Concatenate, Final, Literal, NamedTuple, ParamSpec, TypeVar
from urllib.parse import urlsplit

import msgspec
from msgspec.structs import replace

from action_assistant.errors import BadInput, Conflict, Forbidden, NotFound, Unavailable
from action_assistant.private_files import (
    FileState,
    log_unreadable,
    read_logged,
    state_of,
    write_json,
)
from action_assistant.random_ids import random_id
from action_assistant.safe_text import is_name
from action_assistant.web.auth.confirmations import ADDED_S, is_sure
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Session

log: Final = logging.getLogger(__name__)

FOLDER: Final = "passkeys"
CHALLENGE_S: Final = 120.0
NAME_LIMIT: Final = 60  # characters
_MOST: Final = 20  # passkeys of one person
_MOST_CHALLENGES: Final = 1000
_ID: Final = re.compile(r"[A-Za-z0-9_-]{1,40}")
_NAME: Final = "TeMoto Action Assistant"
_P = ParamSpec("_P")
_R = TypeVar("_R")


class Passkey(msgspec.Struct, frozen=True):
    """A passkey. `credential` and `public_key`: base64url. `rp`: the host name at which it works.
    `made_at`, `counts_at`: when it was registered, and from when on it confirms, in seconds since
    1970."""

    id: str
    name: str
    credential: str
    public_key: str
    sign_count: int
    rp: str
    made_at: float
    counts_at: float


class PasskeyFile(msgspec.Struct, frozen=True, omit_defaults=True):
    """The passkeys of one person. `ask_again`: minutes after which what only owners do needs a new
    confirmation; 0: never."""

    passkeys: tuple[Passkey, ...] = ()
    ask_again: int = 0


#: Counts for a file that this process has never been able to read.
_UNREAD: Final = PasskeyFile(ask_again=15)


class PasskeyFiles:
    """Reads and writes the passkeys of persons."""

    def __init__(self, data: Path) -> None:
        self._folder = data / FOLDER
        self._read: dict[str, tuple[FileState, PasskeyFile]] = {}

    def of(self, person: str) -> PasskeyFile:
        """Return the passkeys of a person. While the file cannot be read, they are those of the last
        time; if this process never read it, there are none, and the person is asked again."""
        known = self._read.get(person)
        if _ID.fullmatch(person) is None:
            return PasskeyFile()
        path = self._folder / f"{person}.json"
        try:
            state = state_of(path)
            if known is None or known[0] != state:
                last = _UNREAD if known is None else known[1]
                read = read_logged(path, PasskeyFile)
                known = (state, last if read is None else read)
                self._read[person] = known
        except FileNotFoundError:
            self._read.pop(person, None)
            return PasskeyFile()
        except OSError as error:
            log_unreadable(path, error)
            return _UNREAD if known is None else known[1]
        return known[1]

    def write(self, person: str, file: PasskeyFile) -> None:
        """Store the passkeys of a person durably. Raise Unavailable if that fails, or if there is a
        file that this process cannot read: it is kept as it is."""
        if self.of(person) is _UNREAD:
            raise Unavailable(f"{self._folder / person}.json cannot be read, so it is not changed.")
        try:
            write_json(self._folder / f"{person}.json", file)
        except OSError as error:
            raise Unavailable(
                f"It could not be written to {self._folder}: {error.strerror}."
            ) from error


class _Challenge(NamedTuple):
    kind: Literal["register", "confirm"]
    challenge: bytes
    origin: str
    until: float


def _locked(
    method: Callable[Concatenate["Passkeys", _P], _R],
) -> Callable[Concatenate["Passkeys", _P], _R]:
    """Let one thread after the other run a method that reads a file and writes it again."""

    @functools.wraps(method)
    def alone(self: "Passkeys", /, *args: _P.args, **kwargs: _P.kwargs) -> _R:
        with self._lock:
            return method(self, *args, **kwargs)

    return alone


class Passkeys:
    """Registers and verifies passkeys. Its methods may run in threads."""

    def __init__(
        self,
        files: PasskeyFiles,
        clock: Callable[[], float] = time.monotonic,
        now: Callable[[], float] = time.time,
    ) -> None:
        self.files: Final = files
        self._clock = clock
        self._now = now
        self._lock = threading.Lock()
        self._challenges: dict[str, _Challenge] = {}
        #: Sign counts that the disk did not take, by credential.
        self._counts: dict[str, int] = {}

    @_locked
    def begin_registration(self, by: Identity, session: Session, origin: str) -> dict[str, Any]:
        """Return the options for `navigator.credentials.create`. `origin`: the origin of the page
        that asks. Raise BadInput where browsers allow no passkeys."""
        from webauthn import generate_registration_options
        from webauthn.helpers.structs import (
            AuthenticatorSelectionCriteria,
            ResidentKeyRequirement,
            UserVerificationRequirement,
        )

        rp = _relying_party(origin)
        theirs = self.files.of(by.person.id).passkeys
        options = generate_registration_options(
            rp_id=rp,
            rp_name=_NAME,
            user_id=by.person.id.encode(),
            user_name=by.person.name or "Guest",
            authenticator_selection=AuthenticatorSelectionCriteria(
                resident_key=ResidentKeyRequirement.PREFERRED,
                user_verification=UserVerificationRequirement.REQUIRED,
            ),
            exclude_credentials=_descriptors(theirs, rp),
        )
        self._challenges_put(session, _Challenge("register", options.challenge, origin, 0.0))
        return _json(options)

    @_locked
    def register(
        self, by: Identity, session: Session, name: str, credential: dict[str, Any]
    ) -> Passkey:
        """Return a new passkey of a person, stored durably. Raise Forbidden if the answer of the browser
        does not fit the challenge of this session, BadInput for a bad name, Conflict if the person has
        it, Unavailable if it could not be stored."""
        from webauthn import verify_registration_response
        from webauthn.helpers import bytes_to_base64url

        name = _checked_name(name)
        made = self._take("register", session)
        rp = _relying_party(made.origin)
        try:
            verified = verify_registration_response(
                credential=credential,
                expected_challenge=made.challenge,
                expected_rp_id=rp,
                expected_origin=made.origin,
                require_user_verification=True,
            )
        except Exception as error:  # whatever a browser sends is hostile
            raise _refused(error) from error
        file = self.files.of(by.person.id)
        now = self._now()
        found = Passkey(
            id=random_id(),
            name=name,
            credential=bytes_to_base64url(verified.credential_id),
            public_key=bytes_to_base64url(verified.credential_public_key),
            sign_count=verified.sign_count,
            rp=rp,
            made_at=now,
            counts_at=now if is_sure(by.confirmed_at, now) else now + ADDED_S,
        )
        if any(each.credential == found.credential for each in file.passkeys):
            raise Conflict("You have this passkey already.")
        if len(file.passkeys) >= _MOST:
            raise Conflict(f"You have {_MOST} passkeys; remove one first.")
        self.files.write(by.person.id, replace(file, passkeys=(*file.passkeys, found)))
        return found

    @_locked
    def begin_confirmation(self, by: Identity, session: Session, origin: str) -> dict[str, Any]:
        """Return the options for `navigator.credentials.get`. Raise NotFound if no passkey of the person
        counts at this address yet."""
        from webauthn import generate_authentication_options
        from webauthn.helpers.structs import UserVerificationRequirement

        rp = _relying_party(origin)
        usable = self._usable(by.person.id, rp)
        if not usable:
            raise NotFound("You have no passkey here that counts already.")
        options = generate_authentication_options(
            rp_id=rp,
            allow_credentials=_descriptors(usable, rp),
            user_verification=UserVerificationRequirement.REQUIRED,
        )
        self._challenges_put(session, _Challenge("confirm", options.challenge, origin, 0.0))
        return _json(options)

    @_locked
    def verify(self, by: Identity, session: Session, credential: dict[str, Any]) -> Passkey:
        """Return the passkey that a person has shown. Raise Forbidden if it is none of theirs, does not
        fit the challenge of this session, or was copied."""
        from webauthn import base64url_to_bytes, verify_authentication_response

        made = self._take("confirm", session)
        rp = _relying_party(made.origin)
        usable = self._usable(by.person.id, rp)
        found = next((each for each in usable if each.credential == credential.get("id")), None)
        if found is None:
            raise Forbidden("This is none of your passkeys that count here.")
        count = max(found.sign_count, self._counts.get(found.credential, 0))
        try:
            verified = verify_authentication_response(
                credential=credential,
                expected_challenge=made.challenge,
                expected_rp_id=rp,
                expected_origin=made.origin,
                credential_public_key=base64url_to_bytes(found.public_key),
                credential_current_sign_count=count,
                require_user_verification=True,
            )
        except Exception as error:  # whatever a browser sends is hostile
            raise _refused(error) from error
        if verified.new_sign_count != count:
            self._note_count(by.person.id, found, verified.new_sign_count)
        return found

    @_locked
    def rename(self, person: str, passkey: str, name: str) -> Passkey:
        """Give a passkey another name, and return it. Raise NotFound, BadInput or Unavailable."""
        found = replace(self._of(person, passkey), name=_checked_name(name))
        self._replace(person, found)
        return found

    @_locked
    def remove(self, person: str, passkey: str) -> Passkey:
        """Remove a passkey, and return it as it was. Raise NotFound or Unavailable."""
        found, file = self._of(person, passkey), self.files.of(person)
        left = tuple(each for each in file.passkeys if each.id != passkey)
        self.files.write(person, replace(file, passkeys=left))
        return found

    @_locked
    def set_ask_again(self, by: Identity, minutes: int) -> None:
        """Set after how many minutes an owner is asked again; 0: never. Raise Forbidden unless they were
        confirmed just now, Conflict if they have no passkey that counts."""
        file, now = self.files.of(by.person.id), self._now()
        if minutes and all(each.counts_at > now for each in file.passkeys):
            raise Conflict("You have no passkey that counts already: register one first.")
        if not is_sure(by.confirmed_at, now):
            raise Forbidden("Confirm that it is you first.", where={"item": "confirm"})
        self.files.write(by.person.id, replace(file, ask_again=minutes))

    def _usable(self, person: str, rp: str) -> list[Passkey]:
        now = self._now()
        theirs = self.files.of(person).passkeys
        return [each for each in theirs if each.rp == rp and each.counts_at <= now]

    def _of(self, person: str, passkey: str) -> Passkey:
        for each in self.files.of(person).passkeys:
            if each.id == passkey:
                return each
        raise NotFound("You have no such passkey.")

    def _replace(self, person: str, passkey: Passkey) -> None:
        file = self.files.of(person)
        changed = tuple(passkey if each.id == passkey.id else each for each in file.passkeys)
        self.files.write(person, replace(file, passkeys=changed))

    def _note_count(self, person: str, passkey: Passkey, count: int) -> None:
        """Keep the sign count of a passkey; on a full disk until this process ends."""
        self._counts[passkey.credential] = count
        try:
            self._replace(person, replace(passkey, sign_count=count))
        except Unavailable as error:
            log.warning("the sign count of a passkey was not kept: %s", error.detail)
        else:
            del self._counts[passkey.credential]

    def _challenges_put(self, session: Session, made: _Challenge) -> None:
        now = self._clock()
        if len(self._challenges) >= _MOST_CHALLENGES:
            open_ = {key: each for key, each in self._challenges.items() if now < each.until}
            self._challenges = open_ if len(open_) < _MOST_CHALLENGES else {}
        self._challenges[session.id] = made._replace(until=now + CHALLENGE_S)

    def _take(self, kind: Literal["register", "confirm"], session: Session) -> _Challenge:
        """Return the challenge of a session, which is used up by that. Raise Forbidden if there is none
        or it is too old."""
        found = self._challenges.pop(session.id, None)
        if found is None or found.kind != kind or self._clock() >= found.until:
            raise Forbidden("This took too long, or was answered already. Try again.")
        return found


def _relying_party(origin: str) -> str:
    """Return the host name for passkeys of a page. Raise BadInput where browsers allow none."""
    url = urlsplit(origin)
    host = url.hostname or ""
    if host != "localhost" and (url.scheme != "https" or _is_address(host) or not host):
        raise BadInput(
            "Browsers allow passkeys only where the page has a name and TLS: open it by "
            "https:// and that name, or as localhost on the server's own computer."
        )
    return host


def _is_address(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


def _descriptors(passkeys: tuple[Passkey, ...] | list[Passkey], rp: str) -> list[Any]:
    from webauthn import base64url_to_bytes
    from webauthn.helpers.structs import PublicKeyCredentialDescriptor

    theirs = [each for each in passkeys if each.rp == rp]
    return [PublicKeyCredentialDescriptor(id=base64url_to_bytes(e.credential)) for e in theirs]


def _json(options: Any) -> dict[str, Any]:
    """Return options as the browser's `parse…OptionsFromJSON` takes them."""
    from webauthn import options_to_json

    found: dict[str, Any] = msgspec.json.decode(options_to_json(options))
    return found


def _checked_name(name: str) -> str:
    name = " ".join(name.split())
    if not is_name(name) or not 0 < len(name) <= NAME_LIMIT:
        raise BadInput("A passkey needs a name of 1 to 60 characters.", where={"path": "/name"})
    return name


def _refused(error: Exception) -> Forbidden:
    if "sign count" in str(error):
        return Forbidden("This passkey seems to be a copy: its counter did not go on. Remove it.")
    return Forbidden("This passkey could not be verified. Try again.")
