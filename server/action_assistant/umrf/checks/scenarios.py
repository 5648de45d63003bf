"""Ways through a graph tried out in the simulator: which end in waiting for ever (H8)."""

from collections.abc import Iterator
from typing import Final

from action_assistant.umrf.checks.places import Subject
from action_assistant.umrf.model import PRECONDITIONS, Action
from action_assistant.umrf.semantics import (
    Behaviour,
    GraphState,
    Hazard,
    NotReady,
    Script,
    Trace,
    simulate,
)

#: Actions and relations that all trials together may have, so that checking stays quick.
BUDGET: Final = 2_000
_BLOCKED: Final = {"H2", "H6", "H7", "H8", "H9", "no-entry", "ghost", "actors"}


def check_scenarios(subject: Subject) -> None:
    """Tries every action with on_true, then one that ends otherwise at a time."""
    size = max(len(subject.real), len(subject.relations))
    if not subject.real or size > BUDGET or any(p.code in _BLOCKED for p in subject.problems):
        return
    told: set[str] = set()
    for trial, (action, outcome) in enumerate(_trials(subject)):
        if trial * size >= BUDGET:
            return
        stuck = _stuck(subject, action, outcome)
        if stuck is None or stuck in told:
            continue
        told.add(stuck)
        when = f"If {action.full_name} ends with {outcome}" if action else "If all goes well"
        message = f"{when}, the graph stays RUNNING for ever: {stuck}."
        waiting = next((a for a in subject.real if f"{a.full_name} still" in stuck), None)
        subject.report("H8", "warning", message, action=waiting)


def _trials(subject: Subject, every: bool = False) -> Iterator[tuple[Action | None, str]]:
    """Which action ends how; `every`: also where all children ignore it."""
    yield None, ""
    for action in subject.real:
        outgoing = subject.outgoing.get(action.key, [])
        answers = {o: [r.conditions.answer(o) for r in outgoing] for o in PRECONDITIONS}
        for outcome in ("on_false", "on_error"):
            asked = every or any(answer != "ignore" for answer in answers[outcome])
            if asked and answers[outcome] != answers["on_true"]:
                yield action, outcome


def halted(subject: Subject) -> str | None:
    """In which case a graph ends HALTED, in words; None if no trial does."""
    size = max(len(subject.real), len(subject.relations))
    for trial, (action, outcome) in enumerate(_trials(subject, every=True)):
        if trial * size >= BUDGET:
            break
        for trace in _tried(subject, action, outcome):
            if isinstance(trace, GraphState) and trace.state == "HALTED":
                return f"if {action.full_name} ends with {outcome}" if action else "in any case"
    return None


def _tried(subject: Subject, action: Action | None, outcome: str) -> Iterator[Trace]:
    """The trace of a trial: the first run of one action ends otherwise."""
    behaviours: dict[str, tuple[Behaviour, ...]] = {
        other.full_name: (Behaviour(after_s=1 + place / 1000),)
        for place, other in enumerate(subject.real)
    }
    if action is not None:
        usual = behaviours[action.full_name][0]
        other_end = Behaviour(after_s=usual.after_s, result=outcome)
        behaviours[action.full_name] = (other_end, usual)
    events = 20 * len(subject.real) + 100
    return simulate(subject.graph, script=Script(behaviours), max_events=events)


def _stuck(subject: Subject, action: Action | None, outcome: str) -> str | None:
    """What the graph waits for in the end, or None if it does not."""
    waits: dict[str, str] = {}
    for trace in _tried(subject, action, outcome):
        match trace:
            case NotReady(node=node, why=why):
                waits[node] = why
            case Hazard(code="H8", graph=name) if name == subject.graph.name:
                return _told(subject, waits)
            case _:
                pass
    return None


def _told(subject: Subject, waits: dict[str, str]) -> str | None:
    if not waits:
        return "nothing runs any more"
    node, why = list(waits.items())[-1]
    who = "the exit" if node == "graph_exit_0" else node
    if "inputs=missing" not in why:
        return f"{who} still waits for parents that are required and did not run"
    if any("pvf_allowed_values" in p.text for a in subject.real for p in a.inputs):
        return None  # which values actions give is not known
    return f"{who} still waits for inputs"
