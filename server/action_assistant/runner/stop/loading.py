"""Actions that may still be loading: triggered, as far as anybody knows, and never seen to begin.

An engine neither counts nor shows an action that it loads, its own Stop passes it by, and no time of
waiting tells whether it will come. What can be told is who may have been triggered at all: by the arrows
of the graph, and by what was seen after the graph had left RUNNING, since from then on no end triggers
anything (`umrf.triggers`).
"""

import statistics
from collections import Counter, deque
from collections.abc import Mapping, Sequence
from typing import Final

import msgspec

from action_assistant.runner.links.observations import ACTIVE, Snapshot
from action_assistant.runner.runs.run import Run
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import ENTRY
from action_assistant.umrf.triggers import (
    LEFT,
    NEVER_BEGAN,
    SeenAfter,
    Triggers,
    may_be_loading,
    triggers_of,
)
from action_assistant.web.workers.lanes import RunInWorker

_NAMED: Final = 3
_LEARNT: Final = 20  # newest loading times of one action that are kept
_ENOUGH: Final = 3  # loading times after which a usual one is reported
_EXACT_US: Final = 2_000_000  # a begin that is known less exactly gives no loading time
_DRAINED: Final = frozenset({"FINISHED", "HALTED"})


class LoadingAction(msgspec.Struct, frozen=True):
    """One action that may be loading: the running name of its graph, its full name, and its name
    for people. `sure`: it was triggered; else that is unknown."""

    graph: str
    node: str
    name: str
    sure: bool


def read_triggers(text: str | None, sent: Sequence[str], meddled: bool) -> Triggers | None:
    """Return the arrows of a graph by which actions trigger others; None if it cannot be read.
    `text`: the graph as the engine wrote it, None if unknown; `sent`: the texts that were sent,
    changes last; `meddled`: another program may have changed the graph. Parsing is slow: call it in
    a worker process."""
    try:
        versions = [triggers_of(codec.read(each).graph, exits_known=True) for each in sent]
        if len(versions) == 1 and not meddled:
            return versions[0]
        if text is None:
            return None
        found = triggers_of(codec.read(text).graph, exits_known=False)
    except codec.Unreadable:
        return None
    if not versions and not meddled:
        return found
    in_turn = not meddled and all(each.in_turn for each in versions)
    return msgspec.structs.replace(found, once=(), barring_errors=(), in_turn=in_turn)


class LoadingWatch:
    """Collects what was seen of one graph and its sub-graphs, to decide which actions may be
    loading. `meddled`: another program may have changed the graph or started actions of it, so that
    they may have run more often than the arrows allow, and side by side."""

    def __init__(self, main: str, *, meddled: bool = False) -> None:
        self._main = main
        self._meddled = meddled
        self._sent: list[str] = []
        self._after: dict[str, tuple[int, SeenAfter]] = {}
        self._read: dict[str, Triggers | None] = {}
        self._known: set[str] = {main}  # running names
        self._age = 0  # number of calls of `forget`

    def see(self, shown: Sequence[Snapshot]) -> None:
        """Process an answer, or feedback of an engine that is alone on its name (`shown`: its
        snapshots). A sub-graph may begin again while a graph around it is RUNNING."""
        self._known.update(each.graph for each in shown)
        for each in sorted(shown, key=lambda one: len(one.graph)):
            if each.state not in LEFT:
                known = self._after.get(each.graph)
                if known is not None and (each.asked_at or 0) > known[0]:
                    del self._after[each.graph]
            elif self._is_enclosed_by_left(each.graph):
                first, seen = self._after.get(each.graph, (each.at, SeenAfter()))
                self._after[each.graph] = first, _and(seen, each)

    def sends(self, umrf: str, *, beside: bool = False) -> None:
        """Record that the graph text `umrf` is sent: at the start, or as a change. `beside`: the
        change starts an action while others run."""
        self.forget()
        self._sent.append(umrf)
        self._meddled = self._meddled or beside

    def recalls(self, umrf: str) -> None:
        """Record that `umrf`, the text of the graph, was sent before this watch began: by an
        earlier process, or before the run ended and then moved again. This changes nothing if a
        graph was sent since, or if another program may have changed it."""
        if not self._sent and not self._meddled:
            self._sent.append(umrf)
            self._read.pop(self._main, None)

    def meddle(self) -> None:
        """Record that another program may have changed or started the graph; earlier observations
        are forgotten."""
        self.forget()
        self._meddled = True

    def forget(self) -> None:
        """Forget all observations of actions that may be loading, since they prove nothing any
        more."""
        self._after.clear()
        self._read.clear()
        self._age += 1

    def unread(self, shown: Sequence[Snapshot]) -> tuple[str, ...]:
        """Return the names of the graphs whose arrows have to be read, by `read`, to decide which
        actions may be loading."""
        return tuple(
            each.graph for each in shown if _is_open(each) and each.graph not in self._read
        )

    async def read(
        self, graphs: Sequence[str], texts: Mapping[str, str], run_in_worker: RunInWorker
    ) -> None:
        """Read the arrows of these graphs in a worker, from the engine's `texts` by name, or else
        from what was sent, and store them. Raise the errors of workers."""
        for graph in graphs:
            sent = tuple(self._sent) if graph == self._main else ()
            text = texts.get(graph)
            if text is None and not sent:
                continue
            age = self._age
            found = await run_in_worker(read_triggers, text, sent, self._meddled)
            if age == self._age:
                self._read[graph] = found

    def actions(self, shown: Sequence[Snapshot]) -> tuple[LoadingAction, ...]:
        """Return the actions that may be loading. `shown`: snapshots of a graph and its sub-graphs,
        without an active action. If the arrows of a graph were not read, each of its actions that
        has not begun may be loading."""
        held = {each.graph for each in shown}
        found: list[LoadingAction] = []
        for each in shown:
            if _is_open(each):
                parts = [node for node in each.nodes if _part(each.graph, node) in held]
                known, seen = self._read.get(each.graph), self._seen(each)
                found += _named(each, known, seen, parts)
        return tuple(found)

    def _seen(self, shown: Snapshot) -> SeenAfter:
        """Return what was seen of a graph so far; nothing if this answer shows as not begun an
        action that was seen moving: then another engine, or a forgery, has shown that."""
        seen = self._after.get(shown.graph, (0, SeenAfter()))[1]
        denied = any(shown.nodes.get(each) in NEVER_BEGAN for each in seen.active)
        return SeenAfter() if denied else seen

    def _is_enclosed_by_left(self, graph: str) -> bool:
        enclosing = [each for each in self._known if graph.startswith(f"{each}__")]
        return all(each in self._after for each in (self._main, *enclosing) if each != graph)


