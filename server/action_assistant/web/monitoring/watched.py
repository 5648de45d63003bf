"""The interface by which a process gives its metrics and status once it is open."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from prometheus_client.registry import Collector

from action_assistant.journal.journal import Journal
from action_assistant.web.monitoring.gauges import Family
from action_assistant.web.monitoring.readiness import Parts
from action_assistant.web.monitoring.status import Activity
from action_assistant.web.workers.lanes import Lane


class Watched:
    """The parts of an open process that monitoring reads: its journal, its workers (the last lane
    counts `folders`), and its own metrics."""

    def __init__(
        self,
        journal: Journal,
        lanes: Sequence[Lane],
        collectors: Sequence[Collector],
        folders: Mapping[str, Path],
    ) -> None:
        self.journal: Final = journal
        self.lanes: Final = lanes
        self.collectors: Final = collectors
        self.folders: Final = folders

    def families(self) -> Iterator[Family]:
        """Yield the metrics that are computed at each request."""
        raise NotImplementedError

    def activity(self) -> Activity:
        """Return the present activity of the process."""
        raise NotImplementedError

    async def parts(self) -> Parts:
        """Return the state of the other parts that have to work, beside journal and disk."""
        return {}
