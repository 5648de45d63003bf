"""Whether and how a graph gets from its entry to its exit (SPEC 2.3; H2, H3, H4, H8, H12)."""

from collections import deque

from action_assistant.umrf.checks.loops import ENDS, check_instant_loops, check_spontaneous, loops
from action_assistant.umrf.checks.places import Subject, joined
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    PRECONDITIONS,
    Key,
    Precondition,
    Relation,
    Severity,
)


def check_flow(subject: Subject) -> None:
    """Reports all of it."""
    _check_sides(subject)
    _check_bypasses(subject)
    _check_responses(subject)
    if not subject.real:
        subject.report(
            "empty", "warning", "The graph has no actions; it ends as soon as it starts."
        )
        return
    if not subject.outgoing.get(ENTRY):
        message = "No action is connected to the entry: the graph is HALTED as soon as it starts."
        subject.report("no-entry", "error", message, member="/graph_entry")
        return
    reach = Reach(subject)
    _check_waiting(subject, reach)
    _check_exit(subject, reach)
    check_spontaneous(subject)
    check_instant_loops(subject, reach.runs)
    _check_stragglers(subject)


def _check_sides(subject: Subject) -> None:
    for relation in subject.relations:
        ends = [subject.actions.get(key) for key in (relation.parent, relation.child)]
        if relation.only is None or any(end and end.missing for end in ends):
            continue
        parent, child = subject.name(relation.parent), subject.name(relation.child)
        if relation.only == "children":
            message = (
                f"{parent} lists {child} as its child, {child} does not list {parent} as its "
                f"parent: when {parent} ends, the engine and every running graph with it abort."
            )
            subject.report("H2", "error", message, relation=relation, fix="mirror-relation")
        else:
            message = (
                f"{child} lists {parent} as its parent, {parent} does not list {child} as its "
                f"child: {parent} never starts it."
            )
            severity: Severity = "error" if relation.required else "warning"
            subject.report("H2b", severity, message, relation=relation, fix="mirror-relation")


def _check_bypasses(subject: Subject) -> None:
    if "H3" not in subject.facts.hazards or subject.facts.bypass_fixed:
        return
    for relation in subject.sound:
        outcomes = [p for p in PRECONDITIONS if relation.conditions.answer(p) == "bypass"]
        if not outcomes or relation.child == EXIT or relation.parent == ENTRY:
            continue
        message = (
            f"If {subject.name(relation.parent)} ends with {' or '.join(outcomes)}, "
            f"{subject.name(relation.child)} is bypassed: this engine then reads freed memory and "
            "may abort with every running graph."
        )
        subject.report("H3", "warning", message, relation=relation, member="/conditions")


def _check_responses(subject: Subject) -> None:
    """What a response does to a child that is in the wrong state."""
    for key, relations in subject.incoming.items():
        if key == EXIT:
            continue
        by_answer: dict[str, set[Key]] = {}
        for relation in relations:
            for outcome in PRECONDITIONS if relation.parent != ENTRY else ("on_true",):
                by_answer.setdefault(relation.conditions.answer(outcome), set()).add(
                    relation.parent
                )
        runs = by_answer.get("run", set()) - {ENTRY}
        for answer in ("pause", "stop"):
            others = by_answer.get(answer, set())
            if others and runs - others:
                who = joined({subject.name(k) for k in runs - others})
                message = (
                    f"{who} may run {subject.name(key)} just when {joined({subject.name(k) for k in others})} "
                    f"{answer}s it: this engine then aborts with every running graph."
                )
                subject.report("H4", "warning", message, action=subject.actions[key])
        if by_answer.get("pause") and by_answer.get("stop"):
            message = f"{subject.name(key)} may be stopped while it is paused: it ends in ERROR after 5 s."
            subject.report("H5", "warning", message, action=subject.actions[key])
    for relation in subject.sound:
        _check_without_effect(subject, relation)


