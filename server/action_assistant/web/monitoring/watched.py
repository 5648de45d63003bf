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
    """An open process: its journal, its workers (the last lane counts what is in `folders`), what counts
    by itself; and what is looked up."""

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
        """Return the metrics that are looked up when somebody asks."""
        raise NotImplementedError

    def activity(self) -> Activity:
        """Return the present activity of the process."""
        raise NotImplementedError

    async def parts(self) -> Parts:
        """Return what has to work beside journal and disk."""
        return {}
