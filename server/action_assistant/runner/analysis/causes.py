"""The causes of a run's bad end, as far as its own events prove them.

Pure. A cause is named only with its evidence: a moment, and the action that it shows at. A cause
without proof is not named; having none is an answer, too. What a person at this runner did comes
first, and no cause contradicts a later event of the run.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.runner.analysis.levels import LevelPlace, places_of, within
from action_assistant.runner.runs import refusals, stall
from action_assistant.runner.runs.events import Author, Overridden
from action_assistant.runner.runs.run import Alarm, Intervention, Run, State
from action_assistant.runner.runs.visits import ActionRun, Message, Visit
from action_assistant.umrf.json.text import parse_small
from action_assistant.umrf.model import Action, Graph, Precondition, Relation

_UNRESOLVED: Final = "Could not resolve graph"
_REFUSAL: Final = "origin [in start"
_TYPES: Final = re.compile(r"is an? (\w+) here and an? (\w+) in the action")
_LONGEST: Final = 80  # characters of a value in a sentence
_PROBLEMS: Final = frozenset({"unknown-action", "signature"})
#: A visit that has ended: the moment (microseconds UTC), the full name of its action, the visit.
EndedVisit: TypeAlias = tuple[int, str, Visit]

#: Alarms of the runner that are causes of their own kind, or of none.
RESTARTED: Final = "engine_restarted"
UNCONFIRMED: Final = "stop_unconfirmed"


class _Evidence(msgspec.Struct, frozen=True, kw_only=True):
    """The evidence of a cause: its time (microseconds UTC), the action (full name), and a quoted
    text."""

    at: int
    action: str | None = None
    quote: str = ""


class WrongParameter(_Evidence, frozen=True, tag="wrong_parameter", tag_field="kind"):
    """An action failed whose parameter has another type than the robot's action takes."""

    parameter: str
    value: str
    expected: str


class UnknownAction(_Evidence, frozen=True, tag="unknown_action", tag_field="kind"):
    """The engine refused the graph: it lacks this action, or has it with other parameters."""

    robot: str
    why: str


class RunningAction(msgspec.Struct, frozen=True, kw_only=True):
    """An action that ran when a person did something. `proven`: events show that it ran at that
    very moment; else it was seen running before, and its end was not seen. It had begun between
    `least` and `most` microseconds before."""

    action: str
    proven: bool
    least: int
    most: int


class OperatorStop(_Evidence, frozen=True, tag="operator_stop", tag_field="kind"):
    """A person pressed Stop, maybe by a program. `state`: of the run then, as far as was known;
    `ran`: the actions that ran; `begun`: any action had begun. `restarted`: the engine had been
    restarted before."""

    by: Author
    state: State
    ran: tuple[RunningAction, ...] = ()
    begun: bool = True
    restarted: bool = False


class OperatorPause(_Evidence, frozen=True, tag="operator_pause", tag_field="kind"):
    """A person paused the run and nobody resumed it. `seen`: the engine showed the run paused."""

    by: Author
    ran: tuple[RunningAction, ...] = ()
    seen: bool = False


class OperatorChange(_Evidence, frozen=True, tag="operator_change", tag_field="kind"):
    """A person gave the run another version of its graph while it was running."""

    by: Author


class Waiting(_Evidence, frozen=True, tag="waiting", tag_field="kind"):
    """The action `action` never ran, since it waited for `parent`. Either the parent had begun at
    `at` and was not seen to end before the run was given up, or it had ended with the outcome
    `ended`, which the arrow ignores."""

    parent: str
    ended: str = ""


class NothingFollowed(_Evidence, frozen=True, tag="nothing_followed", tag_field="kind"):
    """The last action that ran ended with the outcome `ended` ("" where the robot does not tell it), which
    none of its arrows follows, so that the graph did not reach its exit."""

    ended: str


class Stalled(_Evidence, frozen=True, tag="stalled", tag_field="kind"):
    """The graph was RUNNING and none of its actions ran. `quote`: what `action` waited for."""


class EngineRestarted(_Evidence, frozen=True, tag="engine_restarted", tag_field="kind"):
    """Another process of the engine replaced the one that ran the graph."""


class ForeignCause(_Evidence, frozen=True, tag="foreign", tag_field="kind"):
    """Another program sent a command to the robot. `ended`: the run was over after it, without a
    Stop from here."""

    command: str
    graph: str
    robot: str
    ended: bool


