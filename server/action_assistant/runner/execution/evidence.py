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
    """Return the snapshots of feedback, oldest first, that are newer than what an answer has shown.

    The engine sends what happened in the last half second, and an answer may have told the end of that
    already: the older states would look like further visits that never were. In a loop a state that looks
    older may be a new lap; it is left for the next answer to tell.
    """
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
    """Return whether no action in a snapshot is further than it is known to be, and one is less far."""
    less = False
    for node, state in shown.nodes.items():
        action = run.actions.get(key_of(run, shown.graph, node))
        there, here = FAR.get(action.state if action else "", 0), FAR.get(state, 0)
        if here > there:
            return False
        less = less or here < there
    return less


class LastLook(NamedTuple):
    """The time of one answer: when it came, and when it had been asked for (µs UTC); None where there was
    no answer."""

    at: int | None = None
    asked: int | None = None


class SubGraphs:
    """Tells, look by look, which sub-graphs of an answer belong to a run.

    Sub-graphs carry no mark, and outlast their run: one runs as `GRAPH__NAME__ID`, for the node `NAME_ID`
    of the graph GRAPH, and keeps that name until the node begins again, which puts another one in its
    place. A look at a sub-graph of which it is not known whose it is proves nothing, so it is no proof
    either that its actions had not begun by then.
    """

    def __init__(self) -> None:
        self._begun: set[str] = set()  # sub-graphs whose node was seen begun in an earlier look
        self._last = LastLook()  # the newest look so far
        self._passed_over: dict[
            str, LastLook
        ] = {}  # the newest look before those that were left out

    def ours(self, own: Snapshot, parts: Sequence[Snapshot]) -> list[Snapshot]:
        """Return those of `parts` that this run has begun, outer ones first. The others count where it is
        asked whether anything moves; they are no part of the run's history."""
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
        """Return the newest look that proves anything of a part that is noted now; `usual` is the one that
        proves something of the whole run."""
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
    """Return the `difference` between the text that was sent and the one that an engine wrote. For
    workers."""
    return difference(codec.read(sent).graph, text)


def difference(sent: Graph, text: str) -> str:
    """Return in words how a graph as an engine wrote it differs from the one that was sent; "" when it is
    the same. See docs/umrf-and-the-engine.md 1.4."""
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
