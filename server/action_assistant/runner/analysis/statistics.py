"""Statistics of many runs of one graph: how often it succeeds, how long actions take, which arrows
are never taken."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import msgspec
from sqlalchemy import Row, Select, select, union_all

from action_assistant.runner.analysis.annotations import AT_LEAST, SAID
from action_assistant.runner.analysis.levels import LevelPlace, places
from action_assistant.runner.runs.durations import DurationBounds, at_rank, duration_bounds
from action_assistant.runner.runs.queries import on_engine, seen_by
from action_assistant.runner.runs.run import Result, State
from action_assistant.runner.runs.sight import Unseen
from action_assistant.schema.runner_tables import action_sum, run
from action_assistant.umrf.model import EXIT, PRECONDITIONS, Graph, Relation

_OUTCOMES: Final = ("true", "false", "error", "stopped")


class RunPoint(msgspec.Struct, frozen=True):
    """One run of the statistics. `took`: seconds, if known exactly; `span`: its bounds, null if
    unknown."""

    id: str
    number: int
    state: State
    result: Result | None
    took: float | None
    span: DurationBounds | None


class Spans(msgspec.Struct, frozen=True, kw_only=True):
    """Percentiles of the durations of an action, each between bounds."""

    p50: DurationBounds | None
    p90: DurationBounds | None
    p99: DurationBounds | None
    longest: DurationBounds | None


class ActionStatistics(msgspec.Struct, frozen=True, kw_only=True):
    """One action over all these runs. `levels`: the actions around it, outermost first; `name`: its
    own; `action`: the name that the engine of its newest run used. Durations: seconds over the
    `timed` ended visits, null if not known exactly; `spans`: bounds of all. `unknown`: visits of
    unknown result; `said`: results that persons gave by word, which are in no other count. `at_least`: there may have been more `visits`, which nobody saw."""

    action: str
    levels: tuple[str, ...]
    name: str
    aid: str | None
    runs: int
    visits: int
    at_least: bool = False
    results: dict[str, int]
    said: dict[str, int] = {}
    unknown: int
    inferred: int
    timed: int
    p50: float | None
    p90: float | None
    p99: float | None
    longest: float | None
    spans: Spans


class NeverTaken(msgspec.Struct, frozen=True):
    """An arrow whose parent ran and certainly never ended with one of the arrow's `outcomes`."""

    parent: str
    child: str
    outcomes: list[str]


class Statistics(msgspec.Struct, frozen=True, kw_only=True):
    """Statistics of the newest `runs` of a graph. `judged`: runs whose known result says something
    about the graph (neither refused, lost nor stopped); `succeeded`: those that finished true.
    `unknown`: finished runs of unknown result, which robots do not report. `untold`: the number
    of arrows that may or may not have been taken."""

    runs: list[RunPoint]
    judged: int
    succeeded: int
    unknown: int
    actions: list[ActionStatistics]
    never_taken: list[NeverTaken]
    untold: int


def runs_of(graph: str, engine: str | None, last: int, unseen: Unseen | None = None) -> Select[Any]:
    """Select the newest runs of a graph (id or name) that are over, at most `last`. `engine`: only
    runs on it, None for any; `unseen`: only those that this person may see."""
    newest = [
        select(run.c.id)
        .where(column == graph, run.c.ended_at.is_not(None), on, seen_by(unseen))
        .order_by(run.c.number.desc())
        .limit(last)
        .subquery()
        for column in (run.c.graph, run.c.graph_name)
        for on in on_engine(engine)
    ]
    wanted = (
        *(run.c.id, run.c.number, run.c.author_id, run.c.graph, run.c.graph_name),
        *(run.c.state, run.c.result, run.c.summary),
    )
    named = union_all(*(select(each) for each in newest))
    return select(*wanted).where(run.c.id.in_(named)).order_by(run.c.number.desc()).limit(last)


def sums_of(runs: Sequence[str]) -> Select[Any]:
    """Select the stored totals of the actions of the runs with these ids."""
    return select(action_sum).where(action_sum.c.run.in_(runs))


def statistics(
    runs: Sequence[Row[Any]], sums: Iterable[Row[Any]], newest: Graph | None
) -> Statistics:
    """Compute the statistics from rows of `runs_of` and `sums_of`. `newest` is the graph of the
    newest run."""
    ended = [row for row in runs if row.state in {"finished", "error", "halted"}]
    judged = [row for row in ended if row.state != "finished" or row.result is not None]
    by_place = _by_place(runs, sums)
    actions = [_action(place, rows) for place, rows in by_place.items()]
    never, untold = _never_taken(newest, {each.name: each for each in actions if not each.levels})
    return Statistics(
        runs=[_point(row) for row in runs],
        judged=len(judged),
        succeeded=sum(row.result == "on_true" and row.state == "finished" for row in judged),
        unknown=len(ended) - len(judged),
        actions=actions,
        never_taken=never,
        untold=untold,
    )