class ActionFailed(_Evidence, frozen=True, tag="action_failed", tag_field="kind"):
    """An action ended in error, or false at the end of its graph."""

    result: Literal["error", "false"]
    inferred: bool


class RefusalCause(_Evidence, frozen=True, tag="refused", tag_field="kind"):
    """The start was refused: by the engine if `sent`, else before it was sent."""

    sent: bool = True


class Silence(_Evidence, frozen=True, tag="silence", tag_field="kind"):
    """The engine does not answer, or does not show the run; its state is unknown since `at`."""


class Warned(_Evidence, frozen=True, tag="warned", tag_field="kind"):
    """Another alarm of the run."""


#: Causes that are commands of people at this runner.
OPERATOR: Final = (OperatorStop, OperatorPause, OperatorChange)

Cause: TypeAlias = (
    OperatorStop
    | OperatorPause
    | OperatorChange
    | WrongParameter
    | UnknownAction
    | Waiting
    | NothingFollowed
    | Stalled
    | EngineRestarted
    | ForeignCause
    | ActionFailed
    | RefusalCause
    | Silence
    | Warned
)


def causes(run: Run, graph: Graph | None) -> tuple[Cause, ...]:
    """Return the proven causes of a run's bad end, or of its trouble so far, the most important
    first; empty for a run that went well. `graph`: the graph that was sent, None if unknown."""
    if run.end == "finished" and (run.result == "on_true" or _nothing_failed(run)):
        return ()
    found = list(_found(run, graph))
    return tuple(dict.fromkeys(found))


def _nothing_failed(run: Run) -> bool:
    """Return whether no action failed in a finished run of unknown result. Robots report no results
    of graphs."""
    return run.result is None and all(_failed(each) is None for each in run.actions.values())


def _found(run: Run, graph: Graph | None) -> Iterator[Cause]:
    if run.reshaped:
        graph = None  # another graph than the sent one ran: its arrows prove nothing
    yield from operator(run)
    yield from _restarts(run)
    yield from _commands(run)
    refused = tuple(_refusals(run, graph))
    yield from refused
    wrong = tuple(_parameters(run, graph)) if graph is not None else ()
    yield from wrong
    named = {each.action for each in wrong}
    yield from (each for each in _failures(run, graph) if each.action not in named)
    stalls = tuple(_stalls(run, graph))
    yield from stalls
    if graph is not None and not stalls:
        yield from _waits(run, graph)
        yield from _dead_ends(run, graph)
    if not refused:
        yield from _silence(run)
    yield from _alarms(run, {refusals.REFUSED} if refused else set())


def operator(run: Run) -> tuple[OperatorStop | OperatorPause | OperatorChange, ...]:
    """Return the commands of people at this runner that affected the end of a run, a Stop first; ()
    without any."""
    found: list[OperatorStop | OperatorPause | OperatorChange] = []
    asked = run.interventions
    found += [_stop(run, each) for each in asked if each.kind == "stop"]
    if not found and run.stop_requested_at is not None and run.stopped_by is not None:
        early = Intervention(
            kind="stop", at=run.stop_requested_at, by=run.stopped_by, state="running"
        )
        found.append(_stop(run, early))
    standing = [each for each in asked if each.kind in {"pause", "resume"}][-1:]
    for each in standing:
        if each.kind == "pause":
            seen = run.graph_state == "PAUSED" or any(
                action.state == "PAUSED" for action in run.actions.values()
            )
            found.append(OperatorPause(at=each.at, by=each.by, ran=_ran(run, each), seen=seen))
    found += [OperatorChange(at=each.at, by=each.by) for each in asked if each.kind == "modify"]
    return tuple(found)


def _stop(run: Run, asked: Intervention) -> OperatorStop:
    restarted = any(each.code == RESTARTED and each.at <= asked.at for each in run.alarms)
    ran = _ran(run, asked)
    return OperatorStop(
        at=asked.at,
        action=ran[0].action if ran else None,
        by=asked.by,
        state=asked.state,
        ran=ran,
        begun=any(
            each.visits and each.visits[0].not_before <= asked.at for each in run.actions.values()
        ),
        restarted=restarted,
    )


