"""Indexes a graph for its checks, with the place of everything in its canonical file, and collects
the problems."""

from collections.abc import Iterable
from itertools import islice
from typing import Literal

from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.files.writing import name_order
from action_assistant.umrf.json.text import pointer
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    Action,
    Graph,
    Key,
    PlaceInside,
    Problem,
    Relation,
    Severity,
    Where,
)
from action_assistant.umrf.parameters import example_of, flat_name
from action_assistant.umrf.reports import MAX_EACH, ProblemList


class Subject:
    """A graph under examination, indexed, with the problems found so far.

    `paths`: the JSON pointer of each action, by key. `parents` and `children`: the relations that
    the file lists, by the key of their child and by the key of their parent. `incoming` and
    `outgoing`: the relations that the engine follows, by the same keys.
    """

    def __init__(self, graph: Graph, facts: EngineFacts) -> None:
        self.graph = graph
        self.facts = facts
        self._problems = ProblemList()
        self.actions: dict[Key, Action] = {action.key: action for action in graph.actions}
        self.real = [action for action in graph.actions if not action.missing]
        self.paths: dict[Key, str] = {
            action.key: pointer("actions", index) for index, action in enumerate(self.real)
        }
        self._flat: dict[Key, dict[str, str]] = {}
        self._texts: dict[Key, dict[str, str]] = {}
        known = {ENTRY, EXIT, *self.actions}
        self.relations = [r for r in graph.relations if r.parent in known and r.child in known]
        by_child = sorted(self.relations, key=lambda r: (r.child_order, name_order(r)))
        by_parent = sorted(self.relations, key=lambda r: (r.parent_order, name_order(r)))
        self.parents: dict[Key, list[Relation]] = {}
        self.children: dict[Key, list[Relation]] = {}
        self.parent_paths: dict[int, str] = {}
        self.child_paths: dict[int, str] = {}
        for r in by_child:
            if r.only != "children" and r.parent != ENTRY:
                self._place(r, self.parents.setdefault(r.child, []), r.child, self.parent_paths)
        for r in by_parent:
            if r.only != "parents" and r.child != EXIT:
                self._place(r, self.children.setdefault(r.parent, []), r.parent, self.child_paths)
        #: The relations that the engine follows: both sides list each other, and both ends exist.
        self.sound = [r for r in by_parent if self._is_sound(r)]
        self.incoming: dict[Key, list[Relation]] = {}
        self.outgoing: dict[Key, list[Relation]] = {}
        for r in self.sound:
            self.incoming.setdefault(r.child, []).append(r)
            self.outgoing.setdefault(r.parent, []).append(r)

    @property
    def problems(self) -> list[Problem]:
        """The problems found so far."""
        return self._problems.found

    def place(self, relation: Relation) -> tuple[int, int]:
        """Return two numbers by which relations are sorted in the order of the file: the index of
        the child's action, and the index of the relation within the child's `parents`."""
        path = self.parent_paths.get(id(relation), "")
        numbers = [int(part) for part in path.split("/") if part.isdigit()]
        return (numbers[0], numbers[-1]) if numbers else (0, 0)

    def _place(
        self, relation: Relation, listed: list[Relation], owner: Key, paths: dict[int, str]
    ) -> None:
        field = "parents" if paths is self.parent_paths else "children"
        match owner:
            case "entry":
                start = "/graph_entry"
            case "exit":
                start = "/graph_exit"
            case _:
                start = f"{self.paths.get(owner, '')}/{field}"
        paths[id(relation)] = f"{start}/{len(listed)}"
        listed.append(relation)

    def fix_of_input(self, action: Action, name: str) -> str | None:
        """Return `take-example`, the name of the fix that gives an input of the action its declared
        example as value; None if the input has no example, or one that does not fit its type and
        allowed values. `name` is the flat name of the input, which must not have a value."""
        if action.key not in self._texts:
            self._texts[action.key] = {p.path: p.text for p in action.inputs}
        text = self._texts[action.key].get(self.path_of(action, name), "null")
        return "take-example" if example_of(text) is not None else None

    def path_of(self, action: Action, name: str) -> str:
        """Return the path of the parameter that has this flat name; the name itself if the action
        has no such parameter."""
        if action.key not in self._flat:
            every = (*action.inputs, *action.outputs)
            self._flat[action.key] = {flat_name(p.path): p.path for p in reversed(every)}
        return self._flat[action.key].get(name, name)

    def _is_sound(self, relation: Relation) -> bool:
        ends = [self.actions.get(key) for key in (relation.parent, relation.child)]
        return relation.only is None and not any(end and end.missing for end in ends)

    def name(self, key: Key) -> str:
        """Return the words by which a message calls an action: its full name, or "the entry" or
        "the exit" for a key of an end."""
        match key:
            case "entry":
                return "the entry"
            case "exit":
                return "the exit"
            case _:
                return self.actions[key].full_name

    def report(
        self,
        code: str,
        severity: Severity,
        message: str,
        *,
        action: Action | None = None,
        relation: Relation | None = None,
        member: str = "",
        fix: str | None = None,
        side: Literal["parents", "children"] | None = None,
        also: Iterable[Relation | Action] = (),
        inside: PlaceInside | None = None,
    ) -> None:
        """Add a problem with this code and message that concerns an action, a relation, or, without
        either, the whole graph. `member`: the JSON pointer of the faulty value below that action,
        relation or graph. `fix`: the name of a fix that mends it. `side`: the list in which the
        relation is shown, since a file lists each relation twice. `also`: other relations or
        actions with the same problem. `inside`: the place in the sub-graph for which the action
        stands. Only the first `MAX_EACH` problems of one code and severity are kept."""
        if not self._problems.has_room(severity, code):
            return
        about = action or relation
        where = Where(path=member) if about is None else self._where(about, member, side)
        others = tuple(self._where(other, member, side) for other in islice(also, MAX_EACH))
        self._problems.found.append(
            Problem(
                code=code,
                severity=severity,
                where=where,
                message=message,
                fix=fix,
                also=others,
                inside=inside,
            )
        )

    def _where(self, about: Relation | Action, member: str, side: str | None) -> Where:
        if isinstance(about, Action):
            return Where(path=self.paths.get(about.key, "") + member, aid=about.key)
        relation = about
        path = self.parent_paths.get(id(relation)) or self.child_paths.get(id(relation), "")
        if side == "children" or (side is None and member.startswith("/remap")):
            path = self.child_paths.get(id(relation), path)
        listing = f";{relation.listing}" if relation.listing else ""
        owner = relation.child if relation.child in self.paths else relation.parent
        aid = owner if owner in self.paths else None
        key = f"{relation.parent}>{relation.child}{listing}"
        return Where(path=path + member, aid=aid, relation=key)


def joined(names: set[str]) -> str:
    """Join names with commas for a sentence, without quotes: only a name that is written at the
    place of the problem is quoted (`quoted`)."""
    return ", ".join(sorted(names))


def quoted(names: set[str]) -> str:
    """Join names with commas, each in quotes, for a sentence about a problem at whose place the
    names are written."""
    return ", ".join(f"“{name}”" for name in sorted(names))


def more(count: int, one: str, many: str) -> str:
    """Return the end of a message about a problem that is reported once for several places: how
    many more there are, named `one` or `many`. Empty if `count` is 0."""
    return f" {count:,} more {one if count == 1 else many} of this kind." if count > 0 else ""
