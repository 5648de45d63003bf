"""Ways through a graph tried out in the simulator: which end in waiting for ever (H8)."""

from collections.abc import Iterator
from typing import Final, TypeAlias

import msgspec

from action_assistant.umrf.checks.places import Subject, joined
from action_assistant.umrf.fixes import with_optional_outputs
from action_assistant.umrf.model import EXIT, PRECONDITIONS, Action, Graph, Key, Relation, Severity
from action_assistant.umrf.semantics import (
    Behaviour,
    EdgeEval,
    GraphState,
    Hazard,
    NotReady,
    Script,
    Trace,
    simulate,
)
from action_assistant.umrf.semantics.parts import EXIT_NODE, exit_owner

#: Actions and relations that all trials together may have, so that checking stays quick.
BUDGET: Final = 2_000
_BLOCKED: Final = {"H2", "H6", "H7", "H8", "H9", "no-entry", "ghost", "actors"}


class _Stuck(msgspec.Struct, frozen=True):
    """What a graph waits for in the end. `node`: who waits, "" if nobody; `inputs`: for values;
    `lacking`: the full names of required parents that have not reported, of the exit only; `last`:
    who asked last."""

    node: str = ""
    inputs: bool = False
    lacking: frozenset[str] = frozenset()
    last: str = ""


_Trial: TypeAlias = tuple[Action | None, str]


def check_scenarios(subject: Subject) -> None:
    """Tries every action with on_true, then one that ends otherwise at a time."""
    size = max(len(subject.real), len(subject.relations))
    if not subject.real or size > BUDGET or any(p.code in _BLOCKED for p in subject.problems):
        return
    told: set[_Stuck] = set()
    at_exit: list[tuple[_Trial, _Stuck]] = []
    for number, trial in enumerate(_trials(subject)):
        if number * size >= BUDGET:
            break
        stuck = _stuck(subject.graph, *trial)
        if stuck is None or stuck in told:
            continue
        told.add(stuck)
        if stuck.node == EXIT_NODE:
            at_exit.append((trial, stuck))
        elif (words := _told(subject, stuck)) is not None:
            waiting = next((a for a in subject.real if a.full_name == stuck.node), None)
            message = f"{_when(trial)}, the graph stays RUNNING for ever: {words}."
            subject.report("H8", "warning", message, action=waiting)
    _report_at_exit(subject, at_exit)


def _when(trial: _Trial) -> str:
    action, outcome = trial
    return f"If {action.full_name} ends with {outcome}" if action else "If all goes well"


# What the exit waits for


def _report_at_exit(subject: Subject, found: list[tuple[_Trial, _Stuck]]) -> None:
    """Each parent that is missed and each action whose outputs are missed, once."""
    mended = _mended(subject.graph, {name for _, stuck in found for name in stuck.lacking})
    is_mend = bool(found) and _never_stuck(subject, mended)
    told: set[str] = set()
    for trial, stuck in found:
        severity: Severity = "warning" if trial[0] else "error"
        start = f"{_when(trial)}, the graph stays RUNNING for ever"
        if stuck.inputs and "" not in told:
            told.add("")
            _report_outputs(subject, severity, start, stuck)
        for relation in _exits(subject.graph):
            name = subject.name(relation.parent)
            if name not in stuck.lacking or name in told:
                continue
            told.add(name)
            message = (
                f"{start}: the exit waits for {name}, which then does not run. Where either of them "
                "shall end the graph, none may be waited for."
            )
            subject.report(
                "H8", severity, message, relation=relation, member="/required",
                fix="not-required" if is_mend else None,
            )  # fmt: skip


def _report_outputs(subject: Subject, severity: Severity, start: str, stuck: _Stuck) -> None:
    owner = exit_owner(subject.graph)
    if owner is None:
        return
    names = {p.path for p in owner.outputs}
    message = (
        f"{start}: the engine makes the outputs of {owner.full_name} ({joined(names)}) inputs of the "
        f"exit, and {stuck.last} does not give them. Outputs that are not required are not waited for."
    )
    subject.report(
        "H8", severity, message, action=owner, member="/output_parameters", fix="outputs-optional"
    )


def _exits(graph: Graph) -> list[Relation]:
    return [relation for relation in graph.relations if relation.child == EXIT]


