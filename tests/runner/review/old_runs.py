"""A data folder with old runs and raw messages, a process that puts them away, and where it can die."""

import asyncio
import gzip
import os
import signal
import sqlite3
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any, Final

import msgspec

from action_assistant.journal import sqlite as sqlite_journal
from action_assistant.journal.events import Event
from action_assistant.journal.journal import Journal
from action_assistant.runner import projection
from action_assistant.runner.analysis import annotations
from action_assistant.runner.archives import archive_file
from action_assistant.runner.archives.archive_store import ArchiveStore
from action_assistant.runner.archives.retention import Retention
from action_assistant.runner.links.observations import NodeState
from action_assistant.runner.robots.recordings import Recordings
from action_assistant.runner.runs.events import Ended, Observed, Published, draft_of
from action_assistant.runner.runs.fold import replay
from action_assistant.runner.runs.recorder import stream_of
from action_assistant.settings import Keep
from runner.runs.test_runs import REQUESTED

DAY_US: Final = 86_400_000_000
NOW: Final = 100 * DAY_US
#: The number of events of each run; the longest run is deleted in several steps.
LENGTHS: Final = {"r1": 12, "r2": 2_300, "r3": 12}
_HOURS: Final = ("1970-03-01T07", "1970-03-01T08", "1970-04-10T23")


def opened(data: Path) -> "asyncio.Future[Journal]":
    url = f"sqlite:///{data / 'runner.db'}"
    return asyncio.ensure_future(Journal.open(url, branch="runner", fold=projection.fold))


async def filled(data: Path) -> None:
    """Three runs that ended on the third day, and three hours of raw messages of a robot."""
    journal = await opened(data)
    for number, (run, length) in enumerate(LENGTHS.items(), 1):
        await add_run(journal, run, number, length, ended_at=3 * DAY_US)
    await journal.close()
    folder = data / "recordings" / "David"
    folder.mkdir(parents=True)
    for hour in _HOURS:
        (folder / f"{hour}.jsonl.gz").write_bytes(gzip.compress(hour.encode()))


async def add_run(journal: Journal, run: str, number: int, length: int, ended_at: int) -> None:
    """A run that is over and summed up."""
    asked = msgspec.structs.replace(
        REQUESTED, run=run, number=number, request_id=f"q{number}", engine="David", simulated=False
    )
    states = ("RUNNING", "FINISHED")
    events: list[Any] = [asked, Published(1_100, "life")]
    for i in range(length - 3):
        at = 2_000 + i
        events.append(Observed(at, (NodeState(at, "patrol", "Go_0", states[i % 2]),)))
    events.append(Ended(ended_at, "finished", "on_true"))
    drafts = [draft_of(each, "ann") for each in events]
    for i in range(0, len(drafts), 500):
        await journal.append(stream_of(run), drafts[i : i + 500])
    told = replay(events)
    assert told is not None
    await journal.append(
        annotations.stream_about(run), [annotations.draft(annotations.sum_of(told, None, ended_at))]
    )


def retention(journal: Journal, data: Path, **more: Any) -> Retention:
    keep = Keep(folder=data / "archive", runs=30, raw=7)
    recordings = Recordings(data / "recordings", asyncio.to_thread, prunes=False)
    fields: dict[str, Any] = {"is_open": lambda _: False, "clock_us": lambda: NOW}
    return Retention(journal, recordings, keep, run_in_worker=asyncio.to_thread, **(fields | more))


def archive_store(journal: Journal, data: Path) -> ArchiveStore:
    return ArchiveStore(journal, data / "archive", asyncio.to_thread)


async def everything(journal: Journal, data: Path) -> dict[str, list[Event]]:
    """Return the events of all runs, wherever they are kept; the journal has to be sound."""
    assert await journal.verify() == []
    read = archive_store(journal, data).read
    return {run: await read(stream_of(run)) for run in LENGTHS}


def raw_messages(data: Path) -> set[str]:
    """The hours of raw messages that are whole, here or in the archive."""
    folders = (data / "recordings" / "David", data / "archive" / "raw" / "David")
    files = [path for folder in folders if folder.is_dir() for path in folder.glob("*.gz")]
    return {gzip.decompress(path.read_bytes()).decode() for path in files}


def put_away(data: Path, dies_at: int) -> None:
    """Archive all old runs, in a process that dies at step `dies_at`."""
    steps = iter(range(1, sys.maxsize))

    def dies(before: Callable[..., Any]) -> Callable[..., Any]:
        def step(*args: Any, **kwargs: Any) -> Any:
            if next(steps) == dies_at:
                os.kill(os.getpid(), signal.SIGKILL)
            return before(*args, **kwargs)

        return step

    async def main() -> None:
        journal = await opened(data)
        for owner, name in _STEPS:
            setattr(owner, name, dies(getattr(owner, name)))
        await retention(journal, data).sweep(30, 7)
        os._exit(0)

    asyncio.run(main())


_STEPS: Final[tuple[tuple[Any, str], ...]] = (
    (archive_file.ArchiveFile, "add"),
    (archive_file.ArchiveFile, "close"),
    (archive_file, "sha256_of"),
    (archive_file, "sync"),
    (os, "fsync"),
    (Path, "replace"),
    (Path, "unlink"),
    (sqlite_journal.SqliteSession, "say"),
    (sqlite_journal.SqliteSession, "store"),
)


def copies(data: Path, target: Path) -> Iterator[Path]:
    """Yield copies of the same folder."""
    for number in range(1, sys.maxsize):
        copy = target / str(number)
        (copy / "recordings" / "David").mkdir(parents=True)
        with (
            closing(sqlite3.connect(data / "runner.db")) as there,
            closing(sqlite3.connect(copy / "runner.db")) as here,
        ):
            there.backup(here)
        for path in (data / "recordings" / "David").iterdir():
            (copy / "recordings" / "David" / path.name).write_bytes(path.read_bytes())
        yield copy


def waited(process: Any, patience: float = 60.0) -> int:
    """The exit code of a process."""
    process.join(patience)
    assert process.exitcode is not None, time.monotonic()
    code: int = process.exitcode
    return code