class LoadingTimes:
    """Learns how long actions take from their trigger until they begin, by robot and action name,
    since this runner started. Only texts use it: no time proves that an action will not come.

    It learns from the first action of each run, which the start has certainly triggered.
    """

    def __init__(self) -> None:
        self._known: dict[tuple[str, str], deque[float]] = {}

    def learn(self, run: Run, sent_at: int) -> None:
        """Learn from a run whose start was sent at `sent_at`, in microseconds UTC."""
        begun = [
            (each.visits[0], node)
            for node, each in run.actions.items()
            if each.visits and not each.older
        ]
        if not begun or run.simulated or run.reshaped or run.parts:
            return
        first, node = min(begun, key=lambda each: each[0].start)
        if first.how == "observed" and first.start - first.not_before <= _EXACT_US:
            key = run.engine, node.rpartition("_")[0]
            times = self._known.setdefault(key, deque(maxlen=_LEARNT))
            times.append((first.start - sent_at) / 1e6)

    def usual(self, robot: str, actions: Sequence[LoadingAction]) -> str:
        """Return in words how long one action usually loads on this robot; "" for several actions,
        or if too few begins were seen."""
        nodes = {each.node.rpartition("_")[0] for each in actions}
        times = self._known.get((robot, nodes.pop()), ()) if len(nodes) == 1 else ()
        if len(times) < _ENOUGH:
            return ""
        usual = statistics.median(times)
        return f"usually {usual:.0f} s" if usual >= 1 else "usually less than 1 s"


def in_words(actions: Sequence[LoadingAction]) -> str:
    """Return one sentence, without its full stop, that says which actions are or may be loading; ""
    for none."""
    if not actions:
        return ""
    names = list(dict.fromkeys(each.name for each in actions))
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    who, one = f"{', '.join(names[:_NAMED])}{more}", len(names) == 1
    if all(each.sure for each in actions):
        return (
            f"{who} {'is' if one else 'are'} still loading; {'it' if one else 'they'} can begin to move "
            f"the robot as soon as {'it has' if one else 'they have'} loaded"
        )
    return (
        f"{who} may still be loading, since nothing shows whether {'it was' if one else 'they were'} "
        f"triggered; {'it' if one else 'they'} can begin to move the robot as soon as "
        f"{'it has' if one else 'they have'} loaded"
    )


def _is_open(shown: Snapshot) -> bool:
    """Return whether a graph has begun and some action of it has not."""
    return shown.state not in NEVER_BEGAN and not NEVER_BEGAN.isdisjoint(shown.nodes.values())


def _and(seen: SeenAfter, shown: Snapshot) -> SeenAfter:
    """Return the observations `seen` with one more snapshot. Only an answer counts for the end of a
    graph, since any program may publish feedback."""
    has_ended = shown.source == "get" and shown.state in _DRAINED
    return SeenAfter(
        active=seen.active.union(node for node, state in shown.nodes.items() if state in ACTIVE),
        idle=seen.idle.union(node for node, state in shown.nodes.items() if state in NEVER_BEGAN),
        drained=seen.drained or has_ended,
    )


def _named(
    shown: Snapshot,
    known: Triggers | None,
    seen: SeenAfter,
    parts: Sequence[str],
) -> list[LoadingAction]:
    if known is None:  # any action that has not begun may have been triggered
        names = tuple(node for node, state in shown.nodes.items() if state in NEVER_BEGAN)
        first: set[str] = set()
    else:
        names = may_be_loading(known, shown.state, shown.nodes, seen, parts=parts)
        first = {each.child for each in known.arrows if each.parent == ENTRY}
        first -= {each.child for each in known.arrows if each.parent != ENTRY and each.required}
    alike = Counter(node.rpartition("_")[0] for node in shown.nodes)
    return [
        LoadingAction(
            shown.graph,
            node,
            bare if alike[bare := node.rpartition("_")[0]] == 1 else node,
            node in first or shown.nodes[node] == "INITIALIZED",
        )
        for node in names
    ]


def _part(graph: str, node: str) -> str:
    name, _, number = node.rpartition("_")
    return f"{graph}__{name}__{number}"
