"""Answers questions about stored runs in a worker that reads the database itself, read-only.

A question is a method of `StoredRuns`. `WorkerQueries` is the runner's side: it waits until what
was just shown is stored before it asks, and stores keyframes that the worker made on the way.
"""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Sequence
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Concatenate, Final, ParamSpec, TypeVar

import anyio
import msgspec

from action_assistant.errors import Refused, Unavailable
from action_assistant.journal.events import Draft, StreamSnapshot
from action_assistant.journal.reader import FileJournalReader
from action_assistant.runner.analysis.keyframes import SnapshotJournal
from action_assistant.runner.archives.archive_store import ArchiveStore
from action_assistant.runner.review.stored_runs import StoredRuns
from action_assistant.runner.runs.recorder import RunRecorder, stream_of
from action_assistant.runner.runs.run import Run
from action_assistant.web.auth.caller import BackgroundTasks
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

P = ParamSpec("P")
T = TypeVar("T")

_SETTLED_S: Final = 2.0  # after which a question is answered from what is stored


class StoragePaths(msgspec.Struct, frozen=True):
    """The paths of runs: the database file, and the folder of archives."""

    database: Path
    archive: Path


class WorkerQueries:
    """Answers questions about stored runs in a worker process. `recorder_of` returns the recorder
    of an open run, None for any other id. Snapshots that the worker made are stored by `tasks`
    afterwards."""

    def __init__(
        self,
        run_in_worker: RunInWorker,
        paths: StoragePaths,
        journal: SnapshotJournal,
        tasks: BackgroundTasks,
    ) -> None:
        self.recorder_of: Callable[[str], RunRecorder | None] = lambda _: None
        self._run_in_worker = run_in_worker
        self._paths = paths
        self._journal = journal
        self._tasks = tasks

    async def value(
        self,
        question: Callable[Concatenate[StoredRuns, P], Awaitable[T]],
        *args: P.args,
        **kw: P.kwargs,
    ) -> T:
        """Call a method of `StoredRuns` (`question`) with these arguments in a worker, and return
        its result. Raise its errors; Unavailable or TooMany if no worker can answer."""
        value: T = await self._ask(answered, partial(question, **kw), args)
        return value

    async def text(
        self,
        question: Callable[Concatenate[StoredRuns, P], Awaitable[T]],
        *args: P.args,
        **kw: P.kwargs,
    ) -> bytes:
        """Call a method of `StoredRuns` (`question`) with these arguments in a worker, and return
        its result as JSON. Raise its errors; Unavailable or TooMany if no worker can answer."""
        text: bytes = await self._ask(encoded, partial(question, **kw), args)
        return text

    async def newest(self, run: str) -> int:
        """Return the number (seq) of the last stored event of a run, after a wait until those shown
        so far are stored; 0 without any. Raise Unavailable if the journal cannot be read."""
        await self.wait_until_stored(run)
        return await self._journal.newest(stream_of(run))

    async def past(self, run: str, robots_too: bool) -> tuple[Run, int]:
        """Return a run that is over, and the number (seq) of its last event. `robots_too`: with all
        its visits, else with the newest ones."""
        return await self.value(StoredRuns.followed, run, robots_too)

    async def _ask(
        self,
        work: Callable[..., tuple[Any, list[StreamSnapshot]]],
        question: Callable[..., Awaitable[Any]],
        args: Sequence[Any],
    ) -> Any:
        """Return the result of `work` for a question, run in a worker. If the question is about an
        open run, first wait until the events shown so far are stored."""
        for each in args:
            if isinstance(each, str):
                await self.wait_until_stored(each)
        found, snapshots = await self._run_in_worker(work, self._paths, question, args)
        if snapshots:
            self._tasks.start_soon(self._store, snapshots)
        return found

    async def wait_until_stored(self, run: str) -> None:
        """Wait until the events of an open run that were shown are stored, for two seconds at most."""
        recorder = self.recorder_of(run)
        if recorder is not None:
            with anyio.move_on_after(_SETTLED_S):
                await recorder.flushed()

    async def _store(self, snapshots: Sequence[StreamSnapshot]) -> None:
        """Store snapshots. They are a cache: a failure ends nothing, and they are made again
        later."""
        for each in snapshots:
            try:
                await self._journal.keep_snapshot(each.stream, each.seq, each.state)
            except Refused as why:
                log.info("the snapshot of %s is not stored: %s", each.stream, why.detail)
            except Exception:
                log.exception("the snapshot of %s is not stored", each.stream)


def answered(
    paths: StoragePaths, question: Callable[..., Awaitable[Any]], args: Sequence[Any]
) -> tuple[Any, list[StreamSnapshot]]:
    """Answer a question (a method of `StoredRuns`) in this worker process, from the database at
    `paths`. Return the answer, and the snapshots made for it, which the caller stores. Raise the
    errors of the question."""
    stored_runs, file = _reading(paths)
    found = asyncio.run(_asked(question, stored_runs, args))
    return found, file.given()


def encoded(
    paths: StoragePaths, question: Callable[..., Awaitable[Any]], args: Sequence[Any]
) -> tuple[bytes, list[StreamSnapshot]]:
    """Answer a question (a method of `StoredRuns`) in this worker process, from the database at
    `paths`. Return the answer as JSON, and the snapshots made for it, which the caller stores.
    Raise the errors of the question."""
    found, snapshots = answered(paths, question, args)
    return msgspec.json.encode(found), snapshots


async def _asked(
    question: Callable[..., Awaitable[Any]], stored_runs: StoredRuns, args: Sequence[Any]
) -> object:
    return await question(stored_runs, *args)


@lru_cache(maxsize=1)
def _reading(paths: StoragePaths) -> "tuple[StoredRuns, _ReadOnlyJournal]":
    file = _ReadOnlyJournal(paths.database)
    return StoredRuns(ArchiveStore(file, paths.archive, _in_this_thread)), file


async def _in_this_thread(work: Callable[..., T], *args: Any) -> T:
    return work(*args)


class _ReadOnlyJournal(FileJournalReader):
    """The journal in a worker, which cannot write: snapshots to store are collected for the runner."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._kept: list[StreamSnapshot] = []

    async def append(
        self, stream: str, drafts: Sequence[Draft], *, expected: int | None = None
    ) -> int:
        """Raise Unavailable always: a worker does not write."""
        raise Unavailable("A worker writes nothing.")

    async def keep_snapshot(self, stream: str, seq: int, state: bytes) -> None:
        """Collect a snapshot of a stream at event number `seq`, which the runner stores."""
        self._kept.append(StreamSnapshot(stream, seq, state))

    def given(self) -> list[StreamSnapshot]:
        """Return the collected snapshots, and empty the collection."""
        given, self._kept = self._kept, []
        return given
