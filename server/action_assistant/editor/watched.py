"""Metrics and status of the editor: rooms, sockets, acknowledgements."""

from collections.abc import Iterator

from action_assistant.editor.services import EditorServices
from action_assistant.web.monitoring.gauges import Family
from action_assistant.web.monitoring.status import Activity
from action_assistant.web.monitoring.watched import Watched


class WatchedEditor(Watched):
    """Gives the metrics and the status of an open editor."""

    def __init__(self, services: EditorServices) -> None:
        workers, self._rooms = services.workers, services.rooms
        lanes = (workers.files, workers.edits, workers.graphs)
        super().__init__(services.journal, lanes, (services.rooms.metrics,), {})

    def activity(self) -> Activity:
        """Return how many sockets and rooms are open."""
        rooms = self._rooms.open_rooms()
        return Activity(sockets=sum(len(room.members) for room in rooms), rooms=len(rooms))

    def families(self) -> Iterator[Family]:
        """Yield the metrics of rooms and their sockets."""
        now, metrics = self.activity(), self._rooms.metrics
        yield Family("rooms", "Graphs that somebody has open.", now.rooms or 0)
        yield Family("sockets", "Sockets in rooms.", now.sockets)
        yield Family("rooms_opened", "Rooms that were opened.", metrics.opened, (), "counter")
        yield Family("rooms_unloaded", "Rooms that were let go.", metrics.unloaded, (), "counter")
        yield Family(
            "updates_refused",
            "Edits that a room refused, by why.",
            {(why,): count for why, count in metrics.refused.items()},
            ("reason",),
            "counter",
        )
        yield Family(
            "sockets_closed",
            "Sockets in rooms that have ended, by close code.",
            {(str(code),): count for code, count in metrics.closed.items()},
            ("code",),
            "counter",
        )
        divergences = self._rooms.divergences
        told = "How often a page showed something else than its room."
        yield Family("divergences", f"{told} The former name of divergences_total.", divergences)
        yield Family("divergences", told, divergences, (), "counter")
