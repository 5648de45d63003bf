"""Revoked invitations and ended sessions, as either process sees them, and closing what they had
open.

`revoked/` in the data folder holds one empty file for each: `ID` for an invitation, `session-ID` for a
session. It is made at once or not at all, never changed, and needs neither the other process nor a
database to be read. What this process was told itself it also keeps in mind, whatever becomes of the
disk.
"""

import asyncio
import logging
import os
import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from action_assistant.errors import Unavailable
from action_assistant.web.auth.keys import Session

log: Final = logging.getLogger(__name__)

FOLDER: Final = "revoked"
SESSION_ENDED: Final = 4401  # close code of sockets
_LOOK_S: Final = 0.2
_SETTLED_NS: Final = 3_000_000_000  # until a folder's time has changed with its next entry for sure
_ID: Final = re.compile(r"[A-Za-z0-9]{1,40}")
_SESSION: Final = "session-"
_SESSION_ID: Final = re.compile(r"[A-Za-z0-9_-]{1,40}")


class Revocations:
    """The invitations that open nothing any more, and the sessions that have ended."""

    def __init__(self, data: Path) -> None:
        self._folder = data / FOLDER
        self._unwritten: set[str] = set()
        self._listed_at = 0  # when the folder had changed last, as it was listed
        try:
            self._folder.mkdir(
                mode=0o700, parents=True, exist_ok=True
            )  # a full disk has no room for it
            self._marks = {entry.name for entry in self._folder.iterdir()}
        except OSError as error:
            log.error("%s cannot be read: %s", self._folder, error.strerror)
            self._marks = set()

    def holds(self, invitation: str | None) -> bool:
        """Return whether an invitation was revoked; False for None, which stands for the token."""
        if invitation is None:
            return False
        return _ID.fullmatch(invitation) is None or self._is_marked(invitation)

    def ended(self, session: Session) -> bool:
        """Return whether this session was ended by itself, not by its invitation."""
        return _SESSION_ID.fullmatch(session.id) is None or self._is_marked(_SESSION + session.id)

    def ends(self, session: Session) -> bool:
        """Return whether a session may do nothing any more, not even Stop."""
        return self.holds(session.invitation) or self.ended(session)

    def ends_now(self) -> Callable[[Session], bool]:
        """Return the function `ends` as of now. It reads the folder once, and so suits a check of
        many sessions."""
        return self._ends_in_mind if self._take_up() else self.ends

    def every(self) -> frozenset[str]:
        """Return the ids of all revoked invitations."""
        return frozenset(name for name in tuple(self._names()) if _ID.fullmatch(name))

    def add(self, invitation: str) -> None:
        """Revoke an invitation, at once and durably. Raise ValueError if the id is malformed; raise
        Unavailable if the folder cannot be written, so that it holds only until this process
        ends."""
        if _ID.fullmatch(invitation) is None:
            raise ValueError(f"{invitation!r} is no id of an invitation")
        self._mark(invitation)

    def end(self, session: str) -> None:
        """End a session, at once and durably. Raise ValueError or Unavailable as `add` does."""
        if _SESSION_ID.fullmatch(session) is None:
            raise ValueError(f"{session!r} is no id of a session")
        self._mark(_SESSION + session)

    def write_again(self) -> None:
        """Write the marks that could not be written before. Raise Unavailable if they still cannot."""
        for mark in tuple(self._unwritten):
            self._mark(mark)

    def _mark(self, mark: str) -> None:
        self._marks.add(mark)
        self._unwritten.add(mark)
        try:
            self._folder.mkdir(mode=0o700, exist_ok=True)
            (self._folder / mark).touch(mode=0o600)
            folder = os.open(self._folder, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
        except OSError as error:
            raise Unavailable(
                f"It holds here and now, but could not be written to {self._folder}: "
                f"{error.strerror}. It is forgotten when this process ends."
            ) from error
        self._unwritten.discard(mark)

    def _is_marked(self, mark: str) -> bool:
        if mark in self._marks:
            return True
        try:
            (self._folder / mark).stat()
        except OSError:  # it is not there; or the disk is gone, for which nobody is put out
            return False
        self._marks.add(mark)
        return True

    def _ends_in_mind(self, session: Session) -> bool:
        mark, invitation = _SESSION + session.id, session.invitation
        if mark in self._marks or invitation in self._marks:
            return True
        if invitation is not None and _ID.fullmatch(invitation) is None:
            return True
        return _SESSION_ID.fullmatch(session.id) is None

    def _take_up(self) -> bool:
        """Read the marks that other processes have written; return False if the folder cannot be
        read. The modification time of a folder may stay the same for entries that follow
        closely."""
        try:
            now = time.time_ns()
            changed = self._folder.stat().st_mtime_ns
            if changed != self._listed_at:
                self._marks |= {entry.name for entry in self._folder.iterdir()}
                self._listed_at = changed if now - changed > _SETTLED_NS else 0
        except OSError:
            return False
        return True

    def _names(self) -> set[str]:
        try:
            self._marks |= {entry.name for entry in self._folder.iterdir()}
        except OSError as error:
            log.error("%s cannot be read: %s", self._folder, error.strerror)
        return self._marks


class SessionGuard:
    """Guards one open socket or stream of a session; cancels it when the session ends."""

    def __init__(self, session: Session, task: "asyncio.Task[object]", *, outlives: bool) -> None:
        self.is_cut = False
        self._session = session
        self._task = task
        self._outlives = outlives

    def look(self, ends: Callable[[Session], bool]) -> None:
        """Cut it if the session has ended."""
        over = ends(self._session)
        over = over or (self._session.expired and not self._outlives)
        if over and not self.is_cut:
            self.is_cut = True
            self._task.cancel()

    def let_go(self) -> None:
        """Undo the cancellation of the task by this guard, so that the task can go on."""
        self._task.uncancel()


class SessionGuards:
    """The guards of all open sockets and streams of sessions. It checks the sessions periodically
    while there are any."""

    def __init__(self, revoked: Revocations) -> None:
        self._revoked = revoked
        self._held: set[SessionGuard] = set()
        self._watch: asyncio.Task[None] | None = None

    @contextmanager
    def hold(self, session: Session, *, outlives: bool = False) -> Iterator[SessionGuard]:
        """Cancel the current task when the session ends. `outlives`: not when it merely expires."""
        task = asyncio.current_task()
        if task is None:
            raise RuntimeError("only a task can be cancelled")
        leash = SessionGuard(session, task, outlives=outlives)
        self._held.add(leash)
        if self._watch is None or self._watch.done():
            self._watch = asyncio.create_task(self._looking(), name="leashes")
        try:
            yield leash
        finally:
            self._held.discard(leash)

    async def _looking(self) -> None:
        while self._held:
            ends = self._revoked.ends_now()
            for leash in tuple(self._held):
                leash.look(ends)
            await asyncio.sleep(_LOOK_S)
