"""Checks for problems of two things that happen at once: a response that comes at the wrong moment,
and an end that leaves an action running. Only what can happen is reported.

See docs/umrf-and-the-engine.md 2.3 and 2.5; H4, H5, H12, H14.
"""

from collections.abc import Collection, Container, Iterator, Mapping
from typing import Final

import msgspec

from action_assistant.umrf.checks.concurrency import Concurrency
from action_assistant.umrf.checks.places import Subject, joined, more
from action_assistant.umrf.components import nodes_in
from action_assistant.umrf.courses.network import Network
from action_assistant.umrf.courses.simulated import simulated_outcome
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    PRECONDITIONS,
    Action,
    Graph,
    Key,
    Precondition,
    Relation,
    Severity,
)

#: The most arrows to the exit that are examined one by one; the others count if they equal the first one reported.
_ENDS: Final = 200
_Reports = Mapping[Key, Collection[Precondition]]


def check_responses(
    subject: Subject,
    reports: _Reports,
    concurrency: Concurrency,
    nested: Container[str] = frozenset(),
) -> None:
    """Report responses that may reach a child in a state in which the engine aborts or does nothing
    (hazards H4, H5). `reports`: the outcomes that each action can report, by key; `concurrency`:
    which actions can run at the same time. `nested`: names of actions that are sub-graphs; a
    sub-graph runs without loading first."""
    killed: set[Key] = set()
    for key, relations in subject.incoming.items():
        if key == EXIT:
            continue
        asking = _asking(relations, reports)
        runs = {k for k, _ in asking.get("run", ())} - {ENTRY}
        met: dict[str, set[Key]] = {}
        for answer in ("pause", "stop"):
            # Only a running action can be paused or stopped, and only after that does `run` end the engine.
            others = {k for k, o in asking.get(answer, ()) if concurrency.may_run_at(key, k, o)}
            late = {k for k in runs - others if concurrency.may_run(k, key)}
            met[answer] = others
            if others and late and key not in killed:
                killed.add(key)
                message = (
                    f"{_names(subject, late)} may run {subject.name(key)} just when "
                    f"{_names(subject, others)} {answer}s it: this engine then aborts with every "
                    "running graph."
                )
                subject.report("H4", "warning", message, action=subject.actions[key])
        if met["pause"] and met["stop"]:
            message = f"{subject.name(key)} may be stopped while it is paused: it ends in ERROR after 5 s."
            subject.report("H5", "warning", message, action=subject.actions[key])
        early = {
            k for k, o in asking.get("run", ()) if k != key and concurrency.may_run_at(key, k, o)
        }
        if early and key not in killed and subject.name(key).rpartition("_")[0] not in nested:
            message = (
                f"{_names(subject, early)} may run {subject.name(key)} while it still loads for somebody "
                "else (its library, its onInit): this engine then aborts with every running graph."
            )
            subject.report("H4", "warning", message, action=subject.actions[key])
    for relation in subject.sound:
        _check_without_effect(subject, relation, reports.get(relation.parent, ()), concurrency)


def _asking(
    relations: list[Relation], reports: _Reports
) -> dict[str, set[tuple[Key, Precondition]]]:
    """Return, for each response, the parents that can cause it by one of these relations to a
    child, each with the outcome that does. `reports`: the outcomes that each action can report, by
    key."""
    found: dict[str, set[tuple[Key, Precondition]]] = {}
    for relation in relations:
        reported = reports.get(relation.parent, ())
        for outcome in PRECONDITIONS if relation.parent != ENTRY else ("on_true",):
            if outcome in reported:
                answer = relation.conditions.answer(outcome)
                found.setdefault(answer, set()).add((relation.parent, outcome))
    return found


def _names(subject: Subject, keys: Collection[Key]) -> str:
    return joined({subject.name(key) for key in keys})


