"""Checks whether and how a graph gets from its entry to its exit, and what its loops do to the engine.

See docs/umrf-and-the-engine.md 2.3, 2.9 and 2.10; H2, H3, H5, H8 and H9.
"""

from collections import deque
from collections.abc import Callable, Collection, Container, Mapping
from typing import NamedTuple

from action_assistant.umrf.checks.concurrency import Concurrency
from action_assistant.umrf.checks.overlaps import (
    check_endless,
    check_loading,
    check_responses,
    check_stragglers,
)
from action_assistant.umrf.checks.places import Subject, more
from action_assistant.umrf.components import components
from action_assistant.umrf.json.text import parse_small
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    OUTCOMES,
    PRECONDITIONS,
    Action,
    Key,
    Precondition,
    Relation,
    Severity,
)


def check_spontaneous(subject: Subject) -> None:
    """Report in `subject` the spontaneous actions from which a loop can be reached (hazard H9)."""
    spontaneous = [action for action in subject.real if action.type == "spontaneous"]
    if not spontaneous:
        return
    doomed = _leading_to(subject, set().union(*loops(subject)))
    for action in spontaneous:
        if action.key in doomed:
            message = (
                f"{action.full_name} is spontaneous and leads into a loop: at its first end the "
                "engine recurses until it dies, with every running graph."
            )
            subject.report("H9", "error", message, action=action, member="/type")


def check_instant_loops(
    subject: Subject, runs: Collection[Key], reports: Mapping[Key, Collection[Precondition]]
) -> None:
    """Report each loop of actions, none of which is declared to take time (hazard H5): if all its
    actions end at once, the engine blocks itself and obeys no stop. `runs`: keys of the actions
    that can run; a loop with any other action is not reported. `reports`: the outcomes with which
    each action can end, by key."""
    if "H5" not in subject.facts.hazards:
        return

    def goes_round(relation: Relation) -> bool:
        reported = reports.get(relation.parent, ())
        answers = {relation.conditions.answer(o) for o in OUTCOMES if o in reported}
        return relation.parent != relation.child and bool(answers & {"run", "bypass"})

    for loop in loops(subject, goes_round):
        members = [subject.actions[key] for key in loop if key in runs]
        if len(members) < len(loop) or any(map(_takes_time, members)):
            continue
        names = [member.full_name for member in members]
        shown = ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
        message = (
            f"{shown} are a loop. If all of them end at once, the engine blocks itself within "
            "milliseconds and obeys no stop any more; let at least one take some time."
        )
        subject.report("H5", "warning", message, action=members[0])


def _takes_time(action: Action) -> bool:
    """Return whether a person has declared `"takes_time": true` in the action's `gui_attributes`
    (decision 56)."""
    attributes = parse_small(dict(action.extra).get("gui_attributes", "null"))
    return isinstance(attributes, dict) and attributes.get("takes_time") is True


def _leading_to(subject: Subject, keys: set[Key]) -> set[Key]:
    """Return the keys in `keys`, with those of all actions from which a path of arrows leads to any
    of them."""
    found = set(keys)
    stack = list(keys)
    while stack:
        for relation in subject.incoming.get(stack.pop(), []):
            if relation.parent not in found:
                found.add(relation.parent)
                stack.append(relation.parent)
    return found


def loops(
    subject: Subject, follows: Callable[[Relation], bool] = lambda _: True
) -> list[list[Key]]:
    """Return the actions that lie on loops, in groups of keys: each group is one loop, or several
    loops that share actions. Only arrows that `follows` accepts are followed."""
    number = {action.key: place for place, action in enumerate(subject.real)}
    ways = [
        [number[r.child] for r in subject.outgoing.get(key, []) if r.child in number and follows(r)]
        for key in number
    ]
    return [
        [subject.real[place].key for place in members]
        for members in components(ways)
        if len(members) > 1 or members[0] in ways[members[0]]
    ]


class Flow(NamedTuple):
    """The ways that a graph can take: which actions can run, and which at the same time."""

    reachability: "Reachability"
    concurrency: Concurrency


def follow(subject: Subject) -> Flow:
    """Return which actions of a graph can run, with which outcomes, and which at the same time, by
    following its arrows from the entry."""
    reachability = Reachability(subject)
    return Flow(reachability, Concurrency(subject, reachability.runs, reachability.reports))


