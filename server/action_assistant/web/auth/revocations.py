"""Revoked invitations and ended sessions, as either process sees them, and closing what they had
open.

`revoked/` in the data folder holds one empty file for each: `ID` for an invitation, `session-ID`,
`person-ID`, `token-ID` and `view-ID` for sessions, persons, tokens and links to one thing that were
ended. It is made at once or not at all, never changed, and needs neither the other process nor a
database to be read. What this process was told itself it also keeps in mind, whatever becomes of the
disk.
"""

import asyncio
import contextlib
import logging
import os
import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from action_assistant.errors import Unavailable
from action_assistant.kit.retrying_thread import RetryingThread
from action_assistant.web.auth.identity import Credential, Standing, Token, View
from action_assistant.web.auth.keys import Session

log: Final = logging.getLogger(__name__)

FOLDER: Final = "revoked"
SESSION_ENDED: Final = 4401  # close code of sockets
_LOOK_S: Final = 0.2
_STANDING_EACH: Final = 4  # at each fourth look also at what a credential is worth: it reads files
_SETTLED_NS: Final = 3_000_000_000  # until a folder's time has changed with its next entry for sure
_ID: Final = re.compile(r"[A-Za-z0-9]{1,40}")
_SESSION: Final = "session-"
_PERSON: Final = "person-"
_TOKEN: Final = "token-"
_VIEW: Final = "view-"
#: The form of the ids of sessions, persons and tokens.
_MARKED_ID: Final = re.compile(r"[A-Za-z0-9_-]{1,40}")


class Revocations:
    """The invitations that open nothing any more, and the sessions, persons and tokens that were
    ended."""

    def __init__(self, data: Path) -> None:
        self._folder = data / FOLDER
        self._unwritten: set[str] = set()
        self._later: Final = RetryingThread(self._write_now, "marks")
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
        """Return whether this session or its person was ended, other than by its invitation."""
        if _MARKED_ID.fullmatch(session.id) is None or self._is_marked(_SESSION + session.id):
            return True
        return self.person_ended(session.person.id)

    def person_ended(self, person: str) -> bool:
        """Return whether an owner has ended this person."""
        return _MARKED_ID.fullmatch(person) is None or self._is_marked(_PERSON + person)

    def token_ended(self, token: str) -> bool:
        """Return whether this token of a program was revoked."""
        return _MARKED_ID.fullmatch(token) is None or self._is_marked(_TOKEN + token)

    def view_ended(self, view: str) -> bool:
        """Return whether this link to one graph or run was revoked."""
        return _MARKED_ID.fullmatch(view) is None or self._is_marked(_VIEW + view)

    def ends(self, credential: Credential) -> bool:
        """Return whether a session, token or link may do nothing any more, not even Stop."""
        if isinstance(credential, View):
            return self.view_ended(credential.id)
        if self.holds(credential.invitation):
            return True
        if isinstance(credential, Token):
            return self.token_ended(credential.id) or self.person_ended(credential.person.id)
        return self.ended(credential)

    def ends_now(self) -> Callable[[Credential], bool]:
        """Return the function `ends` as of now. It reads the folder once, and so suits a check of
        many sessions and tokens."""
        return self._ends_in_mind if self._take_up() else self.ends

    def every(self) -> frozenset[str]:
        """Return the ids of all revoked invitations."""
        return frozenset(name for name in tuple(self._names()) if _ID.fullmatch(name))

    def add(self, invitation: str) -> None:
        """Revoke an invitation, at once and durably. Raise ValueError if the id is malformed; raise
        Unavailable if the folder cannot be written, so that it holds only here, until a later
        attempt succeeds."""
        if _ID.fullmatch(invitation) is None:
            raise ValueError(f"{invitation!r} is no id of an invitation")
        self._mark(invitation)

    def end(self, session: str) -> None:
        """End a session, at once and durably. Raise ValueError or Unavailable as `add` does."""
        self._mark(_SESSION + _checked(session, "a session"))

    def end_person(self, person: str) -> None:
        """End all sessions and tokens of a person, at once and durably. Raise ValueError or
        Unavailable as `add` does."""
        self._mark(_PERSON + _checked(person, "a person"))

    def end_token(self, token: str) -> None:
        """End a token of a program, at once and durably. Raise ValueError or Unavailable as `add`
        does."""
        self._mark(_TOKEN + _checked(token, "a token"))

    def end_view(self, view: str) -> None:
        """Revoke a link to one graph or run, at once and durably. Raise ValueError or Unavailable
        as `add` does."""
        self._mark(_VIEW + _checked(view, "a link"))

    def write_again(self) -> None:
        """Write to disk the marks of all that was ended and whose mark could not be written
        before. Raise Unavailable if one still cannot, after all were tried."""
        unwritten: Unavailable | None = None
        for mark in tuple(self._unwritten):
            try:
                self._mark(mark)
            except Unavailable as error:
                unwritten = error
        if unwritten is not None:
            raise unwritten

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
            self._later.start()
            raise Unavailable(
                f"It holds here and now, but could not be written to {self._folder}: "
                f"{error.strerror}. It is tried again, and forgotten when this process ends."
            ) from error
        self._unwritten.discard(mark)

    def _write_now(self) -> bool:
        """Return whether all marks are written after another attempt."""
        with contextlib.suppress(Unavailable):
            self.write_again()
        return not self._unwritten

    def _is_marked(self, mark: str) -> bool:
        if mark in self._marks:
            return True
        try:
            (self._folder / mark).stat()
        except OSError:  # it is not there; or the disk is gone, for which nobody is put out
            return False
        self._marks.add(mark)
        return True

    def _ends_in_mind(self, credential: Credential) -> bool:
        if isinstance(credential, View):
            is_id = _MARKED_ID.fullmatch(credential.id) is not None
            return not is_id or _VIEW + credential.id in self._marks
        kind = _TOKEN if isinstance(credential, Token) else _SESSION
        if kind + credential.id in self._marks or _PERSON + credential.person.id in self._marks:
            return True
        if not (_MARKED_ID.fullmatch(credential.id) and _MARKED_ID.fullmatch(credential.person.id)):
            return True
        invitation = credential.invitation
        return invitation is not None and (
            invitation in self._marks or _ID.fullmatch(invitation) is None
        )

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


