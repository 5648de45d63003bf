"""Finds actions in ERROR that are no proof of rest, since a stop or a pause may have caused the ERROR.

An engine waits five seconds for an action to stop, or until its `onStop` throws, and then calls it
ERROR; the thread of the action goes on, and nothing that the engine says ever tells of its end. An
action that threw by itself is called ERROR, too, and is over. What tells them apart is only whether
a stop or a pause could have reached it before.
"""

from collections.abc import Sequence

from action_assistant.runner.links.observations import Snapshot, did_not_obey, failed_in


class DoubtfulErrors:
    """Decides for the actions of one run that the engine shows in ERROR whether their code may
    still run. `reached`: a stop or a pause may have reached the graph before its first answer here.
    """

    def __init__(self, *, reached: bool) -> None:
        self._reached = reached
        self._thrown: set[tuple[str, str]] = set()
        self._open: dict[tuple[str, str], None] = {}

    def reach(self) -> None:
        """Allow, from now on, for a stop, a pause or a change that may reach the graph: an action
        in ERROR may then still run."""
        self._reached = True

    @property
    def places(self) -> frozenset[tuple[str, str]]:
        """All actions in ERROR, with or without code that may run, as pairs of the graph's running
        name and the full name."""
        return frozenset({*self._open, *self._thrown})

    @property
    def open_graphs(self) -> frozenset[str]:
        """The running names of the graphs with an action whose code may go on."""
        return frozenset(graph for graph, _ in self._open)

    def look(self, shown: Sequence[Snapshot]) -> str:
        """Process one more answer (`shown`: the snapshots of a graph and its sub-graphs); return,
        as a sentence, why the code of an action may still run, "" if nothing suggests that."""
        for each in shown:
            failed = failed_in(each)
            self._thrown -= {
                (each.graph, node) for node, state in each.nodes.items() if state != "ERROR"
            }
            for node in failed:
                self._judge(each, node)
            if each.state == "ERROR" and not any(graph == each.graph for graph, _ in self._open):
                for node in failed or [
                    each.graph
                ]:  # one of these did not stop; the engine does not say which
                    self._open[each.graph, node] = None
        if not self._open:
            return ""
        return did_not_obey([node for _, node in self._open])

    def _judge(self, shown: Snapshot, node: str) -> None:
        place = shown.graph, node
        if place in self._thrown or place in self._open:
            return
        if self._reached or node in shown.stoppable:
            self._open[place] = None
        else:
            self._thrown.add(place)
