"""Signed-in sessions: one small file for each, beside the cookies, which are valid without it.

A cookie is enough to be let in, so that a full disk, a lost database or a dead editor signs nobody out;
`revoked/` is enough to end it. What stands here is for people: whose sessions there are, on which
browsers, to be listed and ended. The time of the last change of a file is that of the last use of its
session. Sessions of older versions are noted when their page is opened next.
"""

import contextlib
import logging
import os
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, NamedTuple

import msgspec

from action_assistant.errors import Conflict, NotFound, Unavailable
from action_assistant.private_files import (
    DamagedFile,
    log_unreadable,
    read_json,
    replace_file,
)
from action_assistant.web.auth.keys import SESSION_SECONDS, SKEW_S, Person, Session
from action_assistant.web.auth.revocations import Revocations

log: Final = logging.getLogger(__name__)

FOLDER: Final = "sessions"
_MOST: Final = 5000  # that one process notes: somebody may sign in again and again
#: Sessions of one person with which further devices are added.
MOST_DEVICES: Final = 30
_USE_S: Final = 60.0  # between two notes of the use of one session
_LATEST: Final = 250_000_000_000.0  # seconds since 1970: before the year 10000


class OpenSession(msgspec.Struct, frozen=True, omit_defaults=True):
    """A browser that is signed in. `invitation`: the id of the invitation by which it came in; it
    is missing if it came in by the token or a personal link. `browser`: its name and system, as it
    says; `address`: where it signed in, missing for this computer itself. `used_at`: the last use,
    to the minute."""

    id: str
    person: Person
    since: datetime
    expires: datetime
    invitation: str | None = None
    browser: str = ""
    address: str = ""
    used_at: datetime | None = None
    personal: bool = False


class NotedSession(Session, frozen=True):
    """A session as its file says, with the browser and the address at which it was noted."""

    browser: str = ""
    address: str = ""


class EndedSessions(NamedTuple):
    """The ids of sessions that were ended. `left`: why the end of some is not stored, so that it holds in
    this process only; None if all are."""

    ids: list[str]
    left: Unavailable | None