def _ran(run: Run, asked: Intervention) -> tuple[RunningAction, ...]:
    """Return the actions that ran, or perhaps ran, when a person gave the command `asked`; those
    that certainly ran come first. Of an action of a sub-graph and the action that stands for the
    sub-graph, only the first is returned."""
    found: list[RunningAction] = []
    for name in asked.active:
        visit = _at(run.actions.get(name, ActionRun()), asked.at)
        if visit is not None:
            proven = _surely_ran(run, name, visit, asked)
            least, most = max(0, asked.at - visit.start), max(0, asked.at - visit.not_before)
            found.append(RunningAction(action=name, proven=proven, least=least, most=most))
    around = _around(run, {each.action for each in found})
    inmost = [each for each in found if each.action not in around]
    return tuple(sorted(inmost, key=lambda each: (not each.proven, each.most, each.action)))


def _at(action: ActionRun, moment: int) -> Visit | None:
    """Return the visit of an action that may have been running at `moment` (µs UTC); None if no
    visit may."""
    for visit in reversed(action.visits):
        if visit.not_before <= moment:
            ended = visit.not_after is not None and visit.not_after < moment
            return None if ended else visit
    return None


def _surely_ran(run: Run, name: str, visit: Visit, asked: Intervention) -> bool:
    """Return whether events prove that a visit of the action `name` was going on when a person gave
    the command `asked`. For a Stop, a visit that ended *stopped* was going on if nothing but this
    Stop can have stopped it."""
    if visit.start > asked.at:
        return False
    if visit.until is not None and visit.until >= asked.at:
        return True
    was_stopped = visit.result == "stopped" and asked.kind == "stop"
    return was_stopped and not run.stoppable and run.actions[name].aid is not None


def _restarts(run: Run) -> Iterator[Cause]:
    for alarm in run.alarms:
        if alarm.code == RESTARTED:
            yield EngineRestarted(at=alarm.at, quote=alarm.text)


def _commands(run: Run) -> Iterator[Cause]:
    for alarm in run.alarms:
        code, _, command = alarm.code.partition("_")
        if code == "foreign":
            beside = command == "other"
            yield ForeignCause(
                at=alarm.at,
                command="start" if beside else command,
                graph="" if beside else run.graph_name,
                robot=run.engine,
                ended=not beside and _ended_by(run, command, alarm),
                quote=alarm.text,
            )


#: The ends of a run that a foreign command can cause.
_ENDS: Final[dict[str, frozenset[str]]] = {
    "stop": frozenset({"stopped"}),
    "start": frozenset({"stopped", "lost"}),
}


def _ended_by(run: Run, command: str, alarm: Alarm) -> bool:
    """Return whether the command of another program, of which `alarm` tells, ended the run: such a
    command can end runs in this way, it came before the end, no person at this runner had pressed
    Stop, and the engine was not restarted."""
    others = [
        each for each in run.alarms if each.code == RESTARTED and each.at <= (run.ended_at or 0)
    ]
    over = run.over_at if run.over_at is not None else run.ended_at
    was_lost = command == "start" and run.end == "error" and run.at_rest is not None
    return (
        (was_lost or run.end in _ENDS.get(command, ()))
        and run.desired != "stopped"
        and not others
        and (over or 0) >= alarm.at
    )


def _refusals(run: Run, graph: Graph | None) -> Iterator[Cause]:
    """Yield the refusal of a start as a cause, from the engine's log or the end of the run; instead
    of it the actions that the engine lacks, if the refusal is about those. `graph`: as it was sent,
    None if unknown."""
    said = (each for each in run.log if each.text.startswith(_REFUSAL))
    line = next(said, None) if run.end == "refused" or not _shown(run) else None
    lacking = [each for each in run.despite if each.code in _PROBLEMS]
    if line is None or _UNRESOLVED not in line.text or not lacking:
        if run.end == "refused":
            sent = run.incarnation is not None
            yield RefusalCause(at=run.ended_at or run.requested_at, quote=run.detail, sent=sent)
        elif line is not None:
            yield RefusalCause(at=line.at, quote=_first_line(line))
        return
    for each in lacking:
        name = _name_of(run, each.aid)
        yield UnknownAction(
            at=line.at,
            action=name,
            robot=run.engine,
            why="" if each.code == "unknown-action" else each.text,
            quote=_first_line(line),
        )


def _shown(run: Run) -> bool:
    """Return whether the engine ever showed the run in an answer or feedback."""
    return run.graph_state is not None


