"""Puts together the metrics, the readiness and the status of one process, with the lag of its event loop."""

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator, Mapping, Sequence
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import anyio
from prometheus_client import (
    CollectorRegistry,
    Histogram,
    Metric,
    ProcessCollector,
    disable_created_metrics,
)
from prometheus_client.exposition import generate_latest
from prometheus_client.registry import Collector

from action_assistant.journal.journal import Journal
from action_assistant.journal.migrate import revisions_of
from action_assistant.version import VERSION
from action_assistant.web.http.requests import RequestCounts
from action_assistant.web.monitoring.faults import FaultWatch, watch_of
from action_assistant.web.monitoring.gauges import Family, Looked
from action_assistant.web.monitoring.readiness import Check, DiskCheck, Parts, Readiness
from action_assistant.web.monitoring.status import (
    Activity,
    ProcessName,
    ProcessStatus,
    began_at,
    journal_state,
    lane_states,
    load_now,
    storage_shown,
    versions,
)
from action_assistant.web.monitoring.storage import StorageWatch, backups_shown
from action_assistant.web.notifications.receivers import Receiver
from action_assistant.web.workers.lanes import Lane

_TICK_S: Final = 0.25
_REMEMBERED: Final = 240  # measurements: a minute
_BUCKETS: Final = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10)


class Watched:
    """The parts of an open process that monitoring reads: its journal, its workers (the last lane
    counts `folders`), its own metrics, and the receivers of its messages."""

    def __init__(
        self,
        journal: Journal,
        lanes: Sequence[Lane],
        collectors: Sequence[Collector],
        folders: Mapping[str, Path],
        receivers: Sequence[Receiver] = (),
    ) -> None:
        self.journal: Final = journal
        self.lanes: Final = lanes
        self.collectors: Final = collectors
        self.folders: Final = folders
        self.receivers: Final = receivers

    def families(self) -> Iterator[Family]:
        """Yield the metrics that are computed at each request of them. A subclass implements this."""
        raise NotImplementedError

    def activity(self) -> Activity:
        """Return the present activity of the process. A subclass implements this."""
        raise NotImplementedError

    async def parts(self) -> Parts:
        """Return the state of the other parts that have to work, beside journal and disk: the fault
        by name of the part, None where it works."""
        return {}


