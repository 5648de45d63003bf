"""Observations folded into a run. Pure, and part of the fold of a run."""

from collections.abc import Iterable, Iterator
from typing import Final, assert_never

from msgspec.structs import replace

from action_assistant.runner.links.observations import (
    TERMINAL,
    GraphResult,
    GraphState,
    Hazard,
    NodeResult,
    NodeState,
    Seen,
    Snapshot,
)
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.visits import (
    ActionRun,
    SnapshotEvidence,
    changed,
    heard,
    resulted,
    shown,
)

#: An answer that took longer was given up.
_ASKED_US: Final = 1_000_000
#: What is known of an action of which nothing has been seen.
_UNSEEN: Final = ActionRun()


def observe(run: Run, seen: Iterable[Seen]) -> Run:
    """The run after this was seen, in this order."""
    actions = dict(run.actions)
    main = run.graph_name
    run = replace(run, actions=actions)  # nobody else has it yet: the loop fills it
    going: int | None = None  # when it was seen to go on, until that is noted: a run is large
    for item in seen:
        match item:
            case NodeState():
                name = item.node if item.graph == main else key_of(run, item.graph, item.node)
                action = actions.get(name, _UNSEEN)
                actions[name] = changed(action, item.state, item.at, item.inputs)
                if run.graph_state in TERMINAL:
                    run = _timed(run, item.at, item.at)
                elif going is None or item.at > going:
                    going = item.at
                continue
            case NodeResult():
                name = item.node if item.graph == main else key_of(run, item.graph, item.node)
                actions[name] = resulted(actions.get(name, _UNSEEN), item)
                continue
        if going is not None:
            run, going = _timed(run, going, going), None
        match item:
            case GraphState():
                run = _timed(_state_of(run, item.graph, item.state), item.at, item.at)
            case GraphResult():
                own = item.graph == run.graph_name
                run = replace(run, result=item.result) if own else run
            case Snapshot():
                known = _looked_at(run, max(run.looked.get(item.graph, 0), _before(item)))
                run = _state_of(_shown(known, actions, item), item.graph, item.state)
                run = _timed(run, item.at, _asked(item))
            case Hazard():
                pass  # the alarm that comes with it is an event of its own
            case _:
                assert_never(item)
    return run if going is None else _timed(run, going, going)


def _state_of(run: Run, graph: str, state: str) -> Run:
    if graph == run.graph_name:
        return replace(run, graph_state=state)
    return replace(run, parts=run.parts | {graph: state})


def _shown(run: Run, actions: dict[str, ActionRun], item: Snapshot) -> Run:
    """What a snapshot says of its actions. What a failure or a sub-graph may do to others counts
    first, since both may be told together."""
    own = item.graph == run.graph_name
    failed = run.failed or not own or "ERROR" in item.nodes.values()
    looked = max(run.looked.get(item.graph, 0), _before(item))
    asked = _asked(item)
    for node, state in item.nodes.items():
        name = key_of(run, item.graph, node)
        action = actions.get(name, _UNSEEN)
        sight = SnapshotEvidence(
            at=item.at,
            asked=asked,
            looked=looked,
            begun=run.requested_at,
            once=action.once and not run.reshaped and not (action.joined and failed),
            stoppable=run.stoppable or run.desired == "stopped" or not own,
            followed=item.since_asked is not None,
        )
        action = shown(action, state, sight, item.inputs.get(node))
        actions[name] = heard(action, item.messages.get(node, ()), item.at)
    if asked is not None and (item.same or names_all(run, item)):
        looked = max(looked, asked)
    return replace(run, looked=run.looked | {item.graph: looked}, failed=failed)


def _looked_at(run: Run, looked: int) -> Run:
    """Answers have shown it as it was known until now: those that were asked for since."""
    if run.over_at is not None or looked <= max(run.going_at, run.reopened_at):
        return run
    return replace(run, going_at=looked)


def _timed(run: Run, at: int, asked: int | None) -> Run:
    """Since when it is over, as far as that is seen. Only when the graph says so is it worth a look
    at every action."""
    if run.graph_state in TERMINAL and run.apparent_end is not None:
        return run if run.over_at is not None else replace(run, over_at=at)
    if run.over_at is None and (asked is None or asked <= run.going_at):
        return run
    reopened = at if asked is None else run.reopened_at
    return replace(run, over_at=None, going_at=max(run.going_at, asked or 0), reopened_at=reopened)


def names_all(run: Run, item: Snapshot) -> bool:
    """Whether a snapshot leaves out no action that is known of its graph."""
    return all(name in item.nodes for name in _known_of(run, item.graph))


def _known_of(run: Run, graph: str) -> Iterator[str]:
    own, prefix = graph == run.graph_name, f"{graph}/"
    for name in run.actions:
        if "/" not in name if own else name.startswith(prefix):
            yield name if own else name.removeprefix(prefix)


def key_of(run: Run, graph: str, node: str) -> str:
    """The name of an action in a run: nodes of sub-graphs stand behind the name of theirs."""
    return node if graph == run.graph_name else f"{graph}/{node}"


def _asked(item: Snapshot) -> int | None:
    """Not before when an answer shows things; None for feedback, which may be of any age."""
    if item.source == "feedback":
        return None
    return item.asked_at if item.asked_at is not None else item.at - _ASKED_US


def _before(item: Snapshot) -> int:
    """When the answer before this was asked for; older streams have only when it came."""
    if item.since_asked is not None:
        return item.since_asked
    return 0 if item.since is None else item.since - _ASKED_US
