"""Answers since when a graph takes another course, by the index and by simulations of
earlier moments in workers."""

import time
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from typing import Annotated, Any, Final

import msgspec
from msgspec.structs import replace
from sqlalchemy import Connection

from action_assistant.editor.catalogue.graph_checks import GraphChecks
from action_assistant.editor.documents.contents import NOTHING_INSIDE, Inside, graphs_of
from action_assistant.editor.history import index_queries
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.change_summaries import (
    Changes,
    State,
    graph_of,
    names_between,
    shortened,
    state_of,
    stretch_of,
)
from action_assistant.editor.history.key_changes import LoggedChange, owner_of
from action_assistant.editor.log.graph_events import when
from action_assistant.editor.people.people import People
from action_assistant.errors import BadInput
from action_assistant.umrf.courses.expected import keyed, scripted_by_key, scripted_by_name
from action_assistant.umrf.difference import difference
from action_assistant.umrf.model import Graph, Key
from action_assistant.umrf.semantics import SCRIPT, Script, script_from
from action_assistant.umrf.semantics.steps import (
    Departure,
    ExpectedStep,
    course,
    departure,
    step_text,
    unnamed,
)
from action_assistant.web.auth.keys import PersonRef

_EACH: Final = 200  # states that are all simulated
_SAMPLES: Final = 64  # simulated if there are more states
_EVENTS: Final = 4_000  # of one course
_BUDGET_S: Final = 25.0  # of this process's time, for the samples
#: Fields of actions that no engine reads.
_SILENT: Final = frozenset({"description", "x/gui_attributes", "x", "in", "out"})


class CourseParting(msgspec.Struct, frozen=True):
    """The change `seq` from which on the simulated course differs from the first one (`parts`), or
    equals it again. `place`, `before`, `after`: the first step, from 1, in which the courses
    before and after this change differ, and that step in each, in words. `at`: microseconds UTC."""

    seq: int
    author: str
    at: int
    parts: bool
    place: int
    before: str
    after: str
    changes: Changes


class Followed(msgspec.Struct, frozen=True):
    """The changes after which the course of a graph differs, in order of time. `same`: the last
    course equals the first. `exact`: every change between was simulated or cannot matter;
    `looked`: the number of simulations."""

    same: bool
    exact: bool
    looked: int
    partings: tuple[CourseParting, ...]


def followed_between(
    connection: Connection,
    graph: str,
    good: int,
    bad: int,
    limit: int,
    script: Script,
    named_at: int,
    inside: Inside,
) -> Followed:
    """Return the changes between the changes `good` and `bad` of a graph at which its simulated
    course changes, as `followed` does. Raise TooLarge if there are more than `limit`. `script`,
    `named_at`, `inside`: as in `followed`."""
    changes = stretch_of(connection, graph, good, bad, limit)
    base = index_queries.at(connection, graph, good)
    return followed(base, changes, script, named_at, inside=inside)


def followed(
    base: Sequence[LoggedChange],
    changes: Sequence[LoggedChange],
    script: Script,
    named_at: int,
    budget_s: float = _BUDGET_S,
    inside: Inside = NOTHING_INSIDE,
) -> Followed:
    """Return the changes after which the simulated course of a graph differs from the first one;
    search for at most `budget_s` seconds of processor time. `changes`: in order of time. `base`:
    the value of each key before them. `script`: how the actions act. `named_at`: the change after
    which actions had the names in `script`. `inside`: the graphs inside, the same for every change.
    """
    past = _Past(base, changes, script, named_at, graphs_of(inside))
    if not past.moments:
        return Followed(True, True, 1, ())
    flips, exact = _flips(past, budget_s)
    partings = tuple(past.parting(*flip) for flip in flips)
    return Followed(past.is_same(len(past.moments)), exact, past.looked, partings)