class SessionFiles:
    """Stores the open sessions as files, as far as the disk has room."""

    def __init__(
        self, data: Path, revoked: Revocations, is_over: Callable[[Session], bool] | None = None
    ) -> None:
        self._folder = data / FOLDER
        self._revoked = revoked
        self._is_over = is_over or (lambda session: session.expired)
        self._noted: dict[str, Session] = {}
        self._used: dict[str, float] = {}

    def judge_by(self, is_over: Callable[[Session], bool]) -> None:
        """List only those sessions from now on for which `is_over` returns False."""
        self._is_over = is_over

    def note(self, session: Session, browser: str = "", address: str = "") -> None:
        """Store a session for the list of open sessions. A full disk is no error; neither is a list that
        is full of guests, who may sign in again and again: persons that an owner named stand in it."""
        sealed: dict[str, Any] = msgspec.structs.asdict(session)
        noted = NotedSession(**sealed, browser=browser, address=address)
        is_full = len(self._noted) >= _MOST and not session.personal
        if self._noted.get(session.id) == noted or is_full:
            return
        path = self._path(session.id)
        try:
            self._folder.mkdir(mode=0o700, exist_ok=True)
            content = msgspec.json.encode(noted)
            replace_file(path, content, part=path.with_suffix(".part"), is_durable=False)
        except OSError as error:
            log.warning("a session could not be noted in %s: %s", self._folder, error.strerror)
            return
        self._noted[session.id] = noted

    def use(self, session: str) -> None:
        """Record that the session with this id is used now, at most once a minute. Raise nothing if
        the disk is full or the session has no file."""
        now = time.time()
        if 0 <= now - self._used.get(session, 0.0) < _USE_S:
            return
        if len(self._used) >= _MOST:
            self._used.clear()
        self._used[session] = now
        with contextlib.suppress(OSError, ValueError):
            os.utime(self._path(session))

    def used_at(self, session: Session) -> float | None:
        """Return when a session was last used, in seconds since 1970, by either process; None if
        that is unknown. A use that is dated later than now counts from now on: the clock was set
        back."""
        mine, now = self._used.get(session.id), time.time()
        if mine is not None and 0 <= now - mine < _USE_S:
            return mine
        try:
            noted = self._path(session.id).stat().st_mtime
        except (OSError, ValueError):
            return mine
        if noted > now + SKEW_S:
            self._used.pop(session.id, None)
            with contextlib.suppress(OSError):
                os.utime(self._path(session.id))
            return now
        return noted if mine is None else max(noted, min(mine, now))

    def every(self) -> list[OpenSession]:
        """Return the sessions that are still valid, newest first, and delete the files of those
        that never will be again. The file of an idle session stays, since it proves that; so does one
        that cannot be read."""
        lasting = [each for each in self._stored() if not (each.expired or self._is_over(each))]
        return sorted(map(self._shown, lasting), key=lambda each: each.expires, reverse=True)

    def _stored(self) -> list[NotedSession]:
        """Return the sessions that may be valid again, such as idle ones, and delete the files of
        others."""
        found = []
        with contextlib.suppress(FileNotFoundError):
            for path in list(self._folder.glob("*.json")):
                session = _read(path)
                if session is None:
                    continue
                if time.time() >= session.expires or self._revoked.ends(session):
                    self._forget(path)
                else:
                    found.append(session)
        return found

    def end(self, session: str) -> None:
        """End one session, in both processes. Raise NotFound if it is not open; raise Unavailable
        if the folder cannot store that."""
        if session not in {each.id for each in self.every()}:
            raise NotFound(f"There is no open session {session!r}.")
        self._revoked.end(session)
        self._forget(self._path(session))

    def end_all_of(self, person: str, *, but: str | None = None) -> "EndedSessions":
        """End all sessions of a person, idle ones too, except the session with the id `but`. Raise
        nothing if the folder cannot store the end of a session: that session has then ended in this
        process, and the result says why other processes may not know it."""
        theirs = [each.id for each in self._stored() if each.person.id == person and each.id != but]
        unwritten: list[Unavailable] = []
        for each in theirs:
            try:
                self._revoked.end(each)
            except Unavailable as error:  # it holds here, and is tried again
                unwritten.append(error)
            else:
                self._forget(self._path(each))
        left = None
        if unwritten:
            left = Unavailable(f"{len(unwritten)} of {len(theirs)} sessions: {unwritten[0].detail}")
        return EndedSessions(theirs, left)

    def require_room(self, person: str) -> None:
        """Raise Conflict if a person is signed in on as many devices as one may have."""
        if sum(each.person.id == person for each in self.every()) >= MOST_DEVICES:
            raise Conflict(
                f"You are signed in on {MOST_DEVICES} devices; sign one of them out first."
            )

    def _path(self, session: str) -> Path:
        return self._folder / f"{session}.json"

    def _forget(self, path: Path) -> None:
        self._noted.pop(path.stem, None)
        self._used.pop(path.stem, None)
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)

    def _shown(self, session: NotedSession) -> OpenSession:
        used = self.used_at(session)
        begun = session.begun or min(session.expires - SESSION_SECONDS, time.time())
        return OpenSession(
            session.id,
            session.person,
            _time(begun),
            _time(session.expires),
            session.invitation,
            session.browser,
            session.address,
            None if used is None else _time(used),
            session.personal,
        )


def _read(path: Path) -> NotedSession | None:
    """Return the session in a file; None for a file that is gone or cannot be read."""
    try:
        found = read_json(path, NotedSession)
        if found.id != path.stem:
            raise DamagedFile("it is about another session")
        if not (0 <= found.begun < _LATEST and 0 <= found.expires < _LATEST):
            raise DamagedFile("it has a time that no calendar has")
    except FileNotFoundError:
        return None
    except (OSError, DamagedFile) as error:
        log_unreadable(path, error)
        return None
    return found


def _time(seconds: float) -> datetime:
    return datetime.fromtimestamp(seconds, UTC)
