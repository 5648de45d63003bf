"""Many runs of one graph at once: how often it succeeds, how long actions take, what never happens."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import msgspec
from sqlalchemy import Row, Select, select, union_all

from action_assistant.journal.tables import action_sum, run
from action_assistant.umrf.model import EXIT, PRECONDITIONS, Graph

_OUTCOMES: Final = ("true", "false", "error", "stopped")


class RunPoint(msgspec.Struct, frozen=True):
    """One run in a row of runs. `took` in seconds, None when it has no end that was seen."""

    id: str
    number: int
    state: str
    result: str | None
    took: float | None


class ActionStatistics(msgspec.Struct, frozen=True, kw_only=True):
    """One action over all these runs. Durations are seconds over `timed` visits, those whose both
    ends were seen."""

    action: str
    aid: str | None
    runs: int
    visits: int
    results: dict[str, int]
    inferred: int
    timed: int
    p50: float | None
    p90: float | None
    p99: float | None
    longest: float | None


class NeverTaken(msgspec.Struct, frozen=True):
    """An arrow whose parent ran, but never ended as the arrow waits for (`outcomes`)."""

    parent: str
    child: str
    outcomes: list[str]


class Statistics(msgspec.Struct, frozen=True, kw_only=True):
    """What the newest `runs` of a graph have in common. `succeeded` are those that finished true,
    `judged` those whose end says anything about the graph: neither refused, lost nor stopped."""

    runs: list[RunPoint]
    judged: int
    succeeded: int
    actions: list[ActionStatistics]
    never_taken: list[NeverTaken]


def runs_of(graph: str, engine: str | None, last: int) -> Select[Any]:
    """The newest runs of a graph (id or name) that are over."""
    newest = [
        select(run.c.id)
        .where(column == graph, run.c.ended_at.is_not(None))
        .where(*([] if engine is None else [run.c.engine == engine]))
        .order_by(run.c.number.desc())
        .limit(last)
        .subquery()
        for column in (run.c.graph, run.c.graph_name)
    ]
    wanted = (run.c.id, run.c.number, run.c.state, run.c.result, run.c.started_at, run.c.ended_at)
    named = union_all(*(select(each) for each in newest))
    return select(*wanted).where(run.c.id.in_(named)).order_by(run.c.number.desc()).limit(last)


def sums_of(runs: Sequence[str]) -> Select[Any]:
    """The sums of these runs' actions."""
    return select(action_sum).where(action_sum.c.run.in_(runs))


def statistics(
    runs: Sequence[Row[Any]], sums: Iterable[Row[Any]], newest: Graph | None
) -> Statistics:
    """Put it together. `newest` is the graph of the newest run, for its arrows."""
    judged = [row for row in runs if row.state in {"finished", "error", "halted"}]
    by_action: dict[str, list[Row[Any]]] = {}
    for row in sums:
        by_action.setdefault(row.action, []).append(row)
    actions = [_action(name, rows) for name, rows in sorted(by_action.items())]
    return Statistics(
        runs=[_point(row) for row in runs],
        judged=len(judged),
        succeeded=sum(row.result == "on_true" and row.state == "finished" for row in judged),
        actions=actions,
        never_taken=_never_taken(newest, {each.action: each for each in actions}),
    )


def _point(row: Row[Any]) -> RunPoint:
    known = row.started_at is not None and row.state not in {"lost", "refused"}
    took = (row.ended_at - row.started_at) / 1e6 if known else None
    return RunPoint(row.id, row.number, row.state, row.result, took)


def _action(name: str, rows: Sequence[Row[Any]]) -> ActionStatistics:
    took = sorted(each / 1e6 for row in rows for each in row.took)
    results = {
        outcome: total
        for outcome in _OUTCOMES
        if (total := sum(row.results.get(outcome, 0) for row in rows))
    }
    return ActionStatistics(
        action=name,
        aid=next((row.aid for row in rows if row.aid), None),
        runs=sum(row.visits > 0 for row in rows),
        visits=sum(row.visits for row in rows),
        results=results,
        inferred=sum(row.inferred for row in rows),
        timed=len(took),
        p50=percentile(took, 0.5),
        p90=percentile(took, 0.9),
        p99=percentile(took, 0.99),
        longest=took[-1] if took else None,
    )


def percentile(ordered: Sequence[float], share: float) -> float | None:
    """The smallest value that at least `share` of them do not exceed."""
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)] if ordered else None


def _never_taken(graph: Graph | None, actions: Mapping[str, ActionStatistics]) -> list[NeverTaken]:
    if graph is None:
        return []
    names = {each.key: each.full_name for each in graph.actions} | {EXIT: EXIT}
    found: list[NeverTaken] = []
    for arrow in graph.relations:
        parent = actions.get(names.get(arrow.parent, ""))
        if parent is None or parent.visits == 0 or arrow.child not in names:
            continue
        live = [each for each in PRECONDITIONS if arrow.conditions.answer(each) != "ignore"]
        outcomes = [each.removeprefix("on_") for each in live]
        if outcomes and not any(parent.results.get(each) for each in outcomes):
            found.append(NeverTaken(parent.action, names[arrow.child], outcomes))
    return found
