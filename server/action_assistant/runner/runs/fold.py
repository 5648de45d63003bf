"""The fold of the events of a run: the value of a run after each event.

The same function serves the live view and the history, so both always show the same. Nothing here
knows a clock, a link or a database.
"""

from collections.abc import Callable, Iterable, Iterator
from itertools import chain, groupby
from operator import attrgetter
from typing import Final, Literal, TypeVar, assert_never

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
from action_assistant.runner.links.parameter_texts import shortened
from action_assistant.runner.runs.events import (
    AlarmRaised,
    Answered,
    BreakpointsSet,
    Ended,
    EndHow,
    EngineSaid,
    HandedOver,
    Held,
    Loading,
    ModifyRefused,
    ModifyRequested,
    MovesAgain,
    Observed,
    PauseRequested,
    PieceBegan,
    PieceEnded,
    PieceRest,
    PieceSeen,
    PieceWaits,
    PlayBegan,
    Proof,
    Published,
    Released,
    Requested,
    ResumeRequested,
    RunEvent,
    Silent,
    StopRequested,
    StopSent,
    Unconfirmed,
    Unknown,
)
from action_assistant.runner.runs.question_events import (
    AnswerRefused,
    PauseBegan,
    QuestionAnswered,
    QuestionAsked,
    QuestionClosed,
)
from action_assistant.runner.runs.question_fold import after_question, with_press
from action_assistant.runner.runs.run import (
    Alarm,
    Intervention,
    Run,
    Said,
    go_on_press,
    outcome_press,
    step_press,
    wait_press,
)
from action_assistant.runner.runs.sight import graphs_inside
from action_assistant.runner.runs.visits import (
    KEPT,
    ActionRun,
    Message,
    SnapshotEvidence,
    after_outcome,
    after_piece,
    after_result,
    after_snapshot,
    after_transition,
    awaits_answer,
    is_heard,
    with_messages,
    with_possible_pause,
)
from action_assistant.umrf.files import codec
from action_assistant.umrf.kept_values import NOTHING_KEPT
from action_assistant.umrf.laps import Laps, laps

T = TypeVar("T")

_SEEN: Final[Callable[[RunEvent], tuple[Seen, ...]]] = attrgetter("seen")  # of `Observed` events
#: Microseconds after which a get is given up: an answer was asked for at most so long before it came.
_ASKED_US: Final = 1_000_000
#: Fields that a run has from its request, under the same names.
_AS_REQUESTED: Final = set(Run.__struct_fields__) & set(Requested.__struct_fields__) - {"actions"}
#: How the outcome of an action is known that no robot carries out.
_OF_NO_ROBOT: Final[frozenset[EndHow]] = frozenset({"answer", "deadline", "time", "fault"})
#: The state of an action of which nothing has been seen.
_UNSEEN: Final = ActionRun()


def replay(events: Iterable[RunEvent], run: Run | None = None) -> Run | None:
    """Fold events in order, going on from `run`, and return the run after the last one; None if
    there was no `Requested` event. Consecutive `Observed` events are folded in one go, since each
    fold of observations copies all actions."""
    for kind, row in groupby(events, key=type):
        if run is not None and run.end is None and kind is Observed:
            run = observe(run, chain.from_iterable(map(_SEEN, row)))
            continue
        for event in row:
            if run is not None:
                run = follow(run, event)
            elif isinstance(event, Requested):
                run = begin(event)
    return run


def begin(event: Requested) -> Run:
    """Return the run after its first event, the accepted start."""
    known = event.laps if event.laps is not None else _laps(event.umrf)
    players = event.led.players if event.led is not None else {}
    asked = event.led.asked if event.led is not None else {}
    players = players | {name: each.by for name, each in asked.items()}
    once, joined = frozenset(known.once), frozenset(known.barring_errors)
    levels = event.levels or {}
    return Run(
        **{name: getattr(event, name) for name in _AS_REQUESTED},
        id=event.run,
        requested_at=event.at,
        actions={
            name: ActionRun(
                aid=aid,
                once=name in once,
                joined=name in joined,
                robot=players.get(name, ""),
                levels=levels.get(name, ()),
            )
            for name, aid in event.actions.items()
        },
        inner=event.inner_laps,
        inside=graphs_inside(event.sight, event.subgraphs),
        needs=known.needs,
        stoppable=known.stops,
    )


