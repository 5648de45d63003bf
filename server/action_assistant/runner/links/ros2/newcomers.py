"""Newcomers: nodes that hear starts and may be an engine that does not serve its get yet. Pure.

An engine subscribes to starts first and serves its get last. In between, and for as long as discovery
takes to show the service, a second engine of a path looks like somebody who merely listens. It may
have taken up a start all the same, and the answers of the first engine say nothing of that.
"""

from collections.abc import Callable
from typing import Final

from action_assistant.runner.links.ros2.ros_values import Endpoint

_WATCHED_S: Final = 10.0
#: The name that the middleware gives a node whose name it does not know yet.
_NAMELESS: Final = "_NODE_NAME_UNKNOWN_"


class Newcomers:
    """Decides which listeners to starts may be a second engine of one path.

    A listener is certainly no engine if its process does what a starting engine does not do
    (`others`). A listener with another node name than the engine's is also dismissed if an engine
    serves the path and the listener has served no get for 10 s. One with the engine's node name, or
    without a known name, is never dismissed, since an engine may take any time to start. Names
    count only while an engine with a known name serves, so they are judged again each time.
    """

    def __init__(self) -> None:
        self._since: dict[str, float] = {}  # when a listener was first seen, by its gid
        self._known: set[str] = set()  # gids of listeners that are something else

    def among(
        self,
        listeners: tuple[Endpoint, ...],
        servers: tuple[Endpoint, ...],
        others: Callable[[], frozenset[str]],
        at: float,
    ) -> tuple[str, ...]:
        """Return the sorted names of those nodes that may be a second engine of a path, as the
        class describes. `listeners`: all that receive starts on this path. `servers`: the engines
        that serve the get of this path; they are not returned. `others`: returns the processes that
        serve another path, publish starts or receive feedback, which a starting engine does not do;
        their nodes are not returned either. It is called only if there is a listener that was not
        dismissed before. `at`: now, in seconds of a monotonic clock."""
        present = {each.gid for each in listeners}
        self._known &= present
        self._since = {gid: since for gid, since in self._since.items() if gid in present}
        serving = {each.process for each in servers}
        unknown = [
            each
            for each in listeners
            if each.process not in serving and each.gid not in self._known
        ]
        if not unknown:
            return ()
        serving_names = {_name(each) for each in servers}
        knows = bool(servers) and _NAMELESS not in serving_names
        engines = serving_names | {_NAMELESS}
        elsewhere, found = others(), set[str]()
        for each in unknown:
            age = at - self._since.setdefault(each.gid, at)
            is_stranger = knows and _name(each) not in engines and age >= _WATCHED_S
            if each.process in elsewhere:
                self._known.add(each.gid)
            elif not is_stranger:
                found.add(_name(each))
        return tuple(sorted(found))


def _name(end: Endpoint) -> str:
    return end.logger.rpartition(".")[2]
