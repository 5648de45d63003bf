"""Causes in plain sentences, for the page and for the list of runs. Pure."""

from collections.abc import Iterable, Mapping
from typing import assert_never

from action_assistant.runner.analysis.causes import (
    ActionFailed,
    Cause,
    EngineRestarted,
    ForeignCause,
    RefusalCause,
    Silence,
    Stalled,
    Unended,
    UnknownAction,
    Waiting,
    Warned,
    WrongParameter,
)
from action_assistant.runner.analysis.levels import INTO, LevelPlace, places_of
from action_assistant.runner.runs.run import Run


def words(cause: Cause, run: Run) -> str:
    """A cause in one plain sentence. The moment stands beside it."""
    who = called(run, cause.action) if cause.action is not None else ""
    match cause:
        case WrongParameter():
            return (
                f"{who} was started with {cause.parameter} = {cause.value}: "
                f"a {cause.expected} was expected."
            )
        case UnknownAction(robot=robot, why=why):
            if why:
                return f"{who or 'An action'} is another one on {robot}: {why}"
            return f"{who or 'An action'} is not known to {robot}, so it refused the graph."
        case Waiting():
            return _waits_in_words(cause, run, who)
        case Unended():
            return f"{who} had not reported its end when {_stopper(run)} pressed Stop."
        case EngineRestarted():
            return f"The engine of {run.engine} was restarted; what happened after is unknown."
        case ForeignCause():
            return _command_in_words(cause)
        case ActionFailed(result=result, quote=quote):
            how = "in error" if result == "error" else "false"
            seen = " (inferred)" if cause.inferred else ""
            return f"{who} ended {how}{seen}" + (f": “{quote}”" if quote else ".")
        case RefusalCause(quote=quote):
            return _refusal_in_words(run.engine, quote)
        case Silence(quote=quote):
            told = f" {quote}" if quote else ""
            return f"What happened after this moment is unknown.{told}"
        case Stalled(quote=quote) | Warned(quote=quote):
            return quote
        case _:
            assert_never(cause)


def _refusal_in_words(engine: str, quote: str) -> str:
    if quote.startswith((f"{engine} refused the start", f"{engine} holds the graph")):
        return quote
    return f"{engine} refused the start: {quote or 'it did not say why.'}"


def _waits_in_words(cause: Waiting, run: Run, child: str) -> str:
    parent = called(run, cause.parent)
    if cause.ended:
        return f"{child} waits for {parent}, which ended {cause.ended}: its arrow passes that over."
    end = f" It went on until {_stopper(run)} pressed Stop." if cause.until == "stop" else ""
    return f"{child} waits for {parent}, which never reported its end.{end}"


def _command_in_words(cause: ForeignCause) -> str:
    if not cause.graph:
        return cause.quote
    verbs: dict[str, str] = {
        "start": f"started {cause.graph} on {cause.robot}",
        "stop": f"told {cause.robot} to stop this run",
        "pause": f"told {cause.robot} to pause this run",
        "resume": f"told {cause.robot} to go on with this run",
        "modify": f"changed the graph on {cause.robot}",
    }
    did = verbs.get(cause.command, f"told {cause.robot} something")
    return f"Somebody else {did}" + ("; this run was ended by it." if cause.ended else ".")


def _stopper(run: Run) -> str:
    by = run.stopped_by
    return (by.name if by is not None else "") or "somebody"


def called(run: Run, full_name: str) -> str:
    """An action as people call it: by the way into its level, each name without its number where it is
    the only one of its name there."""
    found = places_of(run)
    place = found.get(full_name)
    if place is None:
        return _alone(full_name, run.actions)
    way = place.way
    steps = range(len(way))
    return INTO.join(_alone(way[depth], _beside(found, way[:depth])) for depth in steps)


def _beside(found: Mapping[str, LevelPlace], levels: tuple[str, ...]) -> list[str]:
    return [place.name for place in found.values() if place.levels == levels]


def _alone(full_name: str, beside: Iterable[str]) -> str:
    name, _, number = full_name.rpartition("_")
    alike = [each for each in beside if each.rpartition("_")[0] == name]
    return name if len(alike) < 2 else f"{name} {number}"
