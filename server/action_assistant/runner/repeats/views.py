"""Repeats as people are shown them: the order, and the run of each cell."""

from collections.abc import Iterable
from datetime import datetime
from typing import Any, Literal, TypeAlias

import msgspec

from action_assistant.runner.repeats.repeat import Axis, Repeat
from action_assistant.runner.repeats.tables import has_parquet
from action_assistant.runner.runs.doubts import ClosedWhy
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.sight import RunGraphs
from action_assistant.runner.runs.views import Listed, time
from action_assistant.safe_text import hold_names
from action_assistant.umrf.start_values import StartValues

#: `running`: a run goes on; `waiting`: for the word of a person that all is set back, which starts the
#: next run; `between`: the simulator is about to start the next one; `closed`: nothing more is started.
RepeatState: TypeAlias = Literal["running", "waiting", "between", "closed"]


class ClosedShown(msgspec.Struct, frozen=True, kw_only=True):
    """The reason why a repeat is closed, in words; `by`: the person who caused it, `run`: the run that did."""

    why: ClosedWhy
    text: str
    at: datetime
    by: Author | None
    run: str | None

    def __post_init__(self) -> None:
        hold_names(self, "text")


class RepeatSummary(msgspec.Struct, frozen=True, kw_only=True):
    """A repeat as lists show it. `robots`: those that may move, none in the simulator; `total`: how many
    runs it has; `closings`: how often it was closed; `reopened_by`: who opened it again last."""

    id: str
    graph: str | None
    graph_name: str
    version: str
    digest: str
    engine: str
    robots: tuple[str, ...]
    author: Author
    opened_at: datetime
    times: int
    grid: tuple[Axis, ...]
    seed: int | None
    by_itself: bool
    total: int
    closed: ClosedShown | None
    closings: int
    reopened_by: Author | None
    reopened_at: datetime | None


class Cell(msgspec.Struct, frozen=True, kw_only=True):
    """A cell of a repeat, with its run; null until it is started."""

    cell: int
    values: StartValues
    run: Listed | None


class RepeatShown(RepeatSummary, frozen=True, kw_only=True):
    """A repeat with its cells. `next`: the number of the cell that is started next, null after the last;
    `finished`: how many runs finished; robots report no results, so that nothing else may be known;
    `parquet`: the runner can write its table as Parquet."""

    state: RepeatState
    next: int | None
    finished: int
    cells: list[Cell]
    parquet: bool


def graphs_of(repeat: Repeat) -> RunGraphs:
    """Return the facts about a repeat that decide who may see it, as of its runs."""
    opened = repeat.opened
    graphs = dict.fromkeys([opened.graph, *opened.inside])
    return RunGraphs(opened.author.id, tuple(each for each in graphs if each), opened.unsighted)


def summary_of(repeat: Repeat) -> RepeatSummary:
    """Return the summary of a repeat."""
    return RepeatSummary(**_fields(repeat))


def _fields(repeat: Repeat) -> dict[str, Any]:
    opened, closed, again = repeat.opened, repeat.closed, repeat.reopened
    shown = None
    if closed is not None:
        shown = ClosedShown(
            why=closed.why,
            text=closed.text,
            at=time(closed.at),
            by=closed.by,
            run=closed.run or None,
        )
    return {
        "id": opened.repeat,
        "graph": opened.graph,
        "graph_name": opened.graph_name,
        "version": opened.version,
        "digest": opened.digest,
        "engine": opened.engine,
        "robots": opened.robots,
        "author": opened.author,
        "opened_at": time(opened.at),
        "times": opened.times,
        "grid": opened.grid,
        "seed": opened.seed,
        "by_itself": opened.by_itself,
        "total": len(opened.cells),
        "closed": shown,
        "closings": repeat.closings,
        "reopened_by": None if again is None else again.author,
        "reopened_at": None if again is None else time(again.at),
    }


def view_of(repeat: Repeat, runs: Iterable[Listed]) -> RepeatShown:
    """Return a repeat with its cells. `runs`: all that name it."""
    by_cell = {
        each.repeat.cell: each for each in runs if not isinstance(each.repeat, msgspec.UnsetType)
    }
    cells = [
        Cell(cell=number, values=values, run=by_cell.get(number))
        for number, values in enumerate(repeat.opened.cells, 1)
    ]
    next_ = next((each.cell for each in cells if each.run is None), None)
    going = any(each.ended_at is None for each in by_cell.values())
    state: RepeatState = "between" if repeat.opened.by_itself else "waiting"
    if going:
        state = "running"
    elif repeat.closed is not None:
        state = "closed"
    return RepeatShown(
        **_fields(repeat),
        state=state,
        next=next_,
        finished=sum(each.state == "finished" for each in by_cell.values()),
        cells=cells,
        parquet=has_parquet(),
    )
