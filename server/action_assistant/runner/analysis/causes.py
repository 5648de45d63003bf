"""The causes of a run's bad end, as far as its own events prove them.

Pure. A cause is named only with its evidence: a moment, and the action that it shows at. What nothing
proves is not named; no cause is an answer, too.
"""

import re
from collections.abc import Iterator
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.runner.analysis.failing import failing_visit
from action_assistant.runner.analysis.levels import places_of
from action_assistant.runner.runs import refusals, stall
from action_assistant.runner.runs.events import Overridden
from action_assistant.runner.runs.run import Alarm, Run
from action_assistant.runner.runs.visits import ActionRun, Message, Visit
from action_assistant.umrf.json.text import parse_small
from action_assistant.umrf.model import EXIT, Action, Graph, Precondition, Relation

_UNRESOLVED: Final = "Could not resolve graph"
_REFUSAL: Final = "origin [in start"
_TYPES: Final = re.compile(r"is an? (\w+) here and an? (\w+) in the action")
_LONGEST: Final = 80  # characters of a value in a sentence
_PROBLEMS: Final = frozenset({"unknown-action", "signature"})


class _Evidence(msgspec.Struct, frozen=True, kw_only=True):
    """Where it shows: a moment (microseconds UTC), an action (full name), and what was said there."""

    at: int
    action: str | None = None
    quote: str = ""


class WrongParameter(_Evidence, frozen=True, tag="wrong_parameter", tag_field="kind"):
    """An action failed that was given a value of another type than the robot's action takes."""

    parameter: str
    value: str
    expected: str


class UnknownAction(_Evidence, frozen=True, tag="unknown_action", tag_field="kind"):
    """The engine refused the graph, and has no such action, or one with other parameters."""

    robot: str
    why: str


class Waiting(_Evidence, frozen=True, tag="waiting", tag_field="kind"):
    """`action` never ran, since it waits for `parent`: that goes on since `at` and never reported,
    or it ended as `ended` says, which the arrow between them passes over."""

    parent: str
    ended: str = ""
    until: Literal["stop", "silence", "end", "now"] = "now"


class Unended(_Evidence, frozen=True, tag="unended", tag_field="kind"):
    """`action` goes on since `at`, and no end of it was seen before somebody stopped the run."""


class Stalled(_Evidence, frozen=True, tag="stalled", tag_field="kind"):
    """The graph ran and nothing in it did; `quote` says what `action` waited for."""


class EngineRestarted(_Evidence, frozen=True, tag="engine_restarted", tag_field="kind"):
    """Another engine stands where the one before was."""


class ForeignCause(_Evidence, frozen=True, tag="foreign", tag_field="kind"):
    """Somebody else told the robot something. `ended`: the run was over then, without a Stop from
    here."""

    command: str
    graph: str
    robot: str
    ended: bool


class ActionFailed(_Evidence, frozen=True, tag="action_failed", tag_field="kind"):
    """An action ended in error, or false at the end of its graph."""

    result: Literal["error", "false"]
    inferred: bool


class RefusalCause(_Evidence, frozen=True, tag="refused", tag_field="kind"):
    """Nothing was begun: the runner or the engine said no."""


class Silence(_Evidence, frozen=True, tag="silence", tag_field="kind"):
    """The engine does not answer, or does not show the run; nothing is known since `at`."""


class Warned(_Evidence, frozen=True, tag="warned", tag_field="kind"):
    """Another alarm: the engine did something that it should not."""


Cause: TypeAlias = (
    WrongParameter
    | UnknownAction
    | Waiting
    | Unended
    | Stalled
    | EngineRestarted
    | ForeignCause
    | ActionFailed
    | RefusalCause
    | Silence
    | Warned
)