def _check_without_effect(subject: Subject, relation: Relation) -> None:
    if relation.child == EXIT or relation.parent == ENTRY:
        return
    answers = {outcome: relation.conditions.answer(outcome) for outcome in PRECONDITIONS}
    parent, child = subject.name(relation.parent), subject.name(relation.child)
    if "restart" in answers.values():
        message = f"“restart” does nothing in this engine; {child} is not started again."
        subject.report("restart", "warning", message, relation=relation, member="/conditions")
    if relation.parent == relation.child and "run" in answers.values():
        message = f"{child} cannot run itself again: it still runs when it is asked."
        subject.report("self-loop", "warning", message, relation=relation, member="/conditions")
    if "pause" in answers.values():
        message = f"When {parent} pauses {child}, only a pause and a resume of the whole graph wake it again."
        subject.report("H5", "warning", message, relation=relation, member="/conditions")


class Reach:
    """What can happen at all: which actions can run, and which can report an end.

    `stages` tell in which order: a parent that reports before its child ran is none of a loop.
    """

    def __init__(self, subject: Subject) -> None:
        self.subject = subject
        self.runs: set[Key] = set()
        self.reports: dict[Key, set[Precondition]] = {ENTRY: {"on_true"}}
        self.asked: set[Key] = set()
        self._triggered: set[Key] = set()
        self._waiting: dict[Key, int] = {
            key: sum(relation.required for relation in _first(subject.parents.get(key, [])))
            + sum(relation.required for relation in _first(relations) if relation.parent == ENTRY)
            for key, relations in subject.incoming.items()
        }
        self._open = deque[Key]([ENTRY])
        self._seen: set[tuple[Key, Key]] = set()
        while self._open:
            self._follow(self._open.popleft())

    def _follow(self, key: Key) -> None:
        outcomes = self.reports[key]
        for relation in self.subject.outgoing.get(key, []):
            if relation.listing:
                continue
            child = relation.child
            self.asked.add(child)
            if relation.required and (key, child) not in self._seen:
                self._waiting[child] -= 1
            self._seen.add((key, child))
            answers = {relation.conditions.answer(o): o for o in outcomes}
            if key == ENTRY:
                answers = {"run": "on_true"}
            passed: set[Precondition] = {
                o for o in outcomes if relation.conditions.answer(o) == "bypass"
            }
            if passed and key != ENTRY:
                self._report(child, passed)
            if "run" in answers or (child == EXIT and set(answers) - {"ignore"}):
                self._triggered.add(child)
            if "stop" in answers and child in self.runs:
                self._report(child, {"on_stopped"})
            if child in self._triggered and self._waiting.get(child, 0) <= 0:
                self._run(child, "stop" in answers)

    def _run(self, key: Key, may_stop: bool) -> None:
        self.runs.add(key)
        ends: set[Precondition] = set(ENDS)
        if may_stop or self._can_be_stopped(key):
            ends.add("on_stopped")
        self._report(key, ends)

    def _can_be_stopped(self, key: Key) -> bool:
        return any(
            "stop" in {r.conditions.answer(o) for o in PRECONDITIONS}
            for r in self.subject.incoming.get(key, [])
        )

    def _report(self, key: Key, outcomes: set[Precondition]) -> None:
        known = self.reports.setdefault(key, set())
        if not outcomes <= known:
            known |= outcomes
            self._open.append(key)


def _first(relations: list[Relation]) -> list[Relation]:
    return [relation for relation in relations if not relation.listing]