def _checked(text: str, kind: str) -> str:
    if _MARKED_ID.fullmatch(text) is None:
        raise ValueError(f"{text!r} is no id of {kind}")
    return text


class SessionGuard:
    """Guards one request, socket or stream of a session or token; cancels it when that ends, or when
    the rights of its person change."""

    def __init__(
        self,
        credential: Credential,
        task: "asyncio.Task[object]",
        standing: Callable[[Credential], Standing],
        *,
        outlives: bool,
        follows_groups: bool,
    ) -> None:
        self.is_cut = self._has_failed = False
        self._standing = standing
        self._first = standing(credential)
        self._follows_groups = follows_groups
        self._looks = 0
        self._credential = credential
        self._task = task
        self._outlives = outlives

    def look(self, ends: Callable[[Credential], bool]) -> None:
        """Cut it if the session or token has ended, or its person has other rights by now: with
        these the client comes back at once. A failure is logged once, and ends no check of others."""
        try:
            self._check(ends)
        except Exception:
            if not self._has_failed:
                log.exception("it cannot be read whether a session has ended")
            self._has_failed = True

    def _check(self, ends: Callable[[Credential], bool]) -> None:
        over = ends(self._credential)
        self._looks += 1
        if not over and self._looks % _STANDING_EACH == 0:
            standing = self._standing(self._credential)
            over = (standing.expired and not self._outlives) or self._has_other_rights(standing)
        if over and not self.is_cut:
            self.is_cut = True
            self._task.cancel()

    def _has_other_rights(self, now: Standing) -> bool:
        if now.person.role != self._first.person.role:
            return True
        first = self._first
        is_changed = now.groups != first.groups or now.person.name != first.person.name
        return self._follows_groups and is_changed

    def let_go(self) -> None:
        """Undo the cancellation of the task by this guard, so that the task can go on."""
        self._task.uncancel()


class SessionGuards:
    """The guards of all open sockets and streams. It checks their sessions and tokens periodically
    while there are any."""

    def __init__(
        self, revoked: Revocations, standing: Callable[[Credential], Standing] | None = None
    ) -> None:
        self._revoked = revoked
        self._standing = standing or sealed_standing
        self._held: set[SessionGuard] = set()
        self._watch: asyncio.Task[None] | None = None

    @contextmanager
    def hold(
        self, credential: Credential, *, outlives: bool = False, follows_groups: bool = False
    ) -> Iterator[SessionGuard]:
        """Cancel the current task when the session or token ends, or its person has another role.
        `outlives`: the task goes on when the session or token merely expires; `follows_groups`:
        cancel the task also when the person has other groups."""
        task = asyncio.current_task()
        if task is None:
            raise RuntimeError("only a task can be cancelled")
        leash = SessionGuard(
            credential,
            task,
            self._standing,
            outlives=outlives,
            follows_groups=follows_groups,
        )
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


def sealed_standing(credential: Credential) -> Standing:
    """Return the standing that a session or token gives itself."""
    return Standing(credential.person, frozenset(), credential.expired)