def _point(row: Row[Any]) -> RunPoint:
    stored = row.summary.get("took")
    span = None if stored is None else DurationBounds(least=stored["least"], most=stored["most"])
    took = None if span is None else span.exact
    return RunPoint(row.id, row.number, row.state, row.result, took, span)


def _by_place(
    runs: Sequence[Row[Any]], sums: Iterable[Row[Any]]
) -> dict[LevelPlace, list[Row[Any]]]:
    """Return the totals of each action by its place in the hierarchy, the newest run first. Places
    are used because the name of the graph, which may differ, is a part of the names of inner
    actions."""
    by_run: dict[str, list[Row[Any]]] = {}
    for row in sums:
        by_run.setdefault(row.run, []).append(row)
    found: dict[LevelPlace, list[Row[Any]]] = {}
    for each in runs:
        rows = by_run.get(each.id, [])
        own = {row.action for row in rows if row.aid}
        placed = places(each.graph_name, own, [row.action for row in rows])
        for row in rows:
            found.setdefault(placed[row.action], []).append(row)
    return dict(sorted(found.items(), key=lambda item: item[0].way))


def _action(place: LevelPlace, rows: Sequence[Row[Any]]) -> ActionStatistics:
    took = [_took(each) for row in rows for each in row.took]
    spans = Spans(
        p50=at_rank(took, 0.5),
        p90=at_rank(took, 0.9),
        p99=at_rank(took, 0.99),
        longest=at_rank(took, 1),
    )
    results = {
        outcome: total
        for outcome in _OUTCOMES
        if (total := sum(row.results.get(outcome, 0) for row in rows))
    }
    said = {
        outcome: total
        for outcome in _OUTCOMES
        if (total := sum(row.results.get(SAID, {}).get(outcome, 0) for row in rows))
    }
    visits = sum(row.visits for row in rows)
    return ActionStatistics(
        action=rows[0].action,
        levels=place.levels,
        name=place.name,
        aid=next((row.aid for row in rows if row.aid), None),
        runs=sum(row.visits > 0 for row in rows),
        visits=visits,
        at_least=any(row.results.get(AT_LEAST) for row in rows),
        results=results,
        said=said,
        unknown=visits - sum(results.values()) - sum(said.values()),
        inferred=sum(row.inferred for row in rows),
        timed=len(took),
        p50=_exact(spans.p50),
        p90=_exact(spans.p90),
        p99=_exact(spans.p99),
        longest=_exact(spans.longest),
        spans=spans,
    )


def _took(stored: Any) -> DurationBounds:
    """Return the bounds of a stored duration. Older versions stored a lower bound in
    microseconds."""
    if isinstance(stored, list):
        return DurationBounds(least=stored[0], most=stored[1])
    return duration_bounds(stored, None)


def _exact(span: DurationBounds | None) -> float | None:
    return None if span is None else span.exact


def _never_taken(
    graph: Graph | None, actions: Mapping[str, ActionStatistics]
) -> tuple[list[NeverTaken], int]:
    """Return the arrows of the graph that were certainly never taken although the action before
    them has run, and the number of such arrows for which that is unknown. `actions`: the statistics
    by full name; `graph`: None for an unknown graph, which has no arrow."""
    if graph is None:
        return [], 0
    names = {each.key: each.full_name for each in graph.actions} | {EXIT: EXIT}
    found: list[NeverTaken] = []
    untold = 0
    for arrow in graph.relations:
        parent = actions.get(names.get(arrow.parent, ""))
        if parent is None or parent.visits == 0 or arrow.child not in names:
            continue
        outcomes = _outcomes(arrow)
        if not outcomes or any(
            parent.results.get(each) or parent.said.get(each) for each in outcomes
        ):
            continue
        if parent.unknown == 0 and not parent.at_least:
            found.append(NeverTaken(parent.action, names[arrow.child], outcomes))
        elif not _must_have_been(arrow, graph, actions.get(names[arrow.child])):
            untold += 1
    return found, untold


def _outcomes(arrow: Relation) -> list[str]:
    live = [each for each in PRECONDITIONS if arrow.conditions.answer(each) != "ignore"]
    return [each.removeprefix("on_") for each in live]


def _must_have_been(arrow: Relation, graph: Graph, child: ActionStatistics | None) -> bool:
    """Return whether an arrow must have been taken: its child has run (`child`: its statistics,
    None if there is none), and no other arrow of the graph leads there."""
    ways = [each for each in graph.relations if each.child == arrow.child and _outcomes(each)]
    return child is not None and child.visits > 0 and len(ways) == 1