def _mended(graph: Graph, lacking: set[str]) -> Graph:
    """The graph whose exit does not wait for these, nor for outputs."""
    names = {action.key: action.full_name for action in graph.actions}
    relations = tuple(
        msgspec.structs.replace(r, required=r.required and names.get(r.parent) not in lacking)
        if r.child == EXIT
        else r
        for r in graph.relations
    )
    ends: set[Key] = {r.parent for r in _exits(graph)}
    actions = tuple(with_optional_outputs(a) if a.key in ends else a for a in graph.actions)
    return msgspec.structs.replace(graph, relations=relations, actions=actions)


def _never_stuck(subject: Subject, mended: Graph) -> bool:
    """Whether a graph then ends in every trial, and never while something runs, whichever of what
    runs side by side is quicker."""
    size = max(len(subject.real), len(subject.relations))
    for number, (action, outcome) in enumerate(_trials(subject)):
        if 2 * number * size >= BUDGET:
            return True
        for slower_first in (False, True):
            for trace in _tried(mended, action, outcome, slower_first=slower_first):
                match trace:
                    case Hazard(code="H12" | "H8", graph=name) if name == mended.name:
                        return False
                    case _:
                        pass
    return True


# Trials


def _trials(subject: Subject, every: bool = False) -> Iterator[_Trial]:
    """Which action ends how; `every`: also where all children ignore it. An exit that does may
    still wait for the outputs."""
    yield None, ""
    for action in subject.real:
        outgoing = subject.outgoing.get(action.key, [])
        answers = {o: [r.conditions.answer(o) for r in outgoing] for o in PRECONDITIONS}
        ends = any(relation.child == EXIT for relation in outgoing)
        for outcome in ("on_false", "on_error"):
            asked = every or ends or any(answer != "ignore" for answer in answers[outcome])
            if asked and answers[outcome] != answers["on_true"]:
                yield action, outcome


def halted(subject: Subject) -> str | None:
    """In which case a graph ends HALTED, in words; None if no trial does."""
    size = max(len(subject.real), len(subject.relations))
    for number, (action, outcome) in enumerate(_trials(subject, every=True)):
        if number * size >= BUDGET:
            break
        for trace in _tried(subject.graph, action, outcome):
            if isinstance(trace, GraphState) and trace.state == "HALTED":
                return f"if {action.full_name} ends with {outcome}" if action else "in any case"
    return None


def _tried(
    graph: Graph, action: Action | None, outcome: str, *, slower_first: bool = False
) -> Iterator[Trace]:
    """The trace of a trial: the first run of one action ends otherwise."""
    real = [other for other in graph.actions if not other.missing]
    places = range(len(real), 0, -1) if slower_first else range(len(real))
    behaviours: dict[str, tuple[Behaviour, ...]] = {
        other.full_name: (Behaviour(after_s=1 + place / 1000),)
        for place, other in zip(places, real, strict=True)
    }
    if action is not None:
        usual = behaviours[action.full_name][0]
        other_end = Behaviour(after_s=usual.after_s, result=outcome)
        behaviours[action.full_name] = (other_end, usual)
    events = 20 * len(real) + 100
    return simulate(graph, script=Script(behaviours), max_events=events)


def _stuck(graph: Graph, action: Action | None, outcome: str) -> _Stuck | None:
    """What the graph waits for in the end, or None if it does not."""
    waits: dict[str, str] = {}
    asked: dict[str, None] = {}
    for trace in _tried(graph, action, outcome):
        match trace:
            case EdgeEval(edge=edge) if edge.endswith(f" => {EXIT_NODE}"):
                asked[edge.partition(" => ")[0]] = None
            case NotReady(node=node, why=why):
                waits[node] = why
                last = next(reversed(asked), "") if node == EXIT_NODE else ""
            case Hazard(code="H8", graph=name) if name == graph.name:
                if not waits:
                    return _Stuck()
                node, why = list(waits.items())[-1]
                inputs = "inputs=missing" in why
                if node != EXIT_NODE:
                    return _Stuck(node, inputs)
                names = {a.key: a.full_name for a in graph.actions}
                wanted = {names.get(r.parent, "") for r in _exits(graph) if r.required}
                return _Stuck(node, inputs, frozenset(wanted - set(asked)), last)
            case _:
                pass
    return None


def _told(subject: Subject, stuck: _Stuck) -> str | None:
    if not stuck.node:
        return "nothing runs any more"
    if not stuck.inputs:
        return f"{stuck.node} still waits for parents that are required and did not run"
    if any("pvf_allowed_values" in p.text for a in subject.real for p in a.inputs):
        return None  # which values actions give is not known
    return f"{stuck.node} still waits for inputs"