def check_flow(subject: Subject, nested: Container[str] = frozenset()) -> Flow | None:
    """Report all problems of the graph's flow from entry to exit in `subject`, and return the
    result of `follow`; None for a graph without actions or without an arrow from the entry.
    `nested`: names of actions that are sub-graphs."""
    _check_sides(subject)
    if not subject.real:
        subject.report(
            "empty", "warning", "The graph has no actions; it ends as soon as it starts."
        )
        return None
    if not subject.outgoing.get(ENTRY):
        message = "No action is connected to the entry: the graph is HALTED as soon as it starts."
        subject.report("no-entry", "error", message, member="/graph_entry")
        return None
    flow = follow(subject)
    reachability, concurrency = flow
    _check_bypasses(subject, reachability)
    check_responses(subject, reachability.reports, concurrency, nested)
    check_loading(subject, reachability.reports, concurrency, nested)
    _check_waiting(subject, reachability)
    _check_exit(subject, reachability)
    check_spontaneous(subject)
    check_instant_loops(subject, reachability.runs, reachability.reports)
    check_endless(subject, concurrency)
    check_stragglers(subject, reachability.reports, concurrency)
    return flow


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


def _check_bypasses(subject: Subject, reachability: "Reachability") -> None:
    """Report arrows that can bypass their child (hazard H3): the child is skipped because of an
    outcome that its parent can really have. All such arrows are reported as one problem. Nothing is
    reported for engine builds without the hazard."""
    if "H3" not in subject.facts.hazards or subject.facts.bypass_fixed:
        return
    found: list[tuple[Relation, list[Precondition]]] = []
    for relation in sorted(subject.sound, key=subject.place):
        if relation.child == EXIT or relation.parent == ENTRY:
            continue
        reported = reachability.reports.get(relation.parent, set())
        outcomes = [
            o for o in PRECONDITIONS if o in reported and relation.conditions.answer(o) == "bypass"
        ]
        if outcomes:
            found.append((relation, outcomes))
    if not found:
        return
    first, outcomes = found[0]
    message = (
        f"If {subject.name(first.parent)} ends with {' or '.join(outcomes)}, "
        f"{subject.name(first.child)} is bypassed: this engine then reads freed memory and "
        f"may abort with every running graph.{more(len(found) - 1, 'bypass', 'bypasses')}"
    )
    others = (relation for relation, _ in found[1:])
    subject.report("H3", "warning", message, relation=first, member="/conditions", also=others)


class Reachability:
    """Finds the actions that can run and the outcomes that each can report, judged by arrows and
    outcomes alone, without values.

    `runs`: actions that can run. `reports`: the outcomes that each action, or the entry, can
    report. `asked`: actions to which an arrow leads from any action that can report.
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
        ends: set[Precondition] = set(OUTCOMES)
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


def _check_waiting(subject: Subject, reachability: Reachability) -> None:
    """Report actions that never run, with the reason: no arrow leads to them from the entry, or a
    required parent never reports."""
    net: dict[Key, int] = {}
    for number, members in enumerate(loops(subject)):
        net.update(dict.fromkeys(members, number))
    for action in subject.real:
        if action.key in reachability.runs:
            continue
        missing = [
            relation
            for relation in _first(subject.parents.get(action.key, []))
            if relation.required and not reachability.reports.get(relation.parent)
        ]
        if action.key not in reachability.asked:
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
    """Report each relation of `missing`, whose parent is required and never reports, so that the
    action `key` never runs. `net`: for each action on a loop, the number of its group of loops."""
    action = subject.actions[key]
    for relation in missing:
        parent = subject.name(relation.parent)
        if key in net and net.get(relation.parent) == net[key]:
            message = (
                f"{action.full_name} waits for {parent}, which comes after it: it never runs and the "
                "graph stays RUNNING for ever. An arrow back must not be required."
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


def _check_exit(subject: Subject, reachability: Reachability) -> None:
    exits = subject.incoming.get(EXIT, [])
    if not exits:
        message = (
            "No action leads to the exit: the graph ends HALTED, or never, but never FINISHED."
        )
        subject.report("no-exit", "warning", message, member="/graph_exit")
        return
    if any(problem.code == "H8" for problem in subject.problems):
        return  # the reason for which no parent of the exit ends is reported already
    for relation in exits:
        if relation.required and not reachability.reports.get(relation.parent):
            message = (
                f"The exit waits for {subject.name(relation.parent)}, which never ends: unless "
                "another way bypasses into the exit, the graph stays RUNNING for ever."
            )
            subject.report("H8", "warning", message, relation=relation, member="/required")
