"""The results of a repeat as a table: a line for each cell, with its values and its run."""

from collections.abc import Callable
from typing import Any, Final

from action_assistant.runner.repeats.tables import Column, Kind, kind_of, named_once
from action_assistant.runner.repeats.views import RepeatShown
from action_assistant.runner.runs.views import Listed

_Facts = tuple[tuple[str, Kind, Callable[[Listed], Any]], ...]

_RUN: Final[_Facts] = (
    ("run", "string", lambda run: run.id),
    ("number", "int", lambda run: run.number),
    ("state", "string", lambda run: run.state),
    ("result", "string", lambda run: run.result),
    ("started_by", "string", lambda run: run.author.name),
    ("requested_at", "time", lambda run: run.requested_at),
    ("started_at", "time", lambda run: run.started_at),
    ("ended_at", "time", lambda run: run.ended_at),
    ("seconds_least", "seconds", lambda run: run.took and run.took.least),
    ("seconds_most", "seconds", lambda run: run.took and run.took.most),
)
_WORDS: Final[_Facts] = (
    ("detail", "string", lambda run: run.detail or None),
    ("cause", "string", lambda run: run.cause or None),
)


def columns_of(shown: RepeatShown) -> list[Column]:
    """Return the table of a repeat. A time is known between two bounds."""
    cells = shown.cells
    inputs = list(
        dict.fromkeys((a, n) for cell in cells for a in cell.values for n in cell.values[a])
    )
    given = [tuple(cell.values.get(a, {}).get(n) for cell in cells) for a, n in inputs]
    names = named_once(f"{action}.{name}" for action, name in inputs)
    return [
        Column("cell", "int", tuple(cell.cell for cell in cells)),
        *_of_runs(shown, _RUN),
        *(Column(name, kind_of(each), each) for name, each in zip(names, given, strict=True)),
        *_of_runs(shown, _WORDS),
    ]


def _of_runs(shown: RepeatShown, facts: _Facts) -> list[Column]:
    runs = [cell.run for cell in shown.cells]
    return [
        Column(name, kind, tuple(None if run is None else fact(run) for run in runs))
        for name, kind, fact in facts
    ]