def _laps(umrf: str) -> Laps:
    """Derive from the graph text which actions run only once, for old runs that did not store this."""
    try:
        return laps(codec.read(umrf.encode()).graph)
    except codec.Unreadable:
        return Laps(stops=True)


def follow(run: Run, event: RunEvent) -> Run:
    """Return the run after one more event. Every event that can be decoded is accepted."""
    if run.end is not None and not isinstance(event, AlarmRaised | MovesAgain):
        return run
    match event:
        case Published():
            return replace(
                run, incarnation=event.incarnation, started_at=event.at, process=event.process
            )
        case Observed():
            return observe(run, event.seen)
        case PauseRequested() | ResumeRequested() | StopRequested():
            return _desired(run, event)
        case ModifyRequested():
            return _modified(run, event)
        case ModifyRefused():
            return _unmodified(run, event)
        case StopSent():
            return replace(run, stops_sent=run.stops_sent + (0 if event.failed else 1))
        case Proof():
            return replace(run, proof_at=event.at)
        case Silent():
            return replace(run, unknown_since=event.since)
        case Answered():
            return replace(run, unknown_since=None, lost="")
        case AlarmRaised():
            return _alarmed(run, event)
        case MovesAgain():
            return _reopen(run, event)
        case EngineSaid():
            return replace(run, log=(*run.log, Message(event.at, event.text, event.level))[-KEPT:])
        case Unconfirmed(lost=True):
            return replace(run, lost=event.why)
        case Unconfirmed():
            return replace(run, unconfirmed=event.why)
        case Loading(why=""):
            return replace(run, loading="", loading_since=None)
        case Loading():
            since = event.at if run.loading_since is None else run.loading_since
            return replace(run, loading=event.why, loading_since=since)
        case Ended():
            return _end(run, event)
        case PieceSeen():
            return _piece_seen(run, event)
        case Held(by=by):
            held = replace(run, held=event)
            return held if by is None else with_press(held, event.request_id, wait_press(by))
        case BreakpointsSet():
            return replace(run, breakpoints=event.breakpoints)
        case PieceWaits():
            return replace(run, waits=run.waits | {event.call: (event.node, event.engine)})
        case Released(author=by, since=since, step=step, until=until, over=over):
            is_limited = bool(step or until or over)
            press = (
                step_press(by, since, step, until, over) if is_limited else go_on_press(by, since)
            )
            return with_press(replace(run, held=None, lead=by), event.request_id, press)
        case HandedOver():
            return replace(run, lead=event.to)
        case PieceEnded():
            return _piece_ended(run, event)
        case PieceBegan():
            action = replace(run.actions.get(event.node, _UNSEEN), piece=event.piece)
            actions, waits = run.actions | {event.node: action}, _without(run.waits, event.call)
            return _piece_rest(replace(run, actions=actions, waits=waits), _going(event))
        case PlayBegan(call=call):
            return replace(run, waits=_without(run.waits, call))
        case PieceRest():
            return _piece_rest(run, event)
        case QuestionAsked() | QuestionAnswered() | QuestionClosed() | AnswerRefused():
            return after_question(run, event)
        case PauseBegan(call=call):
            return replace(run, pauses=run.pauses | {call: event})
        case Requested() | Unknown():
            return run
        case _:
            assert_never(event)


def _desired(run: Run, event: PauseRequested | ResumeRequested | StopRequested) -> Run:
    """Return the run after the wish of a person to pause, resume or stop it; once a Stop was
    pressed, no later wish changes that."""
    is_stopped = run.desired == "stopped"
    match event:
        case PauseRequested():
            held = _held(run)
            return (
                held
                if is_stopped
                else replace(_with_intervention(held, event, "pause"), desired="paused")
            )
        case ResumeRequested():
            return (
                run
                if is_stopped
                else replace(_with_intervention(run, event, "resume"), desired="running")
            )
        case StopRequested() if is_stopped:
            return run
        case StopRequested():
            return replace(
                _with_intervention(run, event, "stop"),
                desired="stopped",
                stop_requested_at=event.at,
                stopped_by=event.author,
                held=None,
                waits={},
            )
        case _:
            assert_never(event)


def _with_intervention(
    run: Run,
    event: PauseRequested | ResumeRequested | StopRequested | ModifyRequested,
    kind: Literal["stop", "pause", "resume", "modify"],
) -> Run:
    """Return the run with a command of a person added, together with the state in which the run was
    then, as far as known. `kind`: the command."""
    asked = Intervention(
        kind=kind, at=event.at, by=event.author, state=run.state, active=run.active
    )
    return replace(run, interventions=(*run.interventions, asked)[-KEPT:])


