"""Doubts: facts after which nothing that waits for a robot is started before a person has looked. Pure."""

from collections.abc import Iterator
from typing import Literal, TypeAlias

import msgspec

from action_assistant.runner.runs.author import Author
from action_assistant.runner.runs.run import Run

#: Why something that waits is closed: every run was carried out; a person closed it; a Stop; a run that
#: did not end true; a robot was lost; a baton changed; a person said that they looked; a robot moved
#: after its end; a start was refused; the runner was started again.
ClosedWhy: TypeAlias = Literal[
    "complete",
    "person",
    "stop",
    "run",
    "lost",
    "baton",
    "looked",
    "moves",
    "refused",
    "restart",
]


class Doubt(msgspec.Struct, frozen=True):
    """A fact that closes what waits. `by`: the person who caused it; `run`: the run that it is about."""

    why: ClosedWhy
    text: str
    by: Author | None = None
    run: str = ""


def doubts_in(run: Run) -> Iterator[Doubt]:
    """Yield the facts about a run that close what waits for its robots."""
    number = f"Run {run.number}"
    if run.desired == "stopped":
        who = (run.stopped_by.name if run.stopped_by is not None else "") or "Somebody"
        yield Doubt("stop", f"{who} pressed Stop of run {run.number}.", run.stopped_by, run.id)
    if run.lost:
        yield Doubt("lost", f"{number} was lost. {run.lost}", run=run.id)
    if run.at_rest is not None:
        who = (run.at_rest.by.name if run.at_rest.by is not None else "") or "Somebody"
        text = f"{who} looked at the robot after run {run.number}."
        yield Doubt("looked", text, run.at_rest.by, run.id)
    if run.moves_again_at is not None:
        yield Doubt("moves", f"{number} moved again after its end.", run=run.id)
    if run.end is not None and not run.ended_true:
        result = f", {run.result.removeprefix('on_')}" if run.result else ""
        yield Doubt("run", f"{number} did not end true: {run.end}{result}.", run=run.id)