def causes(run: Run, graph: Graph | None) -> tuple[Cause, ...]:
    """What is proven to be behind the end of a run, or behind its trouble so far, the weightiest
    first; nothing for a run that went well. `graph`: as it was sent."""
    if run.end == "finished" and (run.result == "on_true" or _nothing_failed(run)):
        return ()
    found = list(_found(run, graph))
    return tuple(dict.fromkeys(found))


def _nothing_failed(run: Run) -> bool:
    """Robots do not tell the result of a graph; an action in error says enough."""
    return run.result is None and all(_failed(each) is None for each in run.actions.values())


def _found(run: Run, graph: Graph | None) -> Iterator[Cause]:
    yield from _restarts(run)
    yield from _commands(run)
    refused = tuple(_refusals(run, graph))
    yield from refused
    wrong = tuple(_parameters(run, graph)) if graph is not None else ()
    yield from wrong
    named = {each.action for each in wrong}
    yield from (each for each in _failures(run) if each.action not in named)
    stalls = tuple(_stalls(run, graph))
    yield from stalls
    if graph is not None and not stalls:
        yield from _waits(run, graph)
    if not refused:
        yield from _silence(run)
    told = {each.code for each in run.alarms if stalls and each.code == stall.STALLED}
    yield from _alarms(run, told | ({refusals.REFUSED} if refused else set()))


def _restarts(run: Run) -> Iterator[Cause]:
    for alarm in run.alarms:
        if alarm.code == "engine_restarted":
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


def _ended_by(run: Run, command: str, alarm: Alarm) -> bool:
    """Whether a command that ends runs came before an end that nobody here asked for."""
    return (
        command in {"start", "stop"}
        and run.end in {"stopped", "halted", "lost", "error"}
        and run.desired != "stopped"
        and (run.ended_at or 0) >= alarm.at
    )


def _refusals(run: Run, graph: Graph | None) -> Iterator[Cause]:
    """What the engine's own log says of the start, together with what it was known to lack."""
    said = (each for each in run.log if each.text.startswith(_REFUSAL))
    line = next(said, None) if run.end == "refused" or not _shown(run) else None
    lacking = [each for each in run.despite if each.code in _PROBLEMS]
    if line is None or _UNRESOLVED not in line.text or not lacking:
        if run.end == "refused":
            yield RefusalCause(at=run.ended_at or run.requested_at, quote=run.detail)
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
    """Whether the engine ever showed the run."""
    return run.graph_state is not None


def _parameters(run: Run, graph: Graph) -> Iterator[Cause]:
    for each in run.despite:
        name = _name_of(run, each.aid)
        action = next((one for one in graph.actions if one.key == each.aid), None)
        types = _TYPES.search(each.text)
        if each.code != "parameter-type" or name is None or action is None or types is None:
            continue
        failed = _failed(run.actions[name])
        if failed is not None:
            parameter, value = _given(action, each)
            yield WrongParameter(
                at=failed.start,
                action=name,
                parameter=parameter,
                value=value,
                expected=types[2],
                quote=_said(run.actions[name], failed),
            )


def _given(action: Action, problem: Overridden) -> tuple[str, str]:
    """A parameter's name and its value as it was sent."""
    path = problem.path.rpartition("_parameters/")[2]
    leaf = next((parse_small(each.text) for each in action.inputs if each.path == path), None)
    value = leaf.get("pvf_value") if isinstance(leaf, dict) else None
    text = "nothing" if value is None else msgspec.json.encode(value, enc_hook=str).decode()
    return path, text[:_LONGEST]


def _failures(run: Run) -> Iterator[Cause]:
    """The visit that it goes back to, however deep inside."""
    failing = failing_visit(run)
    if failing is not None:
        at, name, visit = failing
        yield ActionFailed(
            at=at,
            action=name,
            result="false" if visit.result == "false" else "error",
            inferred=visit.how == "inferred",
            quote=_said(run.actions[name], visit),
        )


