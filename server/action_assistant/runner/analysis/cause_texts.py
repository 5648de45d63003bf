"""Words causes as sentences, for the page and for the list of runs. Pure."""

import math
from collections.abc import Sequence
from typing import Final, assert_never

from action_assistant.runner.analysis.causes import (
    ActionFailed,
    Cause,
    EngineRestarted,
    ForeignCause,
    NothingFollowed,
    OperatorChange,
    OperatorPause,
    OperatorStop,
    RefusalCause,
    RunningAction,
    Silence,
    Stalled,
    UnknownAction,
    Waiting,
    Warned,
    WrongParameter,
)
from action_assistant.runner.analysis.levels import INTO, places_of
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.run import Run
from action_assistant.safe_text import sentence
from action_assistant.umrf.questions import READY_SIGNATURES, title_of

#: The page puts the present name of a person here who had none at that time.
NOBODY: Final = "Somebody"
_NAMED: Final = 3  # actions in one sentence
_TENTH_US: Final = 100_000
_SAME_S: Final = 0.101  # bounds that are no further apart are written as one figure


def cause_sentence(cause: Cause, run: Run) -> str:
    """Return a cause as one sentence without its time. `run`: for the names of its actions. Names
    of right-to-left scripts are isolated."""
    return sentence(_in_words(cause, run))


def _in_words(cause: Cause, run: Run) -> str:
    who = short_name(run, cause.action) if cause.action is not None else ""
    match cause:
        case OperatorStop():
            return _stop_in_words(cause, run)
        case OperatorPause():
            did = "paused the run" if cause.seen else "asked for a pause"
            return f"{_named(cause.by)} {did}{_while_in_words(cause.ran, run)}."
        case OperatorChange():
            return f"{_named(cause.by)} gave the run another version of its graph while it went on."
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
        case NothingFollowed(ended=ended):
            how = " in error" if ended == "error" else f" {ended}" * bool(ended)
            return f"{who} ended{how}, and nothing follows that: the exit was not reached."
        case EngineRestarted():
            return f"The engine of {run.engine} was restarted; what happened after is unknown."
        case ForeignCause():
            return _command_in_words(cause)
        case ActionFailed(result=result, quote=quote):
            how = "in error" if result == "error" else "false"
            seen = " (inferred)" if cause.inferred else ""
            return f"{who} ended {how}{seen}" + (f": “{quote}”" if quote else ".")
        case RefusalCause(quote=quote, sent=sent):
            return _refusal_in_words(run.engine, quote, sent=sent)
        case Silence(quote=quote):
            reason = f" {quote}" if quote else ""
            return f"What happened after this moment is unknown.{reason}"
        case Stalled(quote=quote) | Warned(quote=quote):
            return quote
        case _:
            assert_never(cause)


def _stop_in_words(cause: OperatorStop, run: Run) -> str:
    who = _named(cause.by)
    lead = f"{who} sent Stop from a program" if cause.by.by == "program" else f"{who} pressed Stop"
    if cause.restarted:
        return f"{lead} after the engine of {run.engine} had been restarted."
    until_then = _while_in_words(cause.ran, run, ": before that ")
    match cause.state:
        case "requested" if run.incarnation is None:
            return f"{lead} before anything was sent."
        case "requested" | "published" if not cause.begun:
            return f"{lead} before any action was seen to run."
        case "unknown":
            return f"{lead} while {run.engine} gave no answer{until_then}."
        case "lost":
            return f"{lead} after {run.engine} had stopped showing the run{until_then}."
        case "paused":
            held = [short_name(run, each.action) for each in cause.ran[:_NAMED]]
            where = f", in {_listed(held, len(cause.ran))}" if held else ""
            return f"{lead} while the run was paused{where}."
        case _ if cause.ran:
            return f"{lead}{_while_in_words(cause.ran, run)}."
        case _:
            return f"{lead} while no action was seen running."


def _while_in_words(ran: Sequence[RunningAction], run: Run, lead: str = " while ") -> str:
    """Return a phrase that says which actions ran at the time of the cause, and how long they had
    run by then; "" for none. `lead`: the text before the names."""
    if not ran:
        return ""
    names = [f"{short_name(run, each.action)} ({_lasted(each)})" for each in ran[:_NAMED]]
    who = f"{_listed(names, len(ran))} ran"
    if len(ran) == 1:
        who = f"{short_name(run, ran[0].action)} ran ({_lasted(ran[0])})"
    doubt = "" if all(each.proven for each in ran) else ", as far as was seen"
    return f"{lead}{who}{doubt}"


def _listed(names: Sequence[str], count: int) -> str:
    if count > len(names):
        return f"{', '.join(names)} and {count - len(names)} more"
    return names[0] if count == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _lasted(ran: RunningAction) -> str:
    """Return, in seconds, how long an action had run, as one number or as bounds ("≤ 2 s", "1–2
    s")."""
    least, most = math.floor(ran.least / _TENTH_US) / 10, math.ceil(ran.most / _TENTH_US) / 10
    if most - least <= _SAME_S:
        return f"{round(ran.most / 1e6, 1)} s"
    return f"≤ {most} s" if not least else f"{least}–{most} s"


def _named(by: Author) -> str:
    return by.name or NOBODY


def _refusal_in_words(engine: str, quote: str, *, sent: bool) -> str:
    if not sent:
        return f"Nothing was started: {quote or 'it is not known why.'}"
    if quote.startswith((f"{engine} refused the start", f"{engine} holds the graph")):
        return quote
    return f"{engine} refused the start: {quote or 'it did not say why.'}"


def _waits_in_words(cause: Waiting, run: Run, child: str) -> str:
    parent = short_name(run, cause.parent)
    if cause.ended:
        return (
            f"{child} waited for {parent}, which ended {cause.ended}: its arrow passes that over."
        )
    return f"{child} waited for {parent}, which had not been seen to end by then."


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


def short_name(run: Run, full_name: str) -> str:
    """Return the name of an action for people, such as "Search › Pick 1": first the sub-graphs that
    contain the action, from the outermost, then the action. `full_name`: name, "_" and number. A
    number 0 is left out, as on cards."""
    place = places_of(run).get(full_name)
    return INTO.join(_alone(each) for each in (place.way if place is not None else (full_name,)))


def _alone(full_name: str) -> str:
    name, _, number = full_name.rpartition("_")
    title = title_of(name) if name in READY_SIGNATURES else name
    return title if number == "0" else f"{title} {number}"
