"""Signed-in sessions: one small file for each, beside the cookies, which are valid without it.

A cookie is enough to be let in, so that a full disk, a lost database or a dead editor signs nobody out;
`revoked/` is enough to end it. What stands here is for people: whose sessions there are, to be listed and
ended. Sessions of older versions are noted when their page is opened next.
"""

import contextlib
import logging
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.errors import NotFound
from action_assistant.private_files import replace_file
from action_assistant.web.auth.keys import SESSION_SECONDS, Person, Session
from action_assistant.web.auth.revocations import Revocations

log: Final = logging.getLogger(__name__)

FOLDER: Final = "sessions"
_MOST: Final = 5000  # that one process notes: somebody may sign in again and again


class OpenSession(msgspec.Struct, frozen=True, omit_defaults=True):
    """A browser that is signed in. `invitation`: the id of the invitation by which it came in; it
    is missing if it came in by the token."""

    id: str
    person: Person
    since: datetime
    expires: datetime
    invitation: str | None = None


class SessionFiles:
    """Stores the open sessions as files, as far as the disk has room."""

    def __init__(self, data: Path, revoked: Revocations) -> None:
        self._folder = data / FOLDER
        self._revoked = revoked
        self._noted: dict[str, Session] = {}

    def note(self, session: Session) -> None:
        """Store a session for the list of open sessions. A full disk or list is no error."""
        if self._noted.get(session.id) == session or len(self._noted) >= _MOST:
            return
        path = self._path(session.id)
        try:
            self._folder.mkdir(mode=0o700, exist_ok=True)
            content = msgspec.json.encode(session)
            replace_file(path, content, part=path.with_suffix(".part"), is_durable=False)
        except OSError as error:
            log.warning("a session could not be noted in %s: %s", self._folder, error.strerror)
            return
        self._noted[session.id] = session

    def every(self) -> list[OpenSession]:
        """Return the sessions that are still valid, newest first, and delete the files of all
        others."""
        found = []
        with contextlib.suppress(FileNotFoundError):
            for path in list(self._folder.glob("*.json")):
                session = _read(path)
                if session is None or session.expired or self._revoked.ends(session):
                    self._forget(path)
                else:
                    found.append(_shown(session))
        return sorted(found, key=lambda each: each.expires, reverse=True)

    def end(self, session: str) -> None:
        """End one session, in both processes. Raise NotFound if it is not open; raise Unavailable
        if the folder cannot store that."""
        if session not in {each.id for each in self.every()}:
            raise NotFound(f"There is no open session {session!r}.")
        self._revoked.end(session)
        self._forget(self._path(session))

    def _path(self, session: str) -> Path:
        return self._folder / f"{session}.json"

    def _forget(self, path: Path) -> None:
        self._noted.pop(path.stem, None)
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)


def _read(path: Path) -> Session | None:
    try:
        return msgspec.json.decode(path.read_bytes(), type=Session)
    except (OSError, msgspec.DecodeError):
        return None


def _shown(session: Session) -> OpenSession:
    expires = datetime.fromtimestamp(session.expires, UTC)
    since = datetime.fromtimestamp(min(session.expires - SESSION_SECONDS, time.time()), UTC)
    return OpenSession(session.id, session.person, since, expires, session.invitation)