def _parameters(run: Run, graph: Graph) -> Iterator[Cause]:
    for each in run.despite:
        name = _name_of(run, each.aid)
        action = next((one for one in graph.actions if one.key == each.aid), None)
        types = _TYPES.search(each.text)
        if each.code != "parameter-type" or name is None or action is None or types is None:
            continue
        failed = _failed(run.actions[name])
        parameter, value = _given(action, each)
        if failed is not None and _was_given(failed, parameter, value):
            yield WrongParameter(
                at=failed.start,
                action=name,
                parameter=parameter,
                value=value,
                expected=types[2],
                quote=_said(run.actions[name], failed),
            )


def _given(action: Action, problem: Overridden) -> tuple[str, str]:
    """Return the name of the parameter that a problem is about, and the value that was sent for it,
    as text ("nothing" without one)."""
    path = problem.path.rpartition("_parameters/")[2]
    leaf = next((parse_small(each.text) for each in action.inputs if each.path == path), None)
    value = leaf.get("pvf_value") if isinstance(leaf, dict) else None
    text = "nothing" if value is None else msgspec.json.encode(value, enc_hook=str).decode()
    return path, text[:_LONGEST]


def _was_given(visit: Visit, parameter: str, value: str) -> bool:
    """Return whether a visit may have had this value for a parameter. If the engine reported
    another value, which a parent action gave, it had not."""
    reported = (visit.inputs or {}).get(parameter.replace("/", "::"))
    return reported is None or reported[:_LONGEST] == value


def _failures(run: Run, graph: Graph | None) -> Iterator[Cause]:
    """Yield the action whose failure ended the run: of a failed sub-graph the innermost action
    inside. `graph`: as it was sent, None if unknown."""
    failing = _failing_visit(run, graph)
    if failing is not None:
        at, name, visit = failing
        yield ActionFailed(
            at=at,
            action=name,
            result="false" if visit.result == "false" else "error",
            inferred=visit.how == "inferred",
            quote=_said(run.actions[name], visit),
        )


def _failing_visit(run: Run, graph: Graph | None) -> EndedVisit | None:
    """Return the visit that explains a bad end; None if no visit does. It is the first that ended
    in error, or, in a run that ended false, the last top-level visit that ended false. An error
    from which the run recovered comes last: an action around it ended true, or an action that it
    started by an arrow of `graph`. In a run that a person stopped such an error does not count."""
    found = places_of(run)
    ended = _ended_visits(run, found, run.actions)
    errors = [each for each in ended if each[2].result == "error"]
    own = {place.way: name for name, place in found.items()}
    recovery = _recovery(graph)
    wrong = next(
        (
            each
            for each in errors
            if not _made_good(run, found, own, each) and not _handled(run, recovery, each)
        ),
        None,
    )
    if wrong is None and run.result == "on_false":
        top = [each for each in ended if each[2].result == "false" and not found[each[1]].levels]
        wrong = next(reversed(top), None)
    if run.end != "stopped" or run.stop_requested_at is None:
        wrong = wrong or next(iter(errors), None)
    return wrong and _inmost(run, found, wrong)


def _ended_visits(
    run: Run, found: Mapping[str, LevelPlace], names: Iterable[str]
) -> list[EndedVisit]:
    """Return the ended visits of the actions `names`, sorted by their ends; at equal times, inner
    ones first. `found`: the place of each action by name."""
    visits = [
        (visit.not_after or visit.start, name, visit)
        for name in names
        for visit in run.actions[name].visits
        if visit.until is not None
    ]
    return sorted(visits, key=lambda each: (each[0], -len(found[each[1]].levels), each[1]))


def _made_good(
    run: Run, found: Mapping[str, LevelPlace], own: Mapping[tuple[str, ...], str], wrong: EndedVisit
) -> bool:
    levels = found[wrong[1]].levels
    around = (own.get(levels[:depth]) for depth in range(1, len(levels) + 1))
    return any(
        visit.result == "true" and _holds(visit, wrong[2])
        for name in around
        if name is not None
        for visit in run.actions[name].visits
    )


def _recovery(graph: Graph | None) -> Mapping[str, frozenset[str]]:
    """Return, by the full name of each action, the full names of the actions that its error starts;
    empty if the graph is unknown (None)."""
    if graph is None:
        return {}
    names = {action.key: action.full_name for action in graph.actions}
    found: dict[str, set[str]] = {}
    for arrow in graph.relations:
        if arrow.conditions.on_error == "run" and arrow.parent in names and arrow.child in names:
            found.setdefault(names[arrow.parent], set()).add(names[arrow.child])
    return {name: frozenset(children) for name, children in found.items()}