def _held(run: Run) -> Run:
    actions = {name: with_possible_pause(action) for name, action in run.actions.items()}
    return replace(run, actions=actions)


def _alarmed(run: Run, event: AlarmRaised) -> Run:
    alarm = Alarm(event.code, event.at, event.text)
    return replace(_disturbed(run, event.code), alarms=(*run.alarms, alarm)[-KEPT:])


def _disturbed(run: Run, alarm: str) -> Run:
    """Return the run after an alarm about a command of another program: such a command may cause
    what the graph alone rules out, so later conclusions allow for it. `alarm`: the code of the
    alarm."""
    match alarm:
        case "foreign_pause":
            return _held(run)
        case "foreign_start" | "foreign_modify":
            return replace(_held(run), reshaped=True, stoppable=True)
        case "foreign_resume":
            return replace(run, reshaped=True)
        case "foreign_stop":
            return replace(run, stoppable=True)
        case _:
            return run


def is_news(run: Run, shown: Snapshot) -> bool:
    """Return whether a snapshot shows any state, message or value of the run that is not known yet."""
    own = shown.graph == run.graph_name
    if shown.state != (run.graph_state if own else run.parts.get(shown.graph)):
        return True
    if _has_new_values(run, shown):
        return True
    for node, state in shown.nodes.items():
        action = run.actions.get(key_of(run, shown.graph, node))
        if action is None or action.state != state:
            return True
        if shown.source == "get" and awaits_answer(action):
            return True
        messages = shown.messages.get(node, ())
        if len(messages) != action.heard or not is_heard(action, messages):
            return True
    return False


def _has_new_values(run: Run, shown: Snapshot) -> bool:
    """Return whether an answer shows other outputs of a piece than were seen so far. Feedback does
    not count, since it may be old."""
    is_answer = shown.graph == run.graph_name and shown.source == "get"
    return is_answer and run.piece is not None and shown.kept != run.kept


def thin(run: Run, seen: Iterable[Seen]) -> tuple[Seen, ...]:
    """Return the observations without what the run already knows; the fold of both is the same. An
    engine repeats its whole graph after every change; storing it each time would grow with the
    square of its size."""
    thinned: list[Seen] = []
    for item in seen:
        less = _thin(run, item) if isinstance(item, Snapshot) and not item.same else item
        run = observe(run, (less,))
        thinned.append(less)
    return tuple(thinned)


def _thin(run: Run, shown: Snapshot) -> Snapshot:
    if not names_all(run, shown):
        return shown  # an action is gone: it must not be taken for unchanged
    news: dict[str, str] = {}
    said: dict[str, tuple[str, ...]] = {}
    for node, state in shown.nodes.items():
        action = run.actions.get(key_of(run, shown.graph, node))
        messages = shown.messages.get(node, ())
        is_new = len(messages) != action.heard or not is_heard(action, messages) if action else True
        is_new = is_new or (shown.source == "get" and action is not None and awaits_answer(action))
        if is_new or action is None or action.state != state:
            news[node] = state
            if messages:
                said[node] = messages
    inputs = {name: values for name, values in shown.inputs.items() if name in news}
    kept = shown.kept if _has_new_values(run, shown) else NOTHING_KEPT
    return replace(shown, nodes=news, messages=said, inputs=inputs, same=True, kept=kept)


def _modified(run: Run, event: ModifyRequested) -> Run:
    actions = {
        name: replace(run.actions.get(name, ActionRun()), aid=aid)
        for name, aid in event.actions.items()
    }
    return replace(
        _with_intervention(run, event, "modify"),
        version=event.version,
        digest=event.digest,
        tree_digest=None,
        limits=event.limits,
        actions=run.actions | actions,
        reshaped=True,
    )


def _unmodified(run: Run, event: ModifyRefused) -> Run:
    """Return the run after a refused change of the graph: the earlier version is in force again,
    and actions that only the change would have brought are removed."""
    actions = {
        name: replace(action, aid=event.actions.get(name, action.aid))
        for name, action in run.actions.items()
        if name in event.actions or action.seen_at
    }
    last = run.interventions[-1:]
    kept = run.interventions[:-1] if last and last[0].kind == "modify" else run.interventions
    return replace(
        run,
        version=event.version,
        digest=event.digest,
        limits=event.limits,
        actions=actions,
        interventions=kept,
    )


