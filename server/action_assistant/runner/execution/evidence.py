"""Compares what an engine shows with what is known of a run: which feedback is newer than an answer, which
sub-graphs are of the run, and whether the graph is the one that was sent. Pure."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

from action_assistant.runner.links.observations import ACTIVE, FAR, TERMINAL, Snapshot
from action_assistant.runner.runs.fold import is_news, key_of
from action_assistant.runner.runs.run import Run
from action_assistant.umrf.digest import digest
from action_assistant.umrf.echo import echo
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph
from action_assistant.umrf.triggers import NEVER_BEGAN


def newer_than_answers(run: Run, snapshots: Sequence[Snapshot]) -> tuple[Snapshot, ...]:
    """Return those snapshots of feedback, oldest first, that add to what the last answer showed.
    Feedback covers the last half second, so it may repeat states from before that answer, which
    would look like further visits. Where a loop makes that undecidable, the snapshot is left to the
    next answer."""
    known: dict[str, int] = {}
    for i, shown in enumerate(snapshots):
        if not is_news(run, shown):
            known[shown.graph] = i
    return tuple(
        shown
        for i, shown in enumerate(snapshots)
        if i > known.get(shown.graph, -1) and not _is_overtaken(run, shown)
    )


def _is_overtaken(run: Run, shown: Snapshot) -> bool:
    """Return whether a snapshot shows at least one action of a run less far along than already
    known, and none further along: then it is older than what is known."""
    less = False
    for node, state in shown.nodes.items():
        action = run.actions.get(key_of(run, shown.graph, node))
        there, here = FAR.get(action.state if action else "", 0), FAR.get(state, 0)
        if here > there:
            return False
        less = less or here < there
    return less


class LastLook(NamedTuple):
    """The times of one answer of an engine: when it came, and when it was requested (µs UTC); None
    without an answer."""

    at: int | None = None
    asked: int | None = None


class SubGraphs:
    """Decides for each answer which of its sub-graphs belong to a run.

    Sub-graphs carry no run id and outlast their run: one runs as `GRAPH__NAME__ID`, for the node
    `NAME_ID` of the graph GRAPH, until that node begins again and replaces it. While its owner is
    unknown, a sub-graph in an answer proves nothing, not even that its actions had not begun.
    """

    def __init__(self) -> None:
        self._begun: set[str] = set()  # sub-graphs whose node was seen begun in an earlier look
        self._last = LastLook()  # the newest look so far
        self._passed_over: dict[
            str, LastLook
        ] = {}  # the newest look before those that were left out

    def ours(self, own: Snapshot, parts: Sequence[Snapshot]) -> list[Snapshot]:
        """Return those of `parts` whose sub-graph this run has begun, outer ones first. `own`: the
        snapshot of the run's graph; `parts`: the snapshots of sub-graphs in the same answer of the
        engine.

        A sub-graph that may be left over from an earlier run is not returned, so that it does not
        get into the run's history.
        """
        held = {own.graph: own}
        for part in sorted(parts, key=lambda each: len(each.graph)):
            whose = self._whose(part, held)
            if whose == "ours":
                held[part.graph] = part
            elif whose == "unsure":
                self._passed_over.setdefault(part.graph, self._last)
            else:
                self._passed_over.pop(part.graph, None)
        self._last = LastLook(own.at, own.asked_at)
        return list(held.values())[1:]

    def last_look(self, part: str, usual: LastLook) -> LastLook:
        """Return the times of the newest earlier answer that proves anything about the sub-graph
        named `part`, and forget what was noted for it: call this once for each answer. They are
        those of `usual`, the newest one for the whole run, unless the sub-graph was not counted as
        the run's then."""
        return self._passed_over.pop(part, usual)

    def _whose(
        self, part: Snapshot, held: dict[str, Snapshot]
    ) -> Literal["ours", "others", "unsure"]:
        above, _, number = part.graph.rpartition("__")
        above, _, name = above.rpartition("__")
        while above and above not in held:  # names may contain `__`
            above, _, more = above.rpartition("__")
            name = f"{more}__{name}"
        if above not in held:
            return "unsure"
        state = held[above].nodes.get(f"{name}_{number}")
        if state is None:  # the graph around it is not held
            return "unsure"
        if state in NEVER_BEGAN:
            return "others"
        known = part.graph in self._begun
        self._begun.add(part.graph)
        is_ours = known or state not in ACTIVE or part.state not in TERMINAL
        return "ours" if is_ours else "unsure"


def differs(sent: str, text: str) -> str:
    """Return the `difference` between the graph text that was sent and the text that an engine
    wrote. Both are parsed, which is slow: call it in a worker process."""
    return difference(codec.read(sent).graph, text)


def difference(sent: Graph, text: str) -> str:
    """Return in words how the graph text that an engine wrote differs from the graph that was sent;
    "" if they mean the same. A text that cannot be read is a difference, too. See
    docs/umrf-and-the-engine.md 1.4."""
    try:
        seen = codec.read(text).graph
    except codec.Unreadable as wrong:
        return f"it cannot be read ({wrong.message})"
    ours, theirs = echo(sent, PINNED), echo(seen, PINNED)
    if digest(ours) == digest(theirs):
        return ""
    mine = {action.full_name for action in ours.actions}
    others = {action.full_name for action in theirs.actions}
    if mine != others:
        missing, more = sorted(mine - others)[:3], sorted(others - mine)[:3]
        parts = [f"it lacks {', '.join(missing)}"] if missing else []
        parts += [f"it has {', '.join(more)}, too"] if more else []
        return f"{'; '.join(parts)}."
    changed = [
        one.full_name
        for one, other in zip(ours.actions, theirs.actions, strict=True)
        if (one.name, one.inputs, one.outputs, one.actor)
        != (other.name, other.inputs, other.outputs, other.actor)
    ]
    return f"{', '.join(changed[:3])} differ." if changed else "the arrows differ."