def _handled(run: Run, recovery: Mapping[str, frozenset[str]], wrong: EndedVisit) -> bool:
    """Return whether an error (`wrong`) was handled: an action that an arrow starts after it
    (`recovery`, by the full name of the failed action) began after it and ended true."""
    at, name, visit = wrong
    return any(
        later.result == "true" and later.start >= (visit.until or at)
        for child in recovery.get(name, ())
        if child in run.actions
        for later in run.actions[child].visits
    )


def _inmost(run: Run, found: dict[str, LevelPlace], wrong: EndedVisit) -> EndedVisit:
    """Return the innermost visit that explains `wrong`: a visit inside of its action that ended in
    the same way, then a visit inside of that one, and so on. Return `wrong` itself if no visit
    inside does. `found`: the place of each action by name."""
    _, name, around = wrong
    inside = [
        each
        for each in _ended_visits(run, found, within(found, name))
        if each[2].result == around.result and _holds(around, each[2])
    ]
    if not inside:
        return wrong
    return _inmost(run, found, inside[0] if around.result == "error" else inside[-1])


def _holds(around: Visit, visit: Visit) -> bool:
    """Return whether `visit` can have been going on while `around` was going on."""
    ended = around.not_after
    return visit.start >= around.not_before and (ended is None or visit.not_before <= ended)


def _stalls(run: Run, graph: Graph | None) -> Iterator[Stalled]:
    """Yield the reasons for which a run stood still until its end, each with the action that
    waited. `graph`: as it was sent, None if unknown."""
    alarm = next((each for each in reversed(run.alarms) if each.code == stall.STALLED), None)
    visits = (visit for action in run.actions.values() for visit in action.visits)
    if alarm is None or any(visit.start > alarm.at for visit in visits):
        return
    found = stall.waits(run, graph, alarm.at) if graph is not None else ()
    for wait in found:
        yield Stalled(at=alarm.at, action=wait.action, quote=stall.in_words(wait))
    if not found:
        yield Stalled(at=alarm.at, quote=alarm.text)


def _waits(run: Run, graph: Graph) -> Iterator[Cause]:
    """Yield the actions that waited for several others and never ran, since one of these had not
    ended when the run was stopped, fell silent or ended. `graph`: as it was sent."""
    if run.end in {"finished", "error", "refused"}:
        return
    moment = _given_up(run)
    if moment is None:
        return
    names = {action.key: action.full_name for action in graph.actions}
    for child in graph.actions:
        if child.full_name in run.actions and not run.actions[child.full_name].visits:
            arrows = [r for r in graph.relations if r.child == child.key and r.required]
            yield from _waiting(run, names, child.full_name, arrows, moment)


def _dead_ends(run: Run, graph: Graph) -> Iterator[NothingFollowed]:
    """Yield the action whose end halted the graph: the last one that ended, if all its arrows ignore its
    outcome. Yield nothing where events do not tell which one was the last, also if one was not seen to
    end. `graph`: as it was sent."""
    visits = (visit for action in run.actions.values() for visit in action.visits)
    if run.end != "halted" or any(visit.until is None for visit in visits):
        return
    keys = {action.full_name: action.key for action in graph.actions}
    ended = _ended_visits(run, places_of(run), run.actions)
    latest = max((max(visit.start, visit.until or 0) for _, _, visit in ended), default=0)
    ignored = [
        (at, name, visit)
        for at, name, visit in ended
        if at >= latest
        and name in keys
        and all(
            _passes_over(arrow, visit) for arrow in graph.relations if arrow.parent == keys[name]
        )
    ]
    if len(ignored) == 1:
        at, name, visit = ignored[0]
        yield NothingFollowed(at=at, action=name, ended=visit.result or "")


def _around(run: Run, going: set[str]) -> set[str]:
    """Return those of the actions `going` that have another one of `going` inside, and so run only
    because the inner one does."""
    found = places_of(run)
    levels = {found[name].levels for name in going}
    return {name for name in going if found[name].way in levels}


def _given_up(run: Run) -> int | None:
    """Return the time (µs UTC) from which on states of actions prove nothing: a Stop, the beginning
    of a silence, or the end of the run; None if there is none."""
    if run.stop_requested_at is not None:
        return run.stop_requested_at
    return run.unknown_since if run.unknown_since is not None else run.ended_at