def _flips(past: "_Past", budget_s: float) -> tuple[list[tuple[int, int]], bool]:
    """Return pairs of neighbouring states between which the course changes, and whether these
    are certainly all pairs. They may not be if there are more than 200 states, or if the search
    took more than `budget_s` seconds of processor time."""
    last = len(past.moments)
    parts = last if last <= _EACH else _SAMPLES
    marks = sorted({last * n // parts for n in range(parts + 1)})
    exact = len(marks) == last + 1
    begun, found = time.thread_time(), list[tuple[int, int]]()
    end = past.is_same(last)
    left = 0
    for right in marks[1:]:
        if time.thread_time() - begun > budget_s:
            exact = False
            break
        if past.is_same(left) != past.is_same(right):
            found.append(_narrowed(past, left, right))
        left = right
    if left != last and past.is_same(left) != end:
        found.append(_narrowed(past, left, last))
    return found, exact


def _narrowed(past: "_Past", left: int, right: int) -> tuple[int, int]:
    """Return the two neighbouring states between the states `left` and `right`, whose courses
    differ, at which the course changes."""
    verdict = past.is_same(left)
    while right - left > 1:
        middle = (left + right) // 2
        if past.is_same(middle) == verdict:
            left = middle
        else:
            right = middle
    return left, right


class _Past:
    """The states of a graph after each change that an engine can notice; number 0 is the state
    before all of them."""

    def __init__(
        self,
        base: Sequence[LoggedChange],
        changes: Sequence[LoggedChange],
        script: Script,
        named_at: int,
        inside: Mapping[str, Graph],
    ) -> None:
        self._inside = inside
        self._base = state_of(base)
        self._changes = changes
        self.moments: list[LoggedChange] = list(_noticed(changes))
        self._courses: dict[int, list[ExpectedStep]] = {}
        self._script = scripted_by_key(script, graph_of(self._state(named_at)))
        self._reference = self._course(0)

    @property
    def looked(self) -> int:
        """The number of states that were simulated so far."""
        return len(self._courses)

    def is_same(self, moment: int) -> bool:
        """Return whether the course (the simulated steps) of the state with the number `moment`
        equals that of state 0. Each state is simulated only once."""
        return self._course(moment) == self._reference

    def parting(self, left: int, right: int) -> CourseParting:
        """Return how the courses of the neighbouring states `left` and `right` (numbers) differ, as
        a description of the later change."""
        change = self.moments[right - 1]
        before, after = self._graph(left), self._graph(right)
        apart = departure(self._course(left), self._course(right))
        names = {a.key: a.full_name for a in (*before.actions, *after.actions)}
        owners = {owner_of(c.root, c.key) for c in self._changes if c.seq == change.seq}
        return CourseParting(
            change.seq,
            change.author,
            change.at,
            not self.is_same(right),
            0 if apart is None else apart.place + 1,
            *_words(apart, names),
            shortened(difference((0, before), (0, after)), owners),
        )

    def _course(self, moment: int) -> list[ExpectedStep]:
        found = self._courses.get(moment)
        if found is None:
            graph = self._graph(moment)
            keys = {a.full_name: a.key for a in graph.actions}
            played = scripted_by_name(self._script, graph)
            steps = unnamed(course(graph, played, _EVENTS, self._inside))
            found = keyed(steps, keys)
            self._courses[moment] = found
        return found

    def _graph(self, moment: int) -> Graph:
        if moment == 0:
            return graph_of(self._base)
        return graph_of(self._state(self.moments[moment - 1].seq))

    def _state(self, seq: int) -> State:
        return self._base | {c.place: c.after for c in self._changes if c.seq <= seq}


def _noticed(changes: Sequence[LoggedChange]) -> Iterator[LoggedChange]:
    """Yield the first change of each event that can make a difference to an engine."""
    last = 0
    for change in changes:
        if change.seq != last and _is_noticed(change):
            last = change.seq
            yield change


def _is_noticed(change: LoggedChange) -> bool:
    if change.root not in {"actions", "relations"}:
        return False
    return change.key.partition("|")[2] not in _SILENT


def _words(apart: Departure | None, names: Mapping[Key, str]) -> tuple[str, str]:
    if apart is None:
        return "", ""

    def words(step: ExpectedStep | None) -> str:
        named = None if step is None else replace(step, node=names.get(step.node, step.node))
        return step_text(named)

    return words(apart.expected), words(apart.found)


_MOST: Final = 200_000  # changes of keys between two moments


class AskingSince(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The request: search between the change `good` and the change `bad` (missing: the newest).
    `script`: what the actions do, as in a script of `simulate`, the same for every change.
    `named_at`: the change after which actions had the names in `script` (missing: `bad`)."""

    good: int
    script: Annotated[Any, SCRIPT]
    bad: int | None = None
    named_at: int | None = None


class CourseChange(msgspec.Struct, frozen=True):
    """From the change `seq` on the course differs from the first one (`parts`), or equals it again.
    `place`, `before`, `after`: the first step, from 1, in which the courses before and after
    this change differ, and that step in each, in words. `changes`: the effect of the change on
    the graph."""

    seq: int
    author: PersonRef
    at: datetime
    parts: bool
    place: int
    before: str
    after: str
    changes: Changes


class SinceWhen(msgspec.Struct, frozen=True):
    """The changes between `good` and `bad` after which the course of a graph differs, in order of
    time. `same`: the course at `bad` equals that at `good`. `exact`: there are certainly no
    others; otherwise only some changes were simulated, and the course may have changed and
    changed back between them. `looked`: the number of simulations."""

    good: int
    bad: int
    same: bool
    exact: bool
    looked: int
    partings: tuple[CourseChange, ...]


class CourseSearch:
    """Searches the history of a graph for the changes that altered its simulated course."""

    def __init__(
        self,
        index: ChangeIndex,
        people: People,
        checks: GraphChecks,
    ) -> None:
        self._checks = checks
        self._index = index
        self._people = people

    async def since(self, graph: str, asked: AskingSince) -> SinceWhen:
        """Search between two changes of a graph for the changes that alter its course. `asked`: the
        two changes and the script. Raise BadInput for a bad request, TooLarge for too many changes,
        Unavailable if the journal cannot be read."""
        try:
            script = script_from(asked.script)
        except ValueError as error:
            raise BadInput(str(error), where={"path": "/script"}) from error
        newest = await self._index.upto(graph)
        bad = newest if asked.bad is None else asked.bad
        named_at = bad if asked.named_at is None else asked.named_at
        if not 1 <= asked.good <= bad <= newest or not asked.good <= named_at <= bad:
            raise BadInput(
                f"This graph has the changes 1 to {newest}; `good` comes before `bad`, and `named_at` "
                "lies between them.",
                where={"path": "/good"},
            )
        own, uses = await self._index.value(names_between, graph, asked.good, bad, _MOST)
        inside = await self._checks.inside_of(own, uses)
        found = await self._index.value(
            followed_between, graph, asked.good, bad, _MOST, script, named_at, inside
        )
        partings = tuple(
            CourseChange(
                each.seq,
                self._people.person(each.author),
                when(each.at),
                each.parts,
                each.place,
                each.before,
                each.after,
                each.changes,
            )
            for each in found.partings
        )
        return SinceWhen(asked.good, bad, found.same, found.exact, found.looked, partings)
