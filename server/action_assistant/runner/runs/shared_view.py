"""The view of a run that a link without a name shows: each field is chosen, and none names a person,
another robot, another run or a value.

What later versions add to a run is in no such view until somebody adds it here.
"""

from datetime import datetime

import msgspec

from action_assistant.runner.runs.durations import DurationBounds
from action_assistant.runner.runs.run import Desired, Result, State
from action_assistant.runner.runs.views import (
    ActionShown,
    RobotRestShown,
    RunShown,
    RunWhole,
    VisitShown,
)
from action_assistant.umrf.json.text import UmrfGraph


class SharedState(msgspec.Struct, frozen=True, kw_only=True):
    """The state of a run, as a link shows it. `unconfirmed`: a Stop of it is not proven.
    `seen_to_rest`: a person or the runner saw that it is at rest, since no answer could prove it.
    `held_since`: since when a led run begins nothing further. `robots`: of a led run, the engine of
    each actor."""

    graph_name: str
    engine: str
    simulated: bool
    state: State
    desired: Desired
    result: Result | None
    requested_at: datetime
    started_at: datetime | None
    ended_at: datetime | None
    proof_at: datetime | None
    unknown_since: datetime | None
    moves_again_at: datetime | None
    held_since: datetime | None
    unconfirmed: bool
    seen_to_rest: bool
    took: DurationBounds | None
    recorded: bool
    robots: dict[str, str] | None
    rests: list[RobotRestShown]
    actions: dict[str, ActionShown]


class SharedRun(msgspec.Struct, frozen=True):
    """A run with the graph that was sent, as a link shows it."""

    run: SharedState
    umrf: UmrfGraph


class SharedStateMessage(msgspec.Struct, frozen=True, tag="run", tag_field="type"):
    """The present state of the run of a link."""

    run: SharedState


class SharedBeat(msgspec.Struct, frozen=True, tag="beat", tag_field="type"):
    """Sent once a second while the run goes on. `seen`: when its engine showed it last; null if it
    never did."""

    at: datetime
    seen: datetime | None


def shared_state(run: RunShown) -> SharedState:
    """Return the view of a run for a link, from that for people."""
    return SharedState(
        graph_name=run.graph_name,
        engine=run.engine,
        simulated=run.simulated,
        state=run.state,
        desired=run.desired,
        result=run.result,
        requested_at=run.requested_at,
        started_at=run.started_at,
        ended_at=run.ended_at,
        proof_at=run.proof_at,
        unknown_since=run.unknown_since,
        moves_again_at=run.moves_again_at,
        held_since=None if run.held is None else run.held.since,
        unconfirmed=run.unconfirmed is not None,
        seen_to_rest=run.at_rest is not None,
        took=run.took,
        recorded=run.recorded,
        robots=run.robots,
        rests=[]
        if run.rests is msgspec.UNSET
        else [
            RobotRestShown(each.robot, each.state, each.since, stops=each.stops)
            for each in run.rests
        ],
        actions={name: _action(each) for name, each in run.actions.items()},
    )


def shared_run(run: RunWhole) -> SharedRun:
    """Return a run with its graph for a link, from the view for people."""
    return SharedRun(shared_state(run), run.umrf)


def _action(action: ActionShown) -> ActionShown:
    return ActionShown(
        action.aid,
        action.state,
        [_visit(each) for each in action.visits],
        action.older,
        [],
        action.count,
        action.at_least,
        action.robot,
        asks=action.asks,
    )


def _visit(visit: VisitShown) -> VisitShown:
    return VisitShown(
        visit.start,
        visit.not_before,
        visit.not_after,
        visit.until,
        visit.result,
        visit.how,
        robot=visit.robot,
    )