def _stalls(run: Run, graph: Graph | None) -> Iterator[Stalled]:
    """What it waited for when nothing moved in it any more, if that was so to its end."""
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
    """Joins that one of their parents keeps waiting, when the run was given up."""
    if run.end in {"finished", "error", "refused"}:
        return
    moment, until = _given_up(run)
    if moment is None:
        return
    names = {action.key: action.full_name for action in graph.actions}
    held: set[str] = set()
    for child in graph.actions:
        if child.full_name in run.actions and not run.actions[child.full_name].visits:
            arrows = [r for r in graph.relations if r.child == child.key and r.required]
            for wait in _waiting(run, names, child.full_name, arrows, moment, until):
                held.add(wait.parent)
                yield wait
    if until == "stop":
        going = {name: _going(action, moment) for name, action in run.actions.items()}
        held |= _around(run, {name for name, visit in going.items() if visit is not None})
        for name, visit in going.items():
            if visit is not None and name not in held:
                yield Unended(at=visit.start, action=name)


def _around(run: Run, going: set[str]) -> set[str]:
    """Of these actions those that go on because one inside of them does."""
    found = places_of(run)
    levels = {found[name].levels for name in going}
    return {name for name in going if found[name].way in levels}


def _given_up(run: Run) -> tuple[int | None, Literal["stop", "silence", "end"]]:
    """From which moment on the actions tell nothing more."""
    if run.stop_requested_at is not None:
        return run.stop_requested_at, "stop"
    if run.unknown_since is not None:
        return run.unknown_since, "silence"
    return run.ended_at, "end"


def _waiting(
    run: Run,
    names: dict[str, str],
    child: str,
    arrows: list[Relation],
    moment: int,
    until: Literal["stop", "silence", "end"],
) -> Iterator[Waiting]:
    """A join has several parents, of which one has reported and another one has not."""
    parents = [(names[arrow.parent], arrow) for arrow in arrows if arrow.parent in names]
    if not any(_over(run.actions.get(name), moment) for name, _ in parents) or len(parents) < 2:
        return
    for name, arrow in parents:
        action = run.actions.get(name, ActionRun())
        going = _going(action, moment)
        if going is not None:
            yield Waiting(at=going.start, action=child, parent=name, until=until)
        elif (over := _over(action, moment)) is not None and _passes_over(arrow, over):
            yield Waiting(
                at=over.not_after or over.start,
                action=child,
                parent=name,
                ended=over.result or "",
                until=until,
            )


def _going(action: ActionRun, moment: int) -> Visit | None:
    """The visit of which no end had been reported by that moment."""
    last = action.visits[-1] if action.visits else None
    if last is None or last.start > moment:
        return None
    reported = last.not_after if last.until is None or last.not_after else last.start
    return last if reported is None or reported > moment else None


def _over(action: ActionRun | None, moment: int) -> Visit | None:
    """The last visit, when its end had been reported by then."""
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
    return (
        arrow.child != EXIT
        and outcome is not None
        and (arrow.conditions.answer(outcome) == "ignore")
    )


def _silence(run: Run) -> Iterator[Cause]:
    restarted = any(alarm.code == "engine_restarted" for alarm in run.alarms)
    if run.unknown_since is not None and not restarted:
        yield Silence(at=run.unknown_since, quote=run.detail)
    elif run.end == "lost" and run.detail and not restarted:
        yield Silence(at=run.ended_at or run.requested_at, quote=run.detail)


def _alarms(run: Run, told: set[str]) -> Iterator[Cause]:
    for alarm in run.alarms:
        if alarm.code in told:
            continue
        if alarm.code != "engine_restarted" and not alarm.code.startswith("foreign_"):
            yield Warned(at=alarm.at, quote=alarm.text)


def _failed(action: ActionRun) -> Visit | None:
    return next((visit for visit in action.visits if visit.result == "error"), None)


def _said(action: ActionRun, visit: Visit) -> str:
    """The last thing that an action said in a visit."""
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
