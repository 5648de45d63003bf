"""Which invitations were revoked, as either process sees it by itself; and what that ends.

`revoked/` in the data folder holds one empty file for each: made at once or not at all, never
changed, and it needs neither the other process nor a database to be read.
"""

import asyncio
import logging
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from action_assistant.errors import Unavailable
from action_assistant.web.keys import Session

log: Final = logging.getLogger(__name__)

FOLDER: Final = "revoked"
SESSION_ENDED: Final = 4401  # close code of sockets
_LOOK_S: Final = 0.2
_ID: Final = re.compile(r"[A-Za-z0-9]{1,40}")


class Revoked:
    """The invitations that open nothing any more."""

    def __init__(self, data: Path) -> None:
        self._folder = data / FOLDER

    def holds(self, invitation: str | None) -> bool:
        """Whether a session that came in by this invitation has ended. None: by the token."""
        if invitation is None:
            return False
        return _ID.fullmatch(invitation) is None or (self._folder / invitation).exists()

    def every(self) -> frozenset[str]:
        """All of them."""
        try:
            return frozenset(entry.name for entry in self._folder.iterdir())
        except FileNotFoundError:
            return frozenset()

    def add(self, invitation: str) -> None:
        """Revoke one. On disk when it returns. Raises Unavailable, ValueError."""
        if _ID.fullmatch(invitation) is None:
            raise ValueError(f"{invitation!r} is no id of an invitation")
        try:
            self._folder.mkdir(mode=0o700, exist_ok=True)
            (self._folder / invitation).touch(mode=0o600)
            folder = os.open(self._folder, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
        except OSError as error:
            raise Unavailable(
                f"The invitation could not be revoked in {self._folder}: {error.strerror}."
            ) from error


class Leash:
    """Holds one open socket or stream of a session; is cut when the session ends."""

    def __init__(self, session: Session, task: "asyncio.Task[object]", *, outlives: bool) -> None:
        self.is_cut = False
        self._session = session
        self._task = task
        self._outlives = outlives

    def look(self, revoked: Revoked) -> None:
        """Cut it if the session has ended."""
        over = revoked.holds(self._session.invitation)
        over = over or (self._session.expired and not self._outlives)
        if over and not self.is_cut:
            self.is_cut = True
            self._task.cancel()

    def let_go(self) -> None:
        """The task goes on after it was cut."""
        self._task.uncancel()


class Leashes:
    """Everything that is open in somebody's name. Looks while there is something to look after."""

    def __init__(self, revoked: Revoked) -> None:
        self._revoked = revoked
        self._held: set[Leash] = set()
        self._watch: asyncio.Task[None] | None = None

    @contextmanager
    def hold(self, session: Session, *, outlives: bool = False) -> Iterator[Leash]:
        """Cancel the current task when the session ends. `outlives`: not when it merely expires."""
        task = asyncio.current_task()
        if task is None:
            raise RuntimeError("only a task can be cancelled")
        leash = Leash(session, task, outlives=outlives)
        self._held.add(leash)
        if self._watch is None or self._watch.done():
            self._watch = asyncio.create_task(self._looking(), name="leashes")
        try:
            yield leash
        finally:
            self._held.discard(leash)

    async def _looking(self) -> None:
        while self._held:
            for leash in tuple(self._held):
                leash.look(self._revoked)
            await asyncio.sleep(_LOOK_S)
