"""Answers since when a graph takes another course, by the index and simulations in workers."""

from datetime import datetime
from typing import Annotated, Any, Final

import msgspec

from action_assistant.editor.catalogue.graph_checks import GraphChecks
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.change_summaries import Changes, names_between
from action_assistant.editor.history.course_changes import followed_between
from action_assistant.editor.log.document_events import when
from action_assistant.editor.people.people import People
from action_assistant.errors import BadInput
from action_assistant.umrf.semantics import SCRIPT, script_from
from action_assistant.web.auth.keys import PersonRef

_MOST: Final = 200_000  # changes of keys between two moments


class AskingSince(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Between which moments to look: after the change `good`, and after `bad` (left out: now). What the
    actions do, as in a script of `simulate`, is the same at every moment; it names actions as they were
    called at `named_at` (left out: at `bad`)."""

    good: int
    script: Annotated[Any, SCRIPT]
    bad: int | None = None
    named_at: int | None = None


class CourseChange(msgspec.Struct, frozen=True):
    """From the change `seq` on the course is another one (`parts`), or the first one again. `place`,
    `before`, `after`: the first step, from 1, in which the courses before and after this change differ,
    and what is done in it, in words. `changes` is what the change did to the graph."""

    seq: int
    author: PersonRef
    at: datetime
    parts: bool
    place: int
    before: str
    after: str
    changes: Changes


class SinceWhen(msgspec.Struct, frozen=True):
    """The changes between `good` and `bad` after which the course of a graph differs, in order of time. `same`:
    whether the course at `bad` is that at `good`. `exact`: whether there are no others; otherwise only some
    moments were simulated, and the course may have changed and changed back between them. `looked`: the number
    of simulated moments."""

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
        """Search between two changes of a graph. Raises BadInput, TooLarge, Unavailable."""
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
