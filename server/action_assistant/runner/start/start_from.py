"""Starts that do not begin at the entry: the graph that they play, and what the look says of them. Pure."""

from typing import Final

import msgspec

from action_assistant.errors import BadInput, Conflict
from action_assistant.runner.runs.earlier import Before, Earlier, Ending, StartFrom, newest_of
from action_assistant.runner.runs.events import Requested
from action_assistant.runner.runs.sent_graphs import tree_of
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph
from action_assistant.umrf.partial_runs import KnownOutcome, NoPart, partial_graph
from action_assistant.umrf.start_values import StartValues

_NAMED: Final = 3  # names in one sentence


class EarlierRun(msgspec.Struct, frozen=True):
    """The earlier run of a start. `first`: its first event; `ending`: how far it got."""

    first: Requested
    ending: Ending


class Beginning(msgspec.Struct, frozen=True, kw_only=True):
    """The beginning of a start. `graph`: what it plays; `earlier`: what it takes for granted; `before`: the
    course of the run that it continues; `lacks`: why it cannot begin, "" if it can; `is_part`: the
    graph is a part of the version; `levels`: the opened sub-graphs of the run that it continues."""

    graph: Graph
    earlier: Earlier
    before: Before | None = None
    lacks: str = ""
    is_part: bool = False
    levels: dict[str, tuple[str, ...]] | None = None


def beginning(
    graph: Graph, tree: str, values: StartValues, start: StartFrom, before: EarlierRun | None
) -> Beginning:
    """Return where a start begins. `graph`: the graph of the version; `tree`: its tree digest;
    `values`: the values of the start; `before`: the earlier run, if the start names one. Raise
    Conflict if that run was another version, or had other values, BadInput if there is no such
    part."""
    number = 0 if before is None else before.first.number
    if start.continues:
        if before is None:
            raise BadInput("Say which run is continued.", where={"path": "/from/run"})
        return _continued(before, tree, values)
    newest = newest_of(before.ending.before.ends) if before is not None else {}
    known = {
        name: KnownOutcome(end.outcome, end.at, end.returned.outputs)
        for name, end in newest.items()
    }
    try:
        part = partial_graph(graph, start.at, known, only=start.only)
    except NoPart as why:
        raise BadInput(str(why), where={"path": "/from/at"}) from why
    earlier = Earlier(
        number=number,
        begins=part.begins,
        assumed=part.assumed,
        values=part.values,
        skipped=part.skipped,
        ended_by=part.ended_by,
    )
    return Beginning(graph=part.graph, earlier=earlier, is_part=True)


def _continued(before: EarlierRun, tree: str, values: StartValues) -> Beginning:
    first, ending = before.first, before.ending
    if tree != (first.tree_digest or tree_of(first.digest, first.subgraphs)):
        raise Conflict(
            f"Run {first.number} was another version: only exactly that one can be continued.",
            where={"path": "/digest"},
        )
    if values != first.values:
        text = f"Run {first.number} had other values: it is continued with its own."
        raise Conflict(text, where={"path": "/values"})
    return Beginning(
        graph=codec.read(first.umrf).graph,
        earlier=Earlier(
            number=first.number,
            begins=ending.begins,
            assumed=ending.assumed,
            values=ending.values,
            skipped=first.earlier.skipped if first.earlier is not None else (),
            ended_by=first.earlier.ended_by if first.earlier is not None else (),
            under_way=ending.under_way,
        ),
        before=ending.before,
        lacks=ending.lacks,
        is_part=first.beyond,
        levels=first.levels,
    )


def beginning_text(start: StartFrom, earlier: Earlier) -> str:
    """Return in words where a start begins and what it takes for granted."""
    begins = f"{listed(earlier.begins)} begins first." if earlier.begins else "Nothing begins yet."
    if start.continues:
        known = len(earlier.assumed)
        taken = f"{known} outcome{'s' if known > 1 else ''} of it count{'' if known > 1 else 's'}."
        text = f"Continues run {earlier.number} where it ended. {begins}"
        return f"{text} {taken}" if known else text
    what = "Nothing else is played." if start.only else ""
    skipped = f"Skipped: {listed(earlier.skipped)}." if earlier.skipped else ""
    unknown = [each.action for each in earlier.assumed if not each.outcome]
    guessed = f"Taken for ended, though no run here shows it: {listed(unknown)}." if unknown else ""
    endless = [f"{each.action} (by {each.by})" for each in earlier.ended_by]
    stopped = f"Would be stopped only by what is skipped: {listed(endless)}." if endless else ""
    return " ".join(filter(None, (begins, what, skipped, guessed, stopped)))


def is_doubtful(earlier: Earlier) -> bool:
    """Return whether a start takes something for granted that no run shows."""
    return bool(earlier.ended_by) or any(not each.outcome for each in earlier.assumed)


def listed(names: tuple[str, ...] | list[str]) -> str:
    """Return names for a sentence: the first three, and how many more."""
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return f"{', '.join(names[:_NAMED])}{more}"
