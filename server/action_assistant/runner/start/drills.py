"""Stop drills: the runner takes from a run that was stopped how long the proof took, and a person says
what they saw."""

from typing import Annotated, Final

import msgspec

from action_assistant.errors import Conflict
from action_assistant.runner.robots.rights import Drilled
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.run import Run

_DAY_US: Final = 86_400_000_000
#: Microseconds after which a Stop without a proof makes a failed drill, although its run is still open.
_PATIENCE_US: Final = 10_000_000
#: Ends of a run that was stopped; in another one it had come to its end by itself.
_BY_STOP: Final = frozenset({"stopped", "halted"})


class DrillRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Records a Stop drill with a run on the robot. `saw_it_stop`: the person saw the robot stop;
    `hardware_stop`: they tried its hardware stop."""

    run: Annotated[str, msgspec.Meta(min_length=1, max_length=100)]
    saw_it_stop: bool
    hardware_stop: bool


def drill_of(run: Run, robot: str, asked: DrillRequest, author: Author, now_us: int) -> Drilled:
    """Return the drill of a robot that a run shows. `now_us`: microseconds UTC. Raise Conflict if it
    shows none: it was elsewhere, led or simulated, had no Stop, came to its end by itself, nothing
    was seen moving, the Stop is older than a day, or its proof may still come."""
    name, stopped_at = f"Run {run.number}", run.stop_requested_at
    if run.simulated or run.led is not None or run.piece is not None or run.engine != robot:
        raise _no_drill(f"{name} was not on {robot} alone.")
    if stopped_at is None:
        raise _no_drill(f"Nobody has pressed Stop in run {run.number}.")
    if stopped_at > now_us or (run.proof_at is not None and run.proof_at < stopped_at):
        raise _no_drill(
            f"The clock has jumped since the Stop of run {run.number}: make another drill."
        )
    if now_us - stopped_at > _DAY_US:
        raise _no_drill(f"The Stop of run {run.number} is older than a day: make another drill.")
    if run.proof_at is None:
        is_given_up = run.end is not None or bool(run.unconfirmed or run.lost)
        if not is_given_up and now_us - stopped_at < _PATIENCE_US:
            raise _no_drill(f"The Stop of run {run.number} may still be proven. Wait some seconds.")
    elif run.end not in _BY_STOP:
        raise _no_drill(f"{name} came to its end by itself; it is {run.state}. Make another drill.")
    elif not any(each.kind == "stop" and each.active for each in run.interventions):
        raise _no_drill(
            f"Nothing was seen moving on {robot} when Stop was pressed in run {run.number}. Make another "
            "drill, with a graph that moves it for longer."
        )
    return Drilled(
        at=now_us,
        author=author,
        run=run.id,
        number=run.number,
        stopped_at=stopped_at,
        proof_us=None if run.proof_at is None else run.proof_at - stopped_at,
        saw_it_stop=asked.saw_it_stop,
        hardware_stop=asked.hardware_stop,
    )


def _no_drill(why: str) -> Conflict:
    return Conflict(why, where={"path": "/run"})