class LoopLag(Collector):
    """Sleeps for a while again and again, and notes how much later it woke up."""

    def __init__(self) -> None:
        self._last: deque[float] = deque(maxlen=_REMEMBERED)
        self._lag = Histogram(
            "action_assistant_loop_lag_seconds",
            "How much later than asked for the event loop did something, looked at each 0.25 s.",
            registry=None,
            buckets=_BUCKETS,
        )

    async def run(self) -> None:
        """Measure the lag of the event loop until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            due = loop.time() + _TICK_S
            await asyncio.sleep(_TICK_S)
            late = max(0.0, loop.time() - due)
            self._lag.observe(late)
            self._last.append(late)

    @property
    def worst_s(self) -> float:
        """Return the worst lag of the event loop in the last minute, in seconds."""
        return max(self._last, default=0.0)

    def collect(self) -> Iterator[Metric]:
        """Yield the metrics that a Prometheus registry asks for."""
        yield from self._lag.collect()


disable_created_metrics()  # type: ignore[no-untyped-call]  # each counter and histogram would be told twice


class Monitoring:
    """Collects the metrics, readiness and status of one process. `page`: the public URL of the page,
    "" if there is none; `tls`: it listens with a certificate of its own."""

    def __init__(
        self, process: ProcessName, data: Path, *, page: str = "", tls: bool = False
    ) -> None:
        self._page = page
        self._tls = tls
        self.requests: Final = RequestCounts()
        self._process = process
        self._data = data
        self._schema = revisions_of(process)[-1]
        self._disk = DiskCheck(data)
        self._lag = LoopLag()
        self._parts: Parts = {}
        self._watched: Watched | None = None
        self._storage: StorageWatch | None = None
        self._faults: FaultWatch | None = None
        self._registry = CollectorRegistry()
        ProcessCollector(registry=self._registry)
        self._registry.register(self._lag)
        self._registry.register(Looked(self._families))

    @asynccontextmanager
    async def watching(self, watched: Watched) -> AsyncIterator[None]:
        """Return a context in which the parts of an open process are monitored."""
        self._watched = watched
        storage = self._storage = StorageWatch(
            self._data,
            watched.journal.bytes_in_use,
            watched.folders,
            watched.lanes[-1],
            backups=self._process == "editor",
        )
        faults = self._faults = watch_of(
            self._process,
            self._data,
            watched.journal,
            watched.receivers,
            page=self._page,
            tls=self._tls,
            storage=lambda: (storage.found, storage.backups),
        )
        for each in (watched.journal.metrics, *watched.collectors):
            self._registry.register(each)
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(self._lag.run)
            tasks.start_soon(storage.run)
            tasks.start_soon(faults.run)
            yield
            tasks.cancel_scope.cancel()

    # --- what is told -------------------------------------------------------------------------

    async def readiness(self) -> Readiness:
        """Return whether the process can do its work. The answer comes within seconds even if a
        part hangs."""
        if self._watched is None:
            return Readiness(ready=True)
        found: dict[str, str | None] = {}

        async def ask(check: Check) -> None:
            found.update(await check())

        async def disk() -> Parts:
            return {"disk": await self._disk.problem()}

        checks: tuple[Check, ...] = (self._watched.journal.parts, disk, self._watched.parts)
        async with anyio.create_task_group() as tasks:
            for check in checks:
                tasks.start_soon(ask, check)
        self._parts = dict(sorted(found.items()))
        return Readiness.of(self._parts)

    async def exposition(self) -> str:
        """Return all metrics in the text format of Prometheus."""
        await self.readiness()
        # Whole numbers are written as such, as they were before: programs may read them so.
        return generate_latest(self._registry).decode().replace(".0\n", "\n")

    async def status(self) -> ProcessStatus:
        """Return the state of the process for its administrators. Raise RuntimeError outside of
        `watching`."""
        watched, storage = self._watched, self._storage
        if watched is None or storage is None:
            raise RuntimeError("the process is not open yet")
        return ProcessStatus(
            process=self._process,
            at=datetime.now(UTC),
            began_at=began_at(),
            versions=versions(self._schema),
            readiness=await self.readiness(),
            load=load_now(self._lag.worst_s),
            journal=journal_state(watched.journal),
            storage=storage_shown(storage.found),
            workers=lane_states(watched.lanes),
            activity=watched.activity(),
            backups=backups_shown(storage.backups),
            faults=self._faults.found if self._faults is not None else (),
        )

    def _families(self) -> Iterator[Family]:
        labels = {(self._process, VERSION, self._schema): 1}
        yield Family("info", "What runs here.", labels, ("process", "version", "schema"))
        yield Family(
            "part_ready",
            "1 for each part that works, 0 for one that keeps the process from its work.",
            {(part,): why is None for part, why in self._parts.items()},
            ("part",),
        )
        yield Family(
            "responses",
            "Requests that were answered, by status.",
            {(str(status),): count for status, count in self.requests.answered.items()},
            ("status",),
            "counter",
        )
        yield Family(
            "requests_open",
            "Requests and WebSockets that are open.",
            {(kind,): self.requests.open[kind] for kind in ("http", "websocket")},
            ("kind",),
        )
        if self._watched is not None:
            yield from _of_lanes(self._watched.lanes)
            yield from self._watched.families()
        if self._storage is not None:
            yield from self._storage.families()


def _of_lanes(lanes: Sequence[Lane]) -> Iterator[Family]:
    def of(value: Callable[[Lane], int]) -> dict[tuple[str, ...], float]:
        return {(lane.name,): value(lane) for lane in lanes}

    label = ("lane",)
    waiting, busy = of(lambda lane: lane.waiting), of(lambda lane: lane.busy)
    deaths, given_up = of(lambda lane: lane.deaths), of(lambda lane: lane.given_up)
    yield Family("lane_waiting", "Requests to workers without an answer yet.", waiting, label)
    yield Family("lane_busy", "Workers that work on one.", busy, label)
    yield Family("worker_deaths", "Workers that died of their work.", deaths, label, "counter")
    yield Family("lane_given_up", "Requests that took too long.", given_up, label, "counter")