def _check_without_effect(
    subject: Subject,
    relation: Relation,
    reported: Collection[Precondition],
    concurrency: Concurrency,
) -> None:
    if relation.child == EXIT or relation.parent == ENTRY:
        return
    answers = {o: relation.conditions.answer(o) for o in PRECONDITIONS if o in reported}
    parent, child = subject.name(relation.parent), subject.name(relation.child)
    if "restart" in answers.values():
        message = f"“restart” does nothing in this engine; {child} is not started again."
        subject.report("restart", "warning", message, relation=relation, member="/conditions")
    if relation.parent == relation.child and "run" in answers.values():
        message = f"{child} cannot run itself again: it still runs when it is asked."
        subject.report("self-loop", "warning", message, relation=relation, member="/conditions")
    pausing = [o for o, answer in answers.items() if answer == "pause"]
    if any(concurrency.may_run_at(relation.child, relation.parent, o) for o in pausing):
        message = f"When {parent} pauses {child}, only a pause and a resume of the whole graph wake it again."
        subject.report("H5", "warning", message, relation=relation, member="/conditions")


# Ends that leave something running


def check_loading(
    subject: Subject,
    reports: _Reports,
    concurrency: Concurrency,
    nested: Container[str] = frozenset(),
) -> None:
    """Report as one problem (hazard H14) all ends of actions that halt the graph while another
    action may still load. `reports`: the outcomes that each action can report, by key;
    `concurrency`: which actions can run at the same time; `nested`: names of sub-graphs, which need
    no loading. An end with on_error is reported only if it starts an action and halts the graph by
    itself: otherwise every graph that ignores the errors of one branch would get this problem,
    though an action would have to fail while another one loads."""
    if "H14" not in subject.facts.hazards:
        return
    runs_at_once = {action.key for action in subject.real if action.name in nested}
    found: list[tuple[Action, Precondition, set[Key]]] = []
    for outcome in PRECONDITIONS:
        for action in subject.real if outcome != "on_error" else ():
            if outcome not in reports.get(action.key, ()):
                continue
            listed = subject.outgoing.get(action.key, [])
            if any(r.conditions.answer(outcome) != "ignore" for r in listed) or len(found) > _ENDS:
                continue
            if beside := concurrency.running_after(action.key, outcome) - runs_at_once:
                found.append((action, outcome, beside))
    failing = list(_failing_starts(subject, reports, runs_at_once))
    if not found and not failing:
        return
    others = more(len(found) + len(failing) - 1, "end", "ends")
    if failing:
        action, bypassed, started = failing[0]
        message = (
            f"If {action.full_name} ends with on_error, {subject.name(bypassed)} is bypassed, nothing "
            f"follows that, and the graph is HALTED while {_shortened(subject, started)} still loads (its "
            "library, its onInit): this engine does not count what loads as running. It then runs all "
            f"the same, and nothing follows it.{others}"
        )
        subject.report("H14", "warning", message, action=action)
        return
    action, outcome, beside = found[0]
    who = _shortened(subject, beside)
    who = who if len(beside) == 1 else f"one of {who}"
    message = (
        f"If {action.full_name} ends with {outcome} while {who} still loads (its library, its onInit), "
        "the graph is HALTED: this engine does not count what loads as running. It "
        f"then runs all the same, and nothing follows it.{others}"
    )
    subject.report("H14", "warning", message, action=action)


def _failing_starts(
    subject: Subject, reports: _Reports, runs_at_once: Container[Key]
) -> Iterator[tuple[Action, Key, set[Key]]]:
    """Yield each action whose end with on_error starts other actions and bypasses one action from
    which no arrow goes on. With it come the key of the bypassed action and the keys of the started
    actions that wait for no other parent. `runs_at_once`: actions that need no loading, which are
    ignored."""
    for action in subject.real:
        if "on_error" not in reports.get(action.key, ()):
            continue
        answers = {r.child: r.conditions.on_error for r in subject.outgoing.get(action.key, [])}
        started = {
            child
            for child, answer in answers.items()
            if answer == "run" and child not in {EXIT, action.key} and child not in runs_at_once
            if all(r.parent == action.key for r in subject.incoming[child] if r.required)
        }
        for child, answer in answers.items() if started else ():
            leading = subject.outgoing.get(child, [])
            halts = all(r.conditions.on_error == "ignore" for r in leading)
            if answer == "bypass" and child != EXIT and halts:
                yield action, child, started
                break


