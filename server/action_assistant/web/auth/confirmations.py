"""Confirmations: the times at which people proved that it is they who use a session.

`confirmed/SESSION.json` in the data folder holds the last confirmation of one session, sealed under the
token of the server. A process reads the file itself, so it needs neither the other process nor a
database. A runner with a data folder of its own gets the sealed record from the page. On a full disk a
confirmation holds in the processes that were told of it, until they end.
"""

import contextlib
import hmac
import logging
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Final, Literal, NamedTuple, TypeAlias

import msgspec

from action_assistant.errors import BadInput, Unauthenticated, Unavailable
from action_assistant.private_files import FileState, read_logged, state_of, write_json
from action_assistant.web.auth.keys import Keys, Session

log: Final = logging.getLogger(__name__)

FOLDER: Final = "confirmed"
#: Seconds after which a confirmation counts nowhere any more.
LONGEST_S: Final = 24 * 3600.0
_ID: Final = re.compile(r"[A-Za-z0-9_-]{1,40}")
_SKEW_S: Final = 60.0  # by which the clock of another process may be ahead
_UNEVEN_S: Final = 1.0  # by which two clocks of one computer may run unevenly
_MOST: Final = 5000  # sessions that one process keeps in memory

#: The means by which a person was confirmed: on another device of theirs, by a passkey, by signing
#: in at an identity provider again, or by the command line on the data folder.
ConfirmedBy: TypeAlias = Literal["device", "passkey", "oidc", "command"]
#: Seconds for which a confirmation also vouches for what the person adds: devices and passkeys.
SURE_S: Final = 600.0
#: Seconds after which a device or passkey counts that was added without that.
ADDED_S: Final = 24 * 3600.0
_Text = Annotated[str, msgspec.Meta(max_length=100)]


class Confirmation(msgspec.Struct, frozen=True):
    """The last confirmation of a session. `at`: seconds since 1970. `seal`: proves that a server
    with the same token made it, so it may be shown to anybody."""

    session: _Text
    at: float
    how: ConfirmedBy
    seal: _Text


def is_sure(confirmed_at: float | None, now: float) -> bool:
    """Return whether a device or passkey that is added now counts at once: it is certain that its
    person adds it, and not somebody who has found their device unlocked."""
    return confirmed_at is not None and confirmed_at >= now - SURE_S


def may_confirm(session: Session, now: float) -> bool:
    """Return whether a session may confirm another one of its person. One that was added without a
    confirmation may not for a day, in which its person can see and end it."""
    return not session.expired and (not session.added or session.begun <= now - ADDED_S)


class _Known(NamedTuple):
    """A confirmation in memory, and the state of its file as it was read; None without a file. `since`:
    the monotonic time at which it would have been made by its age when it became known."""

    state: FileState | None
    found: Confirmation | None
    since: float = 0.0


