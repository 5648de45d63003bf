"""The answer of `GET /api/status`: the state of a process for owners."""

import os
import platform
import time
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.journal.journal import Journal
from action_assistant.safe_text import hold_names
from action_assistant.system import posix
from action_assistant.system.posix import resource
from action_assistant.version import VERSION
from action_assistant.web.monitoring.faults import Fault
from action_assistant.web.monitoring.readiness import Readiness
from action_assistant.web.monitoring.storage import BackupsShown, Storage
from action_assistant.web.workers.lanes import Lane

ProcessName: TypeAlias = Literal["editor", "runner"]

_BEGAN: Final = time.time()


class ProcessVersions(msgspec.Struct, frozen=True):
    """The versions of the program, of its Python, and of the tables in its database."""

    program: str
    python: str
    schema: str


class Load(msgspec.Struct, frozen=True):
    """The resources that a process uses: seconds of processor time, bytes of memory, descriptors.

    `loop_lag_s` is the largest lag of its event loop in the last minute. Null means that the system
    does not tell.
    """

    cpu_s: float
    memory: int | None
    open_files: int | None
    most_files: int
    loop_lag_s: float


class JournalState(msgspec.Struct, frozen=True):
    """The state of the journal's writer. `failing` says why the newest transaction was not stored."""

    database: str
    waiting: int
    busy_s: float
    failing: str | None


class StorageShown(msgspec.Struct, frozen=True):
    """Bytes: free space and size of the disk of the data folder, and what the database and folders
    take."""

    at: datetime
    free: int
    size: int
    database: int | None
    wal: int | None
    folders: Mapping[str, int]


class LaneState(msgspec.Struct, frozen=True):
    """A queue for worker processes: `waiting` requests without an answer, `busy` workers. `deaths`
    of workers and requests `given_up` for lack of time, both since the process began."""

    name: str
    waiting: int
    busy: int
    deaths: int
    given_up: int


class RobotLink(msgspec.Struct, frozen=True):
    """The state of the connection to a robot, and when it last answered."""

    name: str
    state: str
    why: str = ""
    heard_at: datetime | None = None

    def __post_init__(self) -> None:
        hold_names(self, "why")


class Activity(msgspec.Struct, frozen=True, kw_only=True):
    """The activity of a process: open sockets, rooms of an editor, runs and robots of a runner."""

    sockets: int
    rooms: int | None = None
    runs: int | None = None
    stops_unconfirmed: int | None = None
    robots: Sequence[RobotLink] = ()


class ProcessStatus(msgspec.Struct, frozen=True, kw_only=True):
    """The present state of one of the two processes. Only the editor knows `backups`. `faults`: what
    a person has to mend."""

    process: ProcessName
    at: datetime
    began_at: datetime
    versions: ProcessVersions
    readiness: Readiness
    load: Load
    journal: JournalState
    storage: StorageShown | None
    workers: Sequence[LaneState]
    activity: Activity
    backups: BackupsShown | None = None
    faults: Sequence[Fault] = ()


def began_at() -> datetime:
    """Return the time when this process began."""
    return datetime.fromtimestamp(_BEGAN, UTC)


def load_now(loop_lag_s: float) -> Load:
    """Return the resources that this process uses. `loop_lag_s`: the largest lag of its event loop,
    as it was measured (seconds)."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return Load(
        cpu_s=used.ru_utime + used.ru_stime,
        memory=posix.memory_in_use() or None,
        open_files=_open_files(),
        most_files=soft,
        loop_lag_s=loop_lag_s,
    )


def versions(schema: str) -> ProcessVersions:
    """Return the versions of this program, of Python and of the tables (`schema`)."""
    return ProcessVersions(VERSION, platform.python_version(), schema)


def journal_state(journal: Journal) -> JournalState:
    """Return the state of the journal's writer for the API."""
    metrics = journal.metrics
    return JournalState(journal.database_name, metrics.waiting, metrics.busy_s, metrics.failing)


def storage_shown(found: Storage | None) -> StorageShown | None:
    """Return a measurement of storage in the form for the API; None if there is none yet."""
    if found is None:
        return None
    at = datetime.fromtimestamp(found.at, UTC)
    return StorageShown(at, found.free, found.size, found.database, found.wal, found.folders)


def lane_states(lanes: Sequence[Lane]) -> list[LaneState]:
    """Return the state of each pool of worker processes."""
    return [
        LaneState(each.name, each.waiting, each.busy, each.deaths, each.given_up) for each in lanes
    ]


def _open_files() -> int | None:
    try:
        return len(os.listdir("/proc/self/fd"))  # noqa: PTH208 - counted, not visited
    except OSError:
        return None