def _waiting(
    run: Run, names: dict[str, str], child: str, arrows: list[Relation], moment: int
) -> Iterator[Waiting]:
    """Yield the actions (parents) for which the action `child` was still waiting at `moment` (µs
    UTC). `arrows`: the required arrows to `child`; `names`: full names of actions by key. Yield
    nothing unless `child` has several parents and at least one of them had ended by then. A parent
    that had ended counts only if all had, and if it was the last one: any end of a required parent
    is a report, and the response to the last report decides (docs/umrf-and-the-engine.md 2.3)."""
    parents = [(names[arrow.parent], arrow) for arrow in arrows if arrow.parent in names]
    seen = [(name, arrow, run.actions.get(name, ActionRun())) for name, arrow in parents]
    ended = [
        (name, arrow, over)
        for name, arrow, action in seen
        if (over := _over(action, moment)) is not None
    ]
    if not ended or len(parents) < 2:
        return
    for name, _, action in seen:
        going = _going(action, moment)
        if going is not None:
            yield Waiting(at=going.start, action=child, parent=name)
    latest = max(max(over.until or 0, over.start) for _, _, over in ended)
    last = [each for each in ended if (each[2].not_after or moment) >= latest]
    if len(ended) == len(parents) and all(_passes_over(arrow, over) for _, arrow, over in last):
        for name, _, over in last:
            at = over.not_after or over.start
            yield Waiting(at=at, action=child, parent=name, ended=over.result or "")


def _going(action: ActionRun, moment: int) -> Visit | None:
    """Return the last visit of an action if its end had not been reported by `moment` (microseconds
    UTC), else None."""
    last = action.visits[-1] if action.visits else None
    if last is None or last.start > moment:
        return None
    reported = last.not_after if last.until is None or last.not_after else last.start
    return last if reported is None or reported > moment else None


def _over(action: ActionRun | None, moment: int) -> Visit | None:
    """Return the last visit of an action if its end had been reported by `moment` (microseconds
    UTC), else None."""
    if action is None or not action.visits or _going(action, moment) is not None:
        return None
    last = action.visits[-1]
    return last if last.start <= moment else None


def _passes_over(arrow: Relation, visit: Visit) -> bool:
    outcomes: dict[str, Precondition] = {
        "true": "on_true",
        "false": "on_false",
        "error": "on_error",
    }
    outcome = outcomes.get(visit.result or "")
    return outcome is not None and arrow.conditions.answer(outcome) == "ignore"


def _silence(run: Run) -> Iterator[Cause]:
    restarted = any(alarm.code == RESTARTED for alarm in run.alarms)
    if run.unknown_since is not None and not restarted:
        yield Silence(at=run.unknown_since, quote=run.detail)
    elif run.end == "lost" and run.detail and not restarted:
        yield Silence(at=run.ended_at or run.requested_at, quote=run.detail)


def _alarms(run: Run, named: set[str]) -> Iterator[Cause]:
    """Yield the alarms of a run as causes; none whose code is in `named`, that is a cause of its
    own kind, or that later events contradict."""
    for alarm in run.alarms:
        if alarm.code in named or alarm.code in {RESTARTED, stall.STALLED}:
            continue
        if not alarm.code.startswith("foreign_") and not _was_settled(run, alarm):
            yield Warned(at=alarm.at, quote=alarm.text)


def _was_settled(run: Run, alarm: Alarm) -> bool:
    """Return whether an alarm that a Stop is unconfirmed is settled: the run was proven, or seen,
    to be at rest later. False for other alarms."""
    if alarm.code != UNCONFIRMED:
        return False
    rested = [run.proof_at, run.at_rest.at if run.at_rest is not None else None]
    return any(each is not None and each >= alarm.at for each in rested)


def _failed(action: ActionRun) -> Visit | None:
    return next((visit for visit in action.visits if visit.result == "error"), None)


def _said(action: ActionRun, visit: Visit) -> str:
    """Return the last message that an action sent during a visit; "" if there is none."""
    until = visit.not_after
    said = [
        each.text
        for each in action.messages
        if each.at >= visit.not_before and (until is None or each.at <= until)
    ]
    return said[-1] if said else ""


def _name_of(run: Run, aid: str | None) -> str | None:
    if aid is None:
        return None
    return next((name for name, action in run.actions.items() if action.aid == aid), None)


def _first_line(line: Message) -> str:
    return line.text.partition("\n")[0].partition("]: ")[2] or line.text.partition("\n")[0]
