"""Finds the actions that may run at the same time, as far as arrows and possible outcomes tell.

See docs/umrf-and-the-engine.md 2.3. It reports too many pairs rather than too few: durations are
not known. Of a small graph all courses are followed (`courses.together`, decision 155); of another
one combinations of outcomes are not examined. But an action that a join waits for is over when the
join begins.
"""

from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import cached_property
from typing import Final

from msgspec.structs import replace

from action_assistant.umrf.checks.places import Subject
from action_assistant.umrf.components import Mask, nodes_in, reachable
from action_assistant.umrf.courses.together import together
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    PRECONDITIONS,
    Graph,
    Key,
    Precondition,
    Relation,
)

#: The most pairs that are examined. If there are more, any two actions are taken to run at once.
PAIRS: Final = 400_000
#: Graphs with more actions are not followed.
MOST: Final = 20_000


class Concurrency:
    """Finds which actions can run at the same time.

    `runs`: the keys of the actions that can run. `reports`: the outcomes that each action, or the
    entry, can report, by key; an action reports its own outcomes, and passes others on when it is
    bypassed. `known` is False if the graph is too large to be followed; then any two actions that
    can run may run together.
    """

    def __init__(
        self, subject: Subject, runs: set[Key], reports: Mapping[Key, set[Precondition]]
    ) -> None:
        self.keys = [action.key for action in subject.real]
        self.index = {key: number for number, key in enumerate(self.keys)}
        self._subject = subject
        self._runs = runs
        self._reports = reports
        self._pairs = 0 if len(self.keys) <= MOST else PAIRS + 1
        count = len(self.keys)
        self._with: list[Mask] = [0] * count  # the actions that may run while it runs
        #: The actions that may run when an action is bypassed and passes an outcome on, without an end of its own.
        self._passing: dict[tuple[Key, Precondition], Mask] = {}
        self._behind_kept: dict[Mask, Mask] = {}
        self._lively = {a.key for a in subject.real if a.type == "spontaneous"}
        self._required = {
            key: [r.parent for r in listed if r.required and r.parent in self.index]
            for key, listed in subject.incoming.items()
        }
        #: The keys of the actions that can begin again after they have run; None where that is not known.
        self.again: Collection[Key] | None = None
        courses = together(self._sound_graph()) if self.known and self._repeated else None
        if courses is not None:
            self.again = courses.again
            self._repeated = self._mask(courses.again)
        if self.known:
            self._starts: dict[Precondition, list[Mask]] = {}
            self._open = deque[Key](key for key in reports if key != EXIT)
            self._waiting = set(self._open)
            self._joins: set[Key] = set()
            while (self._open or self._joins) and self.known:
                if self._open:
                    key = self._open.popleft()
                    self._waiting.discard(key)
                    self._follow(key)
                else:
                    self._join(self._joins.pop())
        if courses is not None:
            for key, beside in courses.beside.items():
                self._with[self.index[key]] &= self._mask(beside)

    def _sound_graph(self) -> Graph:
        return replace(self._subject.graph, relations=tuple(self._subject.sound))

    def _mask(self, keys: Iterable[Key]) -> Mask:
        return sum(1 << self.index[key] for key in keys)

    @property
    def known(self) -> bool:
        """True if the graph was followed completely; False if it has too many actions or pairs of
        actions."""
        return self._pairs <= PAIRS

    def may_run(self, key: Key, other: Key) -> bool:
        """Return whether `key` can run at a moment at which `other` runs."""
        if key not in self._runs or other not in self._runs:
            return False
        return not self.known or bool(self._with[self.index[other]] >> self.index[key] & 1)

    def beside(self, key: Key) -> set[Key]:
        """Return the keys of the actions that may run while `key` runs: all others that can run if
        the graph was not followed."""
        if not self.known:
            return (self._runs & self.index.keys()) - {key}
        return {self.keys[index] for index in nodes_in(self._with[self.index[key]])}

    def running_after(
        self, key: Key, outcome: Precondition, waited: Iterable[Key] = ()
    ) -> set[Key]:
        """Return the keys of the actions that may run just after `key` has reported this outcome,
        including actions that this outcome starts. `key` itself is not among them.

        `waited`: other actions that have reported before. If the graph was not followed, all
        actions that can run are returned.
        """
        if outcome not in self._reports.get(key, ()):
            return set()
        if not self.known:
            return (self._runs & self.index.keys()) - {key}
        mask = self._when(key, outcome) | self._started(key, outcome)
        for other in waited:
            mask &= self._beside(other)
        return {self.keys[index] for index in nodes_in(mask)} - {key}

    def may_run_at(self, key: Key, other: Key, outcome: Precondition) -> bool:
        """Return whether `key` can be running at the moment at which `other` reports this outcome."""
        if key not in self._runs or outcome not in self._reports.get(other, ()):
            return False
        return not self.known or bool(self._when(other, outcome) >> self.index[key] & 1)

    def may_outlast(self, key: Key, outcome: Precondition) -> bool:
        """Return whether `key` may still run after it has itself reported this outcome.

        A spontaneous action begins again, and an action that is bypassed while it runs passes the
        outcome on.
        """
        if key not in self._runs or outcome not in self._reports.get(key, ()):
            return False
        if not self.known or (key in self._lively and outcome != "on_stopped"):
            return True
        return bool(self._passing.get((key, outcome), 0) >> self.index[key] & 1)

    def _when(self, key: Key, outcome: Precondition) -> Mask:
        own = self._with[self.index[key]] if key in self._runs else 0
        return own | self._passing.get((key, outcome), 0)

    def _whenever(self, key: Key) -> Mask:
        found = self._with[self.index[key]] if key in self._runs else 0
        for outcome in PRECONDITIONS:
            found |= self._passing.get((key, outcome), 0)
        return found

    @cached_property
    def _first(self) -> Mask:
        """Return, as a mask, the actions that the entry starts."""
        indices = {index for index in self._children(ENTRY) if self.keys[index] in self._runs}
        return sum(1 << index for index in indices)

    @cached_property
    def _needs(self) -> list[Mask]:
        """Return for each action, as a mask, the required parents for which this action waits."""
        listed = (self._required.get(key, ()) for key in self.keys)
        return [sum(1 << self.index[each] for each in set(own)) for own in listed]

    @cached_property
    def _after(self) -> list[Mask]:
        """Return for each action, as a mask, the actions that paths of arrows from this action
        reach."""
        return reachable([self._children(key) for key in self.keys])

    @cached_property
    def _repeated(self) -> Mask:
        """Return, as a mask, the actions that may have reported and then run again although no path
        of arrows leads back to them: several parents, or an action on a loop, start them. Where the
        courses were followed, those that do in one of them."""
        found = 0
        for index, after in enumerate(self._after):
            if after >> index & 1:
                found |= after
            listed = [
                relation
                for relation in self._subject.incoming.get(self.keys[index], [])
                if relation.parent in self._reports
            ]
            optional = sum(not relation.required for relation in listed)
            if optional + (optional < len(listed)) > 1:
                found |= 1 << index
        return found

    def _beside(self, required: Key) -> Mask:
        """Return, as a mask, the actions that may run at the moment at which `required` has
        reported and a child that waits for `required` begins."""
        index = self.index[required]
        found = self._whenever(required) | self._after[index] | self._repeated & 1 << index
        # A bypass takes no time: successors of the actions that run then come after it has reported.
        for outcome in PRECONDITIONS:
            found |= self._behind(self._passing.get((required, outcome), 0))
        return found

    def _behind(self, mask: Mask) -> Mask:
        """Return, as a mask, the actions that paths of arrows reach from any action in `mask`."""
        found = self._behind_kept.get(mask)
        if found is None:
            found = 0
            for index in nodes_in(mask):
                found |= self._after[index]
            self._behind_kept[mask] = found
        return found

    def _children(self, key: Key) -> list[int]:
        listed = self._subject.outgoing.get(key, [])
        return [self.index[r.child] for r in listed if r.child in self.index]

    def _answers(self, key: Key, outcome: Precondition) -> Iterator[tuple[Relation, str]]:
        for relation in self._subject.outgoing.get(key, []):
            if relation.child in self.index:
                run = key == ENTRY
                yield relation, "run" if run else relation.conditions.answer(outcome)

    def _started(self, key: Key, outcome: Precondition) -> Mask:
        """Return, as a mask, the actions that are started at once when `key` reports this outcome,
        directly or by bypasses."""
        if key == ENTRY:
            return self._first
        if outcome not in self._starts:
            self._starts[outcome] = self._all_started(outcome)
        return self._starts[outcome][self.index[key]]

    def _all_started(self, outcome: Precondition) -> list[Mask]:
        """Return for each action, as a mask, the actions that are started at once when it reports
        this outcome.

        Bypasses are the edges of the graph that is searched; started actions are its ends, numbered
        after the last action.
        """
        count = len(self.keys)
        ways: list[list[int]] = []
        for key in self.keys:
            own: list[int] = []
            for relation, answer in self._answers(key, outcome):
                index = self.index[relation.child]
                if answer == "run" and relation.child in self._runs:
                    own.append(count + index)
                elif answer == "bypass":
                    own.append(index)
            ways.append(own)
        return [mask >> count for mask in reachable(ways)]

    def _follow(self, key: Key) -> None:
        for outcome in self._reports[key]:
            for relation, answer in self._answers(key, outcome):
                child = relation.child
                if answer == "bypass":
                    passing = self._passing.get((child, outcome), 0)
                    at_once = self._around(key, outcome) | self._started(key, outcome)
                    if at_once & ~passing:
                        self._passing[child, outcome] = passing | at_once
                        self._again(child)
                elif answer == "run" and child in self._runs:
                    self._begin(child, key, outcome)
                if len(self._subject.incoming[child]) > 1:
                    self._joins.add(child)

    def _around(self, key: Key, outcome: Precondition) -> Mask:
        """Return, as a mask, the actions that run already when `key` reports this outcome. A
        spontaneous action is itself among them."""
        own = 1 << self.index[key] if key in self._lively else 0
        return own | self._when(key, outcome)

    def _join(self, child: Key) -> None:
        """Follow the parents of the action `child` again, after it was found that more actions may
        run beside it."""
        for relation in self._subject.incoming.get(child, []):
            for outcome in self._reports.get(relation.parent, ()):
                run = relation.parent == ENTRY or relation.conditions.answer(outcome) == "run"
                if run and child in self._runs:
                    self._begin(child, relation.parent, outcome)

    def _begin(self, child: Key, parent: Key, outcome: Precondition) -> None:
        if self._is_enough():
            return
        index = self.index[child]
        around, started = self._around(parent, outcome), self._started(parent, outcome)
        found = (around | started) & ~self._with[index] & ~(1 << index)
        if not found:
            return
        self._count(1 + len(self._required.get(child, ())))
        for required in self._required.get(child, ()):
            if required != parent:
                found &= self._beside(required)
        new = found
        for other in nodes_in(found & started & ~around):
            self._count(1)
            if self._is_enough():
                return
            if not self._is_ready(self.keys[other], parent, index):
                new ^= 1 << other
        if not new:
            return
        self._with[index] |= new
        self._again(child)
        self._count(new.bit_count())
        for other in nodes_in(new) if not self._is_enough() else ():
            if not self._with[other] >> index & 1:
                self._with[other] |= 1 << index
                self._again(self.keys[other])

    def _is_enough(self) -> bool:
        return self._pairs > PAIRS

    def _count(self, looked_at: int) -> None:
        self._pairs += looked_at

    def _is_ready(self, key: Key, parent: Key, beside: int) -> bool:
        """Return whether `key` can begin when `parent` ends, while the action with the index
        `beside` runs.

        The other required parents of `key` must have reported by then.
        """
        listed = self._required.get(key, ())
        again = self._after[beside] | self._repeated
        if self._needs[self.index[key]] >> beside & ~again >> beside & 1:
            return False
        self._count(len(listed))
        return all(
            required == parent or self._beside(required) >> beside & 1 for required in listed
        )

    def _again(self, key: Key) -> None:
        """Queue an action to be followed again, after it was found that more actions may run beside
        it."""
        if key not in self._waiting and key in self._reports:
            self._waiting.add(key)
            self._open.append(key)