def check_endless(subject: Subject, concurrency: Concurrency) -> None:
    """Report as one problem (hazard H12) all spontaneous actions that continue when the graph is
    FINISHED. They begin again and again, and no stop reaches them. The problem is an error if this
    happens even when all actions end with on_true, else a warning. `concurrency`: which actions can
    run at the same time."""
    lively = {action.key for action in subject.real if action.type == "spontaneous"}
    if "H12" not in subject.facts.hazards or not lively:
        return
    found: list[tuple[Relation, list[Precondition], set[Key]]] = []
    for relation in subject.incoming.get(EXIT, [])[:_ENDS]:
        left: set[Key] = set()
        outcomes: list[Precondition] = []
        for outcome in PRECONDITIONS:
            if going := _going_on(subject, relation, outcome, lively, concurrency):
                outcomes.append(outcome)
                left |= going
        if outcomes and not relation.listing:
            found.append((relation, outcomes, left))
    if not found:
        return
    certain = _endless_when_well(subject.graph)
    relation, outcomes, left = next(
        (each for each in found if certain and certain & _full_names(subject, each[2])), found[0]
    )
    end = subject.name(relation.parent)
    rest = more(len(found) - 1, "way to the exit", "ways to the exit")
    goes_on = f"begins again and again: the engine then ignores every stop of the graph.{rest}"
    also = [each for each, _, _ in found if each is not relation]
    who, when = min(certain or _full_names(subject, left)), "If all goes well"
    if not certain:
        when = f"If {end} ends with {' or '.join(outcomes)}"
        when += "" if who == end else f" while {who} runs"
    message = f"{when}, the graph is FINISHED, and {who}, which is spontaneous, {goes_on}"
    severity: Severity = "error" if certain else "warning"
    subject.report("H12", severity, message, relation=relation, member="/conditions", also=also)


def _going_on(
    subject: Subject,
    relation: Relation,
    outcome: Precondition,
    lively: Collection[Key],
    concurrency: Concurrency,
) -> set[Key]:
    """Return the keys of spontaneous actions that may continue after the parent of an arrow to the
    exit (`relation`) has reported this outcome. `lively`: the keys of all spontaneous actions."""
    parent = relation.parent
    if relation.conditions.answer(outcome) == "ignore":
        return set()
    going = concurrency.running_after(parent, outcome)
    if concurrency.may_outlast(parent, outcome):
        going = going | {parent}
    stopped = {
        r.child for r in subject.outgoing.get(parent, []) if r.conditions.answer(outcome) == "stop"
    }
    return (going & set(lively)) - stopped


def _full_names(subject: Subject, keys: Collection[Key]) -> set[str]:
    return {subject.name(key) for key in keys}


def _endless_when_well(graph: Graph) -> set[str]:
    """Return the full names of the spontaneous actions that continue after all other actions have
    ended with on_true and the graph is FINISHED.

    An action is returned only if it continues in both simulated orders, in which the earlier or the
    later of two concurrent actions ends first.
    """
    found: list[set[str]] = []
    for slower_first in (False, True):
        net = Network(graph, slower_first=slower_first)
        end, _ = simulated_outcome(net, graph, "", "on_true")
        if end.kind == "finished":
            found.append({net.names[place] for place in nodes_in(end.endless)})
    return set.intersection(*found) if found else set()


class _EarlyExit(msgspec.Struct, frozen=True):
    """An arrow to the exit that may finish the graph while other actions still run.

    `left`: the keys of these actions. `bypassed`: the outcomes by which the arrow bypasses the
    exit, so that the exit waits for no other parent. `started`: True if the arrow's parent starts
    actions of `left` when it ends.
    """

    relation: Relation
    left: frozenset[Key]
    bypassed: tuple[Precondition, ...]
    started: bool


