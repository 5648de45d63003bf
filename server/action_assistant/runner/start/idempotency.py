"""A start becomes a run: stored before anything is sent, once for each request id."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from weakref import WeakValueDictionary

import anyio

from action_assistant.errors import Conflict, Refused, Unavailable
from action_assistant.journal.events import Draft
from action_assistant.runner.clock import ClockUs
from action_assistant.runner.runs import queries
from action_assistant.runner.runs.events import Author, Ended, Requested, encode
from action_assistant.runner.runs.fold import begin
from action_assistant.runner.runs.history import RunnerJournal
from action_assistant.runner.runs.recorder import stream_of
from action_assistant.runner.runs.run import Run
from action_assistant.runner.start.admission import StartRequest
from action_assistant.web.auth.caller import BackgroundTasks


class StopOrder:
    """What was stopped, and in which order: a start that was asked for before does not leave after
    it. Robots and groups go by their names, and "" is everything."""

    def __init__(self) -> None:
        self.count = 0
        self._newest: dict[str, tuple[int, Author, str]] = {}

    def note(self, what: str, author: Author, stop_id: str = "") -> None:
        """Somebody has stopped this."""
        self.count += 1
        self._newest[what] = self.count, author, stop_id

    def since(self, count: int, *names: str) -> tuple[Author, str] | None:
        """The newest stop of any of these, or of everything, after so many; None without one."""
        known = [self._newest[each] for each in ("", *names) if each in self._newest]
        found = max(known, key=lambda each: each[0], default=None)
        return None if found is None or found[0] <= count else found[1:]


class IdempotentStarts:
    """Where starts are written down."""

    def __init__(self, journal: RunnerJournal, tasks: BackgroundTasks, clock_us: ClockUs) -> None:
        self._journal = journal
        self._tasks = tasks
        self._clock_us = clock_us
        self._asking: WeakValueDictionary[str, anyio.Lock] = WeakValueDictionary()

    @asynccontextmanager
    async def once(self, request: str) -> AsyncIterator[None]:
        """One at a time for each request."""
        lock = self._asking.get(request)
        if lock is None:
            lock = self._asking[request] = anyio.Lock()
        async with lock:
            yield

    def under_way(self, request: str) -> bool:
        """Whether a start, or one of several robots, is being carried out at this moment."""
        return request in self._asking

    async def run_of(self, asked: StartRequest) -> str | None:
        """The run that a request has become. Raises Conflict when it was another start."""
        rows = await self._journal.query(queries.by_request(asked.request_id))
        if not rows:
            return None
        row = rows[0]
        other_tree = asked.tree_digest and row.tree_digest not in {None, asked.tree_digest}
        if (row.digest, row.engine) != (asked.digest, asked.engine) or other_tree:
            raise Conflict(
                "This request_id belongs to another start.", where={"path": "/request_id"}
            )
        found: str = row.id
        return found

    async def store(self, requested: Requested) -> Run:
        """What cannot be recorded is not started."""
        stream = stream_of(requested.run)
        draft = Draft(requested.kind, requested.author.id, encode(requested))
        try:
            await self._journal.append(stream, [draft], expected=0)
        except Refused as refused:
            self._tasks.start_soon(self._disown, requested.run)
            raise Unavailable(
                f"The run could not be recorded, so nothing was started. {refused.detail}"
            ) from refused
        return begin(requested)

    async def _disown(self, run: str) -> None:
        """A commit whose answer got lost may still have happened: then say that nothing was sent."""
        stream = stream_of(run)
        end = Ended(self._clock_us(), "refused", None, "It could not be recorded in time.")
        while True:
            try:
                seq = await self._journal.newest(stream)
                if seq:
                    await self._journal.append(stream, [Draft(end.kind, "", encode(end))])
                return
            except Refused:
                await anyio.sleep(1)