def _check_waiting(subject: Subject, reach: Reach) -> None:
    """Actions that never run, and why."""
    net: dict[Key, int] = {}
    for number, members in enumerate(loops(subject)):
        net.update(dict.fromkeys(members, number))
    for action in subject.real:
        if action.key in reach.runs:
            continue
        missing = [
            relation
            for relation in _first(subject.parents.get(action.key, []))
            if relation.required and not reach.reports.get(relation.parent)
        ]
        if action.key not in reach.asked:
            message = f"{action.full_name} cannot be reached from the entry; it never runs."
            subject.report("unreachable", "warning", message, action=action)
        elif missing:
            _report_missed_join(subject, action.key, missing, net)
        else:
            message = f"Nothing ever answers run for {action.full_name}; it never runs."
            subject.report("never-run", "warning", message, action=action)


def _report_missed_join(
    subject: Subject, key: Key, missing: list[Relation], net: dict[Key, int]
) -> None:
    """`net`: the number of the net of loops in which an action lies."""
    action = subject.actions[key]
    for relation in missing:
        parent = subject.name(relation.parent)
        if key in net and net.get(relation.parent) == net[key]:
            message = (
                f"{action.full_name} waits for {parent}, which comes after it: it never runs and the "
                "graph stays RUNNING for ever. A way back must not be required."
            )
            subject.report(
                "H8", "error", message, relation=relation, member="/required", fix="not-required"
            )
        else:
            message = (
                f"{action.full_name} waits for {parent}, which never ends: it never runs and the "
                "graph may stay RUNNING for ever."
            )
            subject.report("H8", "error", message, relation=relation, member="/required")


def _check_exit(subject: Subject, reach: Reach) -> None:
    exits = subject.incoming.get(EXIT, [])
    if not exits:
        message = (
            "No action leads to the exit: the graph ends HALTED, or never, but never FINISHED."
        )
        subject.report("no-exit", "warning", message, member="/graph_exit")
        return
    if any(problem.code == "H8" for problem in subject.problems):
        return  # why no parent of the exit ends is said already
    for relation in exits:
        if relation.required and not reach.reports.get(relation.parent):
            message = (
                f"The exit waits for {subject.name(relation.parent)}, which never ends: unless "
                "another way bypasses into the exit, the graph stays RUNNING for ever."
            )
            subject.report("H8", "warning", message, relation=relation, member="/required")


def _check_stragglers(subject: Subject) -> None:
    """H12: ways to the exit that do not wait for what still runs."""
    if "H12" not in subject.facts.hazards:
        return
    for relation in _first(subject.incoming.get(EXIT, [])):
        siblings = {
            other.child
            for other in subject.outgoing.get(relation.parent, [])
            if other.child != EXIT and _shares_answer(other, relation)
        }
        if siblings:
            who = joined({subject.name(key) for key in siblings})
            message = (
                f"When {subject.name(relation.parent)} ends, the graph is FINISHED although {who} "
                "runs on: the engine then ignores every stop of the graph."
            )
            subject.report("H12", "warning", message, relation=relation)
    fork = _parallel(subject)
    if fork is None:
        return
    for relation in subject.incoming.get(EXIT, []):
        early = not relation.required and len(subject.incoming[EXIT]) > 1
        bypasses = [p for p in ENDS if relation.conditions.answer(p) == "bypass"]
        if early or bypasses:
            why = f"ends with {' or '.join(bypasses)}" if bypasses else "ends first"
            message = (
                f"If {subject.name(relation.parent)} {why}, the graph is FINISHED while what "
                f"{fork} started may run on: the engine then ignores every stop of the graph."
            )
            subject.report("H12", "warning", message, relation=relation, member="/conditions")


def _shares_answer(other: Relation, to_exit: Relation) -> bool:
    return any(
        other.conditions.answer(o) == "run" and to_exit.conditions.answer(o) != "ignore"
        for o in ENDS
    )


def _parallel(subject: Subject) -> str | None:
    """The name of something that starts two actions at once, if there is any."""
    for key, relations in subject.outgoing.items():
        for outcome in ENDS:
            started = [
                r
                for r in relations
                if r.child != EXIT and (key == ENTRY or r.conditions.answer(outcome) == "run")
            ]
            if len(started) > 1:
                return subject.name(key)
    return None