class Confirmations:
    """Keeps, verifies and reads the last confirmation of each session."""

    def __init__(
        self,
        data: Path,
        keys: Keys,
        clock: Callable[[], float] = time.time,
        monotonic: Callable[[], float] = time.monotonic,
    ) -> None:
        self._folder = data / FOLDER
        self._keys = keys
        self._clock = clock
        self._monotonic = monotonic
        self._known: dict[str, _Known] = {}

    def confirm(
        self, session_id: str, how: ConfirmedBy, *, is_stored: bool = False
    ) -> Confirmation:
        """Record that the person of a session has confirmed now that they use it, and return the
        sealed record, which other processes of this server accept. Raise ValueError if the id of
        the session is malformed. If the file cannot be written, only this process knows of the
        confirmation; with `is_stored`, raise Unavailable then."""
        if _ID.fullmatch(session_id) is None:
            raise ValueError(f"{session_id!r} is no id of a session")
        plain = Confirmation(session_id, self._clock(), how, "")
        made = msgspec.structs.replace(plain, seal=self._seal(plain))
        self._keep(made, is_stored=is_stored)
        return made

    def adopt(self, given: Confirmation) -> None:
        """Keep a confirmation that another process made; an older one than is known changes nothing.
        Raise BadInput or Unauthenticated if this server's token did not seal it."""
        seal = self._seal(given).encode()
        if _ID.fullmatch(given.session) is None:
            raise BadInput("This names no session.", where={"path": "/session"})
        if not hmac.compare_digest(seal, given.seal.encode(errors="replace")):
            raise Unauthenticated("No server with this token has made this confirmation.")
        if given.at > self._clock() + _SKEW_S:
            raise BadInput(
                "The clocks of the editor's computer and of the runner's differ by more than a "
                "minute: set them, then confirm again.",
                where={"path": "/at"},
            )
        known = self.last(given.session)
        if known is None or known.at < given.at:
            self._keep(given)

    def confirmed_at(self, session_id: str) -> float | None:
        """Return when the person of a session was last confirmed, in seconds since 1970; None if
        that is not known. No clock that was set back makes it younger while this process knows it."""
        known = self._last(session_id)
        if known is None or known.found is None:
            return None
        lost = self._monotonic() - known.since - (self._clock() - known.found.at)
        return known.found.at - lost if lost > _UNEVEN_S else known.found.at

    def last(self, session_id: str) -> Confirmation | None:
        """Return the last confirmation of a session; None if none is known. One that is dated later
        than now does not count: the clock has jumped."""
        known = self._last(session_id)
        return None if known is None else known.found

    def _last(self, session_id: str) -> _Known | None:
        if _ID.fullmatch(session_id) is None:
            return None
        known = self._known.get(session_id)
        path = self._path(session_id)
        try:
            state = state_of(path)
            if known is None or known.state != state:
                read = self._read(path, session_id)
                kept = None if known is None or self._is_future(known.found) else known.found
                if known is None or known.found != _newer(kept, read):
                    known = self._known_now(read)
                known = known._replace(state=state)
                self._remember(session_id, known)
        except OSError:  # not there, or the disk is gone: what is in memory holds
            pass
        return None if known is None or self._is_future(known.found) else known

    def _is_future(self, found: Confirmation | None) -> bool:
        return found is not None and found.at > self._clock() + _SKEW_S

    def _known_now(self, found: Confirmation | None) -> _Known:
        age = 0.0 if found is None else max(0.0, self._clock() - found.at)
        return _Known(None, found, self._monotonic() - age)

    def prune(self) -> None:
        """Delete the files of confirmations that are too old for every rule."""
        with contextlib.suppress(OSError):
            for path in list(self._folder.iterdir()):
                with contextlib.suppress(OSError):  # the other process may delete it, too
                    if self._clock() - path.stat().st_mtime > LONGEST_S:
                        path.unlink(missing_ok=True)

    def _keep(self, made: Confirmation, *, is_stored: bool = False) -> None:
        """Store a confirmation in memory and as a file. If the file cannot be written, log this;
        with `is_stored`, raise Unavailable."""
        self._remember(made.session, self._known_now(made))
        try:
            write_json(self._path(made.session), made, is_durable=False)
        except OSError as error:
            if is_stored:
                raise Unavailable(
                    f"The confirmation could not be written to {self._folder}: {error.strerror}."
                ) from error
            log.warning("a confirmation could not be kept in %s: %s", self._folder, error.strerror)

    def _remember(self, session_id: str, known: _Known) -> None:
        if len(self._known) >= _MOST:
            self._known.clear()  # the files have them
        self._known[session_id] = known

    def _read(self, path: Path, session_id: str) -> Confirmation | None:
        """Return the confirmation in a file; None if it is not genuine. Raise OSError."""
        found = read_logged(path, Confirmation)
        if found is None:
            return None
        genuine = hmac.compare_digest(self._seal(found).encode(), found.seal.encode())
        is_past = found.at <= self._clock() + _SKEW_S
        return found if genuine and found.session == session_id and is_past else None

    def _seal(self, given: Confirmation) -> str:
        plain = msgspec.json.encode(msgspec.structs.replace(given, seal=""))
        return self._keys.confirmation_seal(plain)

    def _path(self, session_id: str) -> Path:
        return self._folder / f"{session_id}.json"


def _newer(kept: Confirmation | None, read: Confirmation | None) -> Confirmation | None:
    """Return the newer one of a confirmation in memory and one read from a file."""
    if kept is None or read is None:
        return kept or read
    return kept if kept.at > read.at else read
