"""Claims and stores starts: once for each request id, and stored before anything is sent."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from math import inf
from typing import Any, Final, TypeVar
from weakref import WeakValueDictionary

import anyio
import msgspec

from action_assistant.errors import Conflict, Refused, Unavailable
from action_assistant.kit.clock import ClockUs
from action_assistant.kit.lru_cache import LruCache
from action_assistant.runner.runs import queries
from action_assistant.runner.runs.earlier import StartFrom
from action_assistant.runner.runs.events import Author, Ended, Requested, draft_of
from action_assistant.runner.runs.fold import begin
from action_assistant.runner.runs.history import RunnerJournal
from action_assistant.runner.runs.recorder import stream_of
from action_assistant.runner.runs.run import Run
from action_assistant.runner.start.admission import StartRequest
from action_assistant.umrf.start_values import StartValues
from action_assistant.web.auth.caller import BackgroundTasks

#: Why a start on one of several robots does not leave any more.
STOPPED_WITH: Final = "A run that was started with it was stopped before it began."
_REPEATS_S: Final = 3600.0  # a later press with the same id is a Stop of its own
_WHOLE_ID: Final = 100  # characters to which a longer id of a Stop is cut


class StopOrder:
    """Counts Stops, so that a start that was asked for before a Stop does not leave after it, and
    other reasons for which starts that are under way may not leave. Robots and groups are known by
    their names; "" stands for everything. Of so many things at most each is remembered by itself: what was
    noted of the others counts for everything, so a start that was asked for before does not leave."""

    def __init__(self, most: int = 2000) -> None:
        self.count = 0
        self._most = most
        self._newest: dict[str, tuple[int, Author, str]] = {}
        self._refused: dict[str, tuple[int, str]] = {}
        self._presses: LruCache[tuple[str, str], tuple[int, float]] = LruCache(most)

    def refuse(self, what: str, why: str) -> None:
        """Let no start of this repeat, or with this request id, leave that was asked for before now.
        `why`: the reason, as a sentence."""
        self.count += 1
        self._refused.pop(what, None)
        self._refused[what] = self.count, why
        _merge_oldest(self._refused, self._most)

    def why_refused(self, count: int, *names: str) -> str:
        """Return why a start with one of these names, which was asked for after the first `count`
        Stops, may not leave any more; "" if it may."""
        known = (self._refused[each] for each in (*names, "") if each in self._refused)
        return next((why for number, why in known if number > count), "")

    def note(self, what: str, author: Author, stop_id: str = "") -> None:
        """Count a Stop of this robot or group, or of everything."""
        self.count += 1
        self._newest.pop(what, None)
        self._newest[what] = self.count, author, stop_id
        _merge_oldest(self._newest, self._most)

    def note_all(self, author: Author, stop_id: str, again: bool, newest: int) -> int | None:
        """Count a Stop of everything while the newest run has the number `newest`, and return None. If it
        is sent `again`, and came within the last hour, count nothing, and return the number of the
        newest run at that time. One without an id, or whose id may have been cut, is a Stop of its own.
        Nothing of this is stored: after a restart a repeat stops too much, and never too little."""
        key, now = (author.id, stop_id), asyncio.get_running_loop().time()
        first, came = self._presses.get(key) or (0, -inf)
        if again and 0 < len(stop_id) < _WHOLE_ID and now - came < _REPEATS_S:
            return first
        self._presses.put(key, (newest, now))
        self.note("", author, stop_id)
        return None

    def since(self, count: int, *names: str) -> tuple[Author, str] | None:
        """Return author and id of the newest Stop of any of these, or of everything, after the
        first `count` Stops; None when there was none."""
        known = [self._newest[each] for each in ("", *names) if each in self._newest]
        found = max(known, key=lambda each: each[0], default=None)
        return None if found is None or found[0] <= count else found[1:]


N = TypeVar("N", bound=tuple[int, Any] | tuple[int, Any, Any])


def _merge_oldest(noted: dict[str, N], most: int) -> None:
    """Let the oldest of more than `most` things count for everything. They are in the order in which they
    were noted."""
    while len(noted) > most:
        what = next(each for each in noted if each)
        oldest = noted.pop(what)
        if "" not in noted or noted[""][0] < oldest[0]:
            noted[""] = oldest


class IdempotentStarts:
    """Holds the lock of each request that is being carried out, and stores starts in the
    journal."""

    def __init__(self, journal: RunnerJournal, tasks: BackgroundTasks, clock_us: ClockUs) -> None:
        self._journal = journal
        self._tasks = tasks
        self._clock_us = clock_us
        self._locks: WeakValueDictionary[str, anyio.Lock] = WeakValueDictionary()

    @asynccontextmanager
    async def once(self, request: str) -> AsyncIterator[None]:
        """Hold the lock of this request id until the end of the block. A second caller with the
        same id waits for the first one."""
        lock = self._locks.get(request)
        if lock is None:
            lock = self._locks[request] = anyio.Lock()
        async with lock:
            yield

    def under_way(self, request: str) -> bool:
        """Return whether the start, or the start of a group, with this request id is being carried
        out at this moment."""
        return request in self._locks

    async def run_of(self, request: StartRequest) -> str | None:
        """Return the id of the run that a request has become; None if it has become none yet. Raise
        Conflict if the request id belongs to another start."""
        rows = await self._journal.query(queries.by_request(request.request_id))
        if not rows:
            return None
        row = rows[0]
        other_tree = request.tree_digest and row.tree_digest not in {None, request.tree_digest}
        start = row.summary.get("from")
        known = {name: start[name] for name in start if name != "number"} if start else None
        other_start = request.start_from != msgspec.convert(known, StartFrom | None)
        robots = row.summary.get("robots", {})
        # A part of a graph needs only the robots of its own actors.
        wanted = {k: v for k, v in request.robots.items() if known is None or k in robots}
        other_robots = (wanted, request.lost) != (robots, row.summary.get("lost", request.lost))
        other = (row.digest, row.engine) != (request.digest, request.engine)
        other_values = request.values != msgspec.convert(row.summary.get("values", {}), StartValues)
        other_levels = request.levels != row.summary.get("levels", "one_step")
        if other or other_tree or other_robots or other_values or other_start or other_levels:
            raise Conflict(
                "This request_id belongs to another start.", where={"path": "/request_id"}
            )
        found: str = row.id
        return found

    async def store(self, requested: Requested) -> Run:
        """Append a start to the journal, and return its run. Raise Unavailable if the start cannot
        be stored; the caller then sends nothing."""
        stream = stream_of(requested.run)
        draft = draft_of(requested, requested.author.id)
        try:
            await self._journal.append(stream, [draft], expected=0)
        except Refused as refused:
            self._tasks.start_soon(self._disown, requested.run)
            raise Unavailable(
                f"The run could not be recorded, so nothing was started. {refused.detail}"
            ) from refused
        return begin(requested)

    async def _disown(self, run: str) -> None:
        """Store that a run was refused, in case its start was committed although the answer got
        lost."""
        stream = stream_of(run)
        end = Ended(self._clock_us(), "refused", None, "It could not be recorded in time.")
        while True:
            try:
                seq = await self._journal.newest(stream)
                if seq:
                    await self._journal.append(stream, [draft_of(end)])
                return
            except Refused:
                await anyio.sleep(1)