def _reopen(run: Run, event: MovesAgain) -> Run:
    """Return the run after it was seen moving after its end: it is open again without a proof, and
    the last command of people still counts."""
    alarm = Alarm("moves_again", event.at, event.text)
    return replace(
        run,
        end=None,
        ended_at=None,
        proof_at=None,
        at_rest=None,
        unknown_since=None,
        detail="",
        moves_again_at=event.at,
        alarms=(*run.alarms, alarm)[-KEPT:],
    )


def _end(run: Run, event: Ended) -> Run:
    """Return the run after its end. Actions whose end is not proven keep the state in which they
    were seen last."""
    return replace(
        run,
        end=event.state,
        ended_at=event.at,
        result=event.result or run.result,
        detail=event.detail,
        at_rest=event.at_rest,
        lost="",
        unconfirmed="",
        loading="",
        loading_since=None,
        moves_again_at=None,
        unknown_since=run.unknown_since if event.state == "lost" else None,
        held=None,
        waits={},
        questions={},
        pauses={},
    )


def _piece_seen(run: Run, event: PieceSeen) -> Run:
    """Return the led run after a robot has shown another state of an action that it carries
    out. Each call is one visit, with the bounds that the piece's own run has found."""
    known = run.actions.get(event.node, _UNSEEN)
    action = after_piece(known, event.call, event.state, event.visit, event.at)
    action = with_messages(action, event.messages, event.at)
    return _timed(replace(run, actions=run.actions | {event.node: action}), event.at, event.at)


def _piece_ended(run: Run, event: PieceEnded) -> Run:
    """Return the led run after the outcome of a call. In older streams, without `PieceRest`
    events, an outcome that an answer has shown also proves that the piece is at rest."""
    action = after_outcome(
        run.actions.get(event.node, _UNSEEN),
        event.call,
        event.outcome,
        "inferred" if event.how == "word" else "observed",
        {name: shortened(text) for name, text in event.outputs.items()} or None,
    )
    run = replace(
        run,
        actions=run.actions | {event.node: action},
        waits=_without(run.waits, event.call),
        pauses=_without(run.pauses, event.call),
    )
    if event.how in _OF_NO_ROBOT:  # who has answered stands in an event of its own
        return _with_outputs(run, event)
    if event.by is not None and action.call == event.call and action.visits:
        visit = action.older + len(action.visits)
        word = Said(visit=visit, by=event.by, at=event.at, reason=event.reason)
        words = (*run.said.get(event.node, ()), word)[-KEPT:]
        run = replace(run, said=run.said | {event.node: words})
    if event.by is not None:
        press = outcome_press(event.by, event.node, event.outcome, event.piece, event.reason)
        run = with_press(run, event.request_id, press)
    known = run.rests.get(event.piece)
    if known is None:
        return run
    if not known.rests and event.how == "shape":
        return _piece_rest(run, replace(known, state="proven", at=event.at, since=event.at))
    return replace(run, rests=run.rests | {event.piece: replace(known, asks=False)})


def _with_outputs(run: Run, event: PieceEnded) -> Run:
    """Return the led run with the values that people have given in the newest visit of an action."""
    action = run.actions.get(event.node, _UNSEEN)
    if not action.visits or not event.outputs:
        return run
    outputs = {name: shortened(text) for name, text in event.outputs.items()}
    visits = (*action.visits[:-1], replace(action.visits[-1], outputs=outputs))
    return replace(run, actions=run.actions | {event.node: replace(action, visits=visits)})


def _without(waits: dict[int, T], call: int) -> dict[int, T]:
    return {number: each for number, each in waits.items() if number != call}


def _going(event: PieceBegan) -> PieceRest:
    return PieceRest(
        at=event.at,
        piece=event.piece,
        node=event.node,
        engine=event.engine,
        state="going",
        since=event.at,
    )


def _piece_rest(run: Run, event: PieceRest) -> Run:
    """Return the led run after an event about the proof that a piece is at rest. Earlier
    pieces of the same robot stay listed only while they may move or wait for an outcome."""
    kept = {
        piece: known
        for piece, known in run.rests.items()
        if known.engine != event.engine or not known.rests or known.asks
    }
    return replace(run, rests=kept | {event.piece: event})


