"""Trial courses of a graph: every action ends with on_true, or one of them ends otherwise the first time.

`check_scenarios` reports the courses after which the graph stays RUNNING for ever (H8).
"""

from collections.abc import Iterator
from typing import Final

import msgspec

from action_assistant.umrf.checks.places import Subject, joined
from action_assistant.umrf.courses.baseline import BaselineCourse, Outcome
from action_assistant.umrf.courses.deviations import DeviatingCourses, SimultaneousEnds
from action_assistant.umrf.courses.network import Network
from action_assistant.umrf.courses.simulated import simulated_outcome
from action_assistant.umrf.fixes import with_optional_outputs
from action_assistant.umrf.model import EXIT, Action, Graph, Key, Precondition, Relation, Severity
from action_assistant.umrf.semantics.parts import exit_inputs, exit_owner
from action_assistant.umrf.semantics.values import slots_of

#: The most states that all trials of one graph may examine, so that a check takes seconds: about 2 µs each.
BUDGET: Final = 5_000_000
#: The cost of one trace event in a trial that is simulated completely.
_EVENT: Final = 20
#: With more actions only the baseline course is tried: the sets of reachable actions take the square of them in bits.
MAX_ACTIONS: Final = 20_000
_OTHERWISE: Final[tuple[Precondition, ...]] = ("on_false", "on_error")


class Trial(msgspec.Struct, frozen=True):
    """One course that was tried, and how it ends. `action`: the action whose first run ends with
    `outcome` while all others end with on_true; None in the baseline course, where all do."""

    action: Action | None
    outcome: str
    end: Outcome

    @property
    def when(self) -> str:
        """The condition of this trial in words, as the beginning of a sentence: "If NAME ends with
        OUTCOME"."""
        if self.action is None:
            return "If all goes well"
        return f"If {self.action.full_name} ends with {self.outcome}"


class Coverage(msgspec.Struct, frozen=True, kw_only=True):
    """The number of courses that were tried (`tried`), of all courses that make a difference
    (`ways`).

    `cut`: how many of the tried courses were followed for four laps only. `first_left`: the first
    course that was not tried, in words.
    """

    ways: int = 0
    tried: int = 0
    cut: int = 0
    first_left: str = ""


class Trials:
    """Iterates over all trial courses of one graph. `slower_first`: if two actions run
    concurrently, the later one in the file ends first."""

    def __init__(self, graph: Graph, *, slower_first: bool = False) -> None:
        self.graph = graph
        self.net = Network(graph, slower_first=slower_first)
        self.actions = {a.full_name: a for a in graph.actions if not a.missing}
        self._plainly = any(action.type == "spontaneous" for action in graph.actions)
        self._spent = 0
        self._others = self._meant()
        self._tried = 0
        self._cut = 0
        self._left = ""

    def __iter__(self) -> Iterator[Trial]:
        course = None if self._plainly else BaselineCourse(self.net)
        if course is not None and course.tied:
            course = None
        usual = course.outcome if course is not None else self._whole("", "on_true")
        yield self._noted(Trial(None, "", usual))
        if usual.kind == "never":
            self._others = []
        deviations = DeviatingCourses(course) if course is not None and self._others else None
        for index, outcome in self._others:
            work = deviations.work if deviations is not None else 0
            if self._spent + work > BUDGET or len(self.net.nodes) > MAX_ACTIONS:
                self._left = f"{self.net.names[index]} with {outcome}"
                return
            end = self._deviating(deviations, index, outcome)
            yield self._noted(Trial(self.actions[self.net.names[index]], outcome, end))

    def coverage(self) -> Coverage:
        """Return how many courses were tried. Call it after the iteration has ended."""
        ways = 1 + len(self._others)
        return Coverage(ways=ways, tried=self._tried, cut=self._cut, first_left=self._left)

    def _noted(self, trial: Trial) -> Trial:
        self._tried += 1
        self._cut += trial.end.cut
        return trial

    def _deviating(
        self, deviations: DeviatingCourses | None, index: int, outcome: Precondition
    ) -> Outcome:
        if deviations is not None:
            try:
                return deviations.outcome(index, outcome)
            except SimultaneousEnds:
                pass  # only the simulated engine knows the order
        return self._whole(self.net.names[index], outcome)

    def _whole(self, full_name: str, outcome: Precondition) -> Outcome:
        end, events = simulated_outcome(self.net, self.graph, full_name, outcome)
        self._spent += _EVENT * events
        return end

    def _meant(self) -> list[tuple[int, Precondition]]:
        """Return the deviations (index of an action, outcome of its first run) that can make a
        difference.

        A deviation does so if a child responds to this outcome otherwise than to on_true, if a
        bypass passes the outcome on, or if the outputs that a failed action lacks matter.
        """
        found: list[tuple[int, Precondition]] = []
        for index, row in enumerate(self.net.edges):
            edges = [edge for edge in row if edge is not None]
            gives = any(edge.given is None or edge.given[1] for edge in edges)
            for outcome in _OTHERWISE:
                answers = [(e.responses[outcome], e.responses["on_true"]) for e in edges]
                differs = any(other != usual or other == "bypass" for other, usual in answers)
                if differs or (gives and outcome == "on_error"):
                    found.append((index, outcome))
        return found