def check_stragglers(subject: Subject, reports: _Reports, concurrency: Concurrency) -> None:
    """Report as one problem (hazard H12) all arrows to the exit by which the graph is FINISHED
    while other actions may still run. `reports`: the outcomes that each action can report, by key;
    `concurrency`: which actions can run at the same time."""
    if "H12" not in subject.facts.hazards:
        return
    incoming = [r for r in subject.incoming.get(EXIT, []) if not r.listing]
    found = [
        early
        for relation in incoming[:_ENDS]
        if (early := _early(subject, relation, incoming, reports, concurrency)) is not None
    ]
    if not found:
        return
    first = found[0]
    who, end = _shortened(subject, first.left), subject.name(first.relation.parent)
    if first.started:
        start = f"When {end} ends, the graph is FINISHED although {who} runs on"
    else:
        how = f"ends with {' or '.join(first.bypassed)}" if first.bypassed else "ends first"
        start = f"If {end} {how}, the graph is FINISHED while {who} may run on"
    alike = [r for r in incoming[_ENDS:] if _same(r, first.relation)]
    rest = more(len(found) - 1 + len(alike), "way to the exit", "ways to the exit")
    message = f"{start}: the engine then ignores every stop of the graph.{rest}"
    others = [early.relation for early in found[1:]] + alike
    subject.report(
        "H12", "warning", message, relation=first.relation, member="/conditions", also=others
    )


def _same(one: Relation, other: Relation) -> bool:
    return one.required == other.required and one.conditions == other.conditions


def _shortened(subject: Subject, keys: Collection[Key]) -> str:
    names = sorted(_full_names(subject, keys))
    shown = joined(set(names[:3]))
    return shown if len(names) <= 3 else f"{shown} or one of {len(names) - 3:,} others"


def _early(
    subject: Subject,
    relation: Relation,
    incoming: list[Relation],
    reports: _Reports,
    concurrency: Concurrency,
) -> _EarlyExit | None:
    bypassed: list[Precondition] = []
    left: set[Key] = set()
    others = [r.parent for r in incoming if r.required and r.parent != relation.parent]
    started = False
    for outcome in PRECONDITIONS:
        answer = relation.conditions.answer(outcome)
        if outcome not in reports.get(relation.parent, ()) or answer == "ignore":
            continue
        waited = () if answer == "bypass" else others
        around = concurrency.running_after(relation.parent, outcome, waited)
        if answer == "bypass" and concurrency.may_outlast(relation.parent, outcome):
            around = around | {relation.parent}
        around = {key for key in around if subject.actions[key].type != "spontaneous"}
        begun = _begun(subject, relation.parent, outcome) & around
        if answer == "bypass":
            if around:
                bypassed.append(outcome)
                left |= around
            continue
        if not concurrency.known and not begun and (relation.required or len(incoming) == 1):
            continue  # the exit waits for others, and it is not known for which
        if not around or _comes_after(subject, relation.parent, others):
            continue
        started = started or bool(begun)
        left |= around
    if not left:
        return None
    return _EarlyExit(relation, frozenset(left), tuple(bypassed), started and not bypassed)


def _begun(subject: Subject, key: Key, outcome: Precondition) -> set[Key]:
    return {
        r.child
        for r in subject.outgoing.get(key, [])
        if r.child != EXIT and r.conditions.answer(outcome) == "run"
    }


def _comes_after(subject: Subject, key: Key, others: list[Key]) -> bool:
    """Return whether the graph's exit is reached only after the action `key`: the exit waits for
    all of the actions `others`, and at least one of these cannot be reached from the entry except
    through `key`. False without `others`."""
    if not others:
        return False
    seen, stack = {ENTRY}, [ENTRY]
    while stack:
        for relation in subject.outgoing.get(stack.pop(), []):
            if relation.child not in seen and relation.child != key:
                seen.add(relation.child)
                stack.append(relation.child)
    return any(other not in seen for other in others)