def observe(run: Run, seen: Iterable[Seen]) -> Run:
    """Return the run after the observations `seen`, in their order."""
    actions = dict(run.actions)
    main = run.graph_name
    run = replace(run, actions=actions)  # the loop below fills the new dict
    going: int | None = None  # when motion was seen last; noted once for a row of sights
    for item in seen:
        match item:
            case NodeState():
                name = item.node if item.graph == main else key_of(run, item.graph, item.node)
                action = actions.get(name, _UNSEEN)
                actions[name] = after_transition(action, item.state, item.at, item.inputs)
                if run.graph_state in TERMINAL:
                    run = _timed(run, item.at, item.at)
                elif going is None or item.at > going:
                    going = item.at
                continue
            case NodeResult():
                name = item.node if item.graph == main else key_of(run, item.graph, item.node)
                actions[name] = after_result(actions.get(name, _UNSEEN), item)
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
                run = _state_of(_after_snapshot(known, actions, item), item.graph, item.state)
                run = _timed(run, item.at, _asked_at(item))
            case Hazard():
                pass  # its alarm is an event of its own
            case _:
                assert_never(item)
    return run if going is None else _timed(run, going, going)


def _state_of(run: Run, graph: str, state: str) -> Run:
    if graph == run.graph_name:
        return replace(run, graph_state=state)
    return replace(run, parts=run.parts | {graph: state})


def _after_snapshot(run: Run, actions: dict[str, ActionRun], item: Snapshot) -> Run:
    """Fold the snapshot `item` into `actions`, the actions of the run, and return the run. Failures
    and sub-graphs come first, since they affect the other actions of the same snapshot."""
    own = item.graph == run.graph_name
    if item.kept != NOTHING_KEPT and _has_new_values(run, item):
        run = replace(run, kept=item.kept)
    failed = run.failed or not own or "ERROR" in item.nodes.values()
    looked = max(run.looked.get(item.graph, 0), _before(item))
    asked = _asked_at(item)
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
        action = after_snapshot(action, state, sight, item.inputs.get(node))
        actions[name] = with_messages(action, item.messages.get(node, ()), item.at)
    if asked is not None and (item.same or names_all(run, item)):
        looked = max(looked, asked)
    return replace(run, looked=run.looked | {item.graph: looked}, failed=failed)


def _looked_at(run: Run, looked: int) -> Run:
    """Return the run after an answer requested at `looked` (µs UTC) has shown it as it was known:
    it was not over by then."""
    if run.over_at is not None or looked <= max(run.going_at, run.reopened_at):
        return run
    return replace(run, going_at=looked)


def _timed(run: Run, at: int, asked: int | None) -> Run:
    """Return the run with the time since when it is over, or was last seen going on. `at`: the time
    of the observation; `asked`: when its answer was requested, None for other observations (µs
    UTC). All actions are examined only if the graph's state is final."""
    if run.graph_state in TERMINAL and run.apparent_end is not None:
        return run if run.over_at is not None else replace(run, over_at=at)
    if run.over_at is None and (asked is None or asked <= run.going_at):
        return run
    reopened = at if asked is None else run.reopened_at
    return replace(run, over_at=None, going_at=max(run.going_at, asked or 0), reopened_at=reopened)


def names_all(run: Run, item: Snapshot) -> bool:
    """Return whether a snapshot names every action that the run has in this graph."""
    return all(name in item.nodes for name in _known_of(run, item.graph))


def _known_of(run: Run, graph: str) -> Iterator[str]:
    own, prefix = graph == run.graph_name, f"{graph}/"
    for name in run.actions:
        if "/" not in name if own else name.startswith(prefix):
            yield name if own else name.removeprefix(prefix)


def key_of(run: Run, graph: str, node: str) -> str:
    """Return the name of an action in a run. `graph`: the name under which the engine runs the
    graph of the action; `node`: the action's full name. For an action of a sub-graph the result is
    `graph/node`, else just `node`."""
    return node if graph == run.graph_name else f"{graph}/{node}"


def _asked_at(item: Snapshot) -> int | None:
    """Return when the answer of a snapshot was requested (µs UTC), so that the snapshot is newer
    than that. None for feedback, which may be of any age."""
    if item.source == "feedback":
        return None
    return item.asked_at if item.asked_at is not None else item.at - _ASKED_US


def _before(item: Snapshot) -> int:
    """Return when the answer before this snapshot was requested (µs UTC); 0 without one. Older
    streams only have the time at which it came, from which the latest delay is subtracted."""
    if item.since_asked is not None:
        return item.since_asked
    return 0 if item.since is None else item.since - _ASKED_US