_BLOCKED: Final = {"H2", "H6", "H7", "H8", "H9", "no-entry", "ghost"}


def check_scenarios(subject: Subject) -> Coverage:
    """Try all courses of a graph, report in `subject` those that end stuck (hazard H8), and return
    how many were tried. The result is empty if another error keeps the graph from running."""
    if not subject.real or any(
        p.code in _BLOCKED and p.severity == "error" for p in subject.problems
    ):
        return Coverage()
    trials = Trials(subject.graph)
    waiting = _Waiting(subject, trials.net)
    at_exit: list[Trial] = []
    for trial in trials:
        if trial.end.kind != "stuck":
            continue
        if waiting.report(trial):
            continue
        at_exit.append(trial)
    _report_at_exit(subject, trials.net, at_exit)
    coverage = trials.coverage()
    _report_left(subject, coverage)
    return coverage


def _report_left(subject: Subject, coverage: Coverage) -> None:
    if coverage.tried < coverage.ways:
        message = (
            f"Of {coverage.ways:,} ways through the graph (one action ends otherwise in each) "
            f"{coverage.tried:,} were tried, which is as much as is done at once; from "
            f"{coverage.first_left} on none was. Whether those end is not known."
        )
        subject.report("not-tried", "warning", message)


class _Waiting:
    """Reports each action that waits for ever inside the graph once, with the first trial that
    makes it wait."""

    def __init__(self, subject: Subject, net: Network) -> None:
        self.subject = subject
        self.net = net
        self.actions = {action.full_name: action for action in subject.real}
        self._reported: set[int] = set()
        self._firsts: dict[int, int] = {}  # many trials leave the same actions waiting

    def report(self, trial: Trial) -> bool:
        """Report a trial after which the graph is stuck, and return True. Return False without a
        report if only the exit waits."""
        inside = trial.end.waiting & ~(1 << self.net.exit)
        if not inside and trial.end.waiting:
            return False
        index = self._first(inside) if inside else -1
        if index in self._reported:
            return True
        self._reported.add(index)
        words = self._words(index)
        if words is not None:
            action = self.actions[self.net.names[index]] if index >= 0 else trial.action
            message = f"{trial.when}, the graph stays RUNNING for ever: {words}."
            self.subject.report("H8", "warning", message, action=action)
        return True

    def _first(self, waiting: int) -> int:
        """Return the index of the first waiting action that waits for no other waiting action.
        `waiting` is a mask."""
        if waiting not in self._firsts:
            for_others, rest = 0, waiting
            while rest:
                lowest = rest & -rest
                for_others |= self.net.reachable[lowest.bit_length() - 1] & ~lowest
                rest ^= lowest
            first = waiting & ~for_others or waiting
            self._firsts[waiting] = (first & -first).bit_length() - 1
        return self._firsts[waiting]

    def _words(self, index: int) -> str | None:
        if index < 0:
            return "nothing runs any more"
        name = self.net.names[index]
        if not self.net.wants[index] & ~self.net.has[index]:
            return f"{name} still waits for parents that are required and did not run"
        if any("pvf_allowed_values" in p.text for a in self.subject.real for p in a.inputs):
            return None  # the values that actions give are not known
        if not self.net.needs[index]:
            return f"{name} still waits for inputs"
        return f"{name} still waits for parents that are required, or for inputs"


# Parents and outputs for which the exit waits


def _report_at_exit(subject: Subject, net: Network, found: list[Trial]) -> None:
    """Report, as problems of `subject`, each parent that the exit waits for and that never runs,
    once; and once the outputs that the exit needs as its inputs and does not get. `found`: the
    trial courses in which the exit waits; `net`: the graph as numbers."""
    mended = _mended(subject.graph, {name for trial in found for name in trial.end.lacking})
    is_mend = bool(found) and _never_stuck(mended)
    reported: set[str] = set()
    for trial in found:
        end = trial.end
        severity: Severity = "warning" if trial.action else "error"
        start = f"{trial.when}, the graph stays RUNNING for ever"
        if end.inputs and "" not in reported:
            reported.add("")
            last = net.names[end.last] if end.last >= 0 else ""
            certain = severity == "error" and not _may_fit(subject, last)
            _report_outputs(subject, "error" if certain else "warning", start, last)
        for relation in _exits(subject.graph):
            name = subject.name(relation.parent)
            if name not in end.lacking or name in reported:
                continue
            reported.add(name)
            message = (
                f"{start}: the exit waits for {name}, which then does not run. If either of them "
                "is to end the graph, neither may be required."
            )
            subject.report(
                "H8", severity, message, relation=relation, member="/required",
                fix="not-required" if is_mend else None,
            )  # fmt: skip


def _may_fit(subject: Subject, last: str) -> bool:
    """Return whether an action can give an output other than its default that the exit accepts, so
    that the error is not certain. `last`: the full name of the action that ended last; the outputs
    of the action whose outputs the exit takes count only if it is that."""
    owner = exit_owner(subject.graph)
    limited = {
        name: slot.type
        for name, slot in exit_inputs(subject.graph).items()
        if slot.required and slot.allowed
    }
    ends = (subject.actions[r.parent] for r in _exits(subject.graph) if r.parent in subject.actions)
    return any(
        slot.type == limited.get(name)
        for action in ends
        if action is not owner or action.full_name == last
        for name, slot in slots_of(action.outputs).items()
    )


def _report_outputs(subject: Subject, severity: Severity, start: str, last: str) -> None:
    owner = exit_owner(subject.graph)
    if owner is None:
        return
    names = {p.path for p in owner.outputs}
    message = (
        f"{start}: the engine makes the outputs of {owner.full_name} ({joined(names)}) inputs of the "
        f"exit, and {last or 'nobody'} does not give them. Outputs that are not required are not waited for."
    )
    subject.report(
        "H8", severity, message, action=owner, member="/output_parameters", fix="outputs-optional"
    )


def _exits(graph: Graph) -> list[Relation]:
    return [relation for relation in graph.relations if relation.child == EXIT]


def _mended(graph: Graph, lacking: set[str]) -> Graph:
    """Return the graph with an exit that requires neither the parents `lacking` (full names) nor
    any outputs."""
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


def _never_stuck(mended: Graph) -> bool:
    """Return whether all courses of the graph were tried, and each of them ends, and no action
    still runs then. Each course is tried with both orders in which concurrent actions can end.
    `mended`: the graph after a fix. Return False if there are too many courses to try all."""
    for slower_first in (False, True):
        trials = Trials(mended, slower_first=slower_first)
        if any(trial.end.kind == "stuck" or trial.end.early for trial in trials):
            return False
        if trials.coverage().tried < trials.coverage().ways:
            return False
    return True


def halted(subject: Subject) -> str | None:
    """Return the first trial course in which the graph of `subject` ends HALTED, as words that end
    a sentence ("if …", "in any case"); None if no course does."""
    for trial in Trials(subject.graph):
        if trial.end.kind == "halted":
            return f"if {trial.when[3:]}" if trial.action else "in any case"
    return None
