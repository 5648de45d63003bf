"""Previews a merge as differences of actions, arrows and notes, and makes its update. Runs in workers."""

from collections.abc import Collection, Iterable, Mapping
from typing import Any, Final, Literal, TypeAlias

import msgspec
from sqlalchemy import Connection

from action_assistant.editor.documents.contents import (
    GraphAtSeq,
    Inside,
    graphs_of,
    read,
)
from action_assistant.editor.documents.document import Maps, is_same, read_maps
from action_assistant.editor.documents.values import ROOTS, ends_of, is_aid
from action_assistant.editor.history import index_queries
from action_assistant.editor.history.change_summaries import Changes, maps_of, shortened, state_of
from action_assistant.editor.history.drafts.merging import Choices, FoundConflict, merged
from action_assistant.editor.history.key_changes import Place, by_owner, field_of, owner_of
from action_assistant.editor.history.merge_origins import originals
from action_assistant.editor.interchange.document_edits import Side, setting
from action_assistant.umrf.check import check_written
from action_assistant.umrf.difference import (
    ActionChange,
    Difference,
    Field,
    NoteChange,
    RelationChange,
    difference,
)
from action_assistant.umrf.files.writing import Stamp, write
from action_assistant.umrf.model import ENTRY, EXIT, Graph, Problem

#: The two graphs of a merge. What is brought in comes from the one, into the other.
DraftSide: TypeAlias = Literal["origin", "draft"]

DRAFT_SIDES: Final[tuple[DraftSide, ...]] = ("origin", "draft")
_WORSE: Final = 50  # problems that are told
_NAMED: Final = 3  # conflicts without a choice that a refusal names
_TOLD: Final = 50  # of which it says the places


class DraftConflict(msgspec.Struct, frozen=True, kw_only=True):
    """A conflict between both sides of a draft. `place`: the key by which a choice names it.
    `what`: the thing, in words. `removed`: the side that removed it while the other changed it.
    `origin`, `draft`: the changes of each side to it."""

    place: str
    what: str
    removed: DraftSide | None
    origin: Changes
    draft: Changes


class DraftMoment(msgspec.Struct, frozen=True):
    """The state with which both sides are compared: the graph `graph` after its change `seq`."""

    graph: str
    seq: int


class DraftSides(msgspec.Struct, frozen=True):
    """A draft and its origin in their present states, and the last state in which they were equal."""

    base: DraftMoment
    origin: GraphAtSeq
    draft: GraphAtSeq

    def of(self, side: DraftSide) -> GraphAtSeq:
        """Return the present state of one side, draft or origin."""
        return self.origin if side == "origin" else self.draft


class DraftMerge(msgspec.Struct, frozen=True):
    """A merge to compute: of the other side into the side `into`. `choices`: the chosen side of each
    conflict, by its place. `inside`: the graphs inside of either side."""

    sides: DraftSides
    into: DraftSide
    choices: Mapping[str, DraftSide]
    inside: Inside

    @property
    def target(self) -> GraphAtSeq:
        """Return the present state of the graph that receives the changes: the draft or its
        origin, as `into` says."""
        return self.sides.of(self.into)

    @property
    def source(self) -> GraphAtSeq:
        """Return the side of the draft whose changes are brought in."""
        return self.sides.of(other_side(self.into))


class UnmadeChoices(msgspec.Struct, frozen=True):
    """The conflicts without a choice: their number, and the first ones in words and by place."""

    count: int
    what: tuple[str, ...]
    places: tuple[str, ...]


class MadeMerge(msgspec.Struct, frozen=True):
    """A merge to be stored: the update, and the authors of the values that it sets, the last one
    first. `any_conflicts`: there were conflicts; `left`: the conflicts without a choice."""

    update: bytes
    authors: tuple[str, ...]
    any_conflicts: bool
    left: UnmadeChoices | None


class FoundMerge(msgspec.Struct, frozen=True):
    """The result of a merge. `update`: usable only if every conflict has a choice. `places`: the
    keys that it sets. `problems`: those that are new. `did`: what each side did since they were
    equal. `umrf`: the resulting text, with the keys of its actions."""

    update: bytes
    places: tuple[Place, ...]
    conflicts: tuple[DraftConflict, ...]
    changes: Changes
    problems: tuple[Problem, ...]
    did: dict[DraftSide, Changes]
    umrf: str


class WrittenPreview(msgspec.Struct, frozen=True):
    """The parts of a merge preview, each as JSON, and the authors of the merged changes, the last
    one first."""

    changes: bytes
    conflicts: bytes
    problems: bytes
    umrf: bytes
    origin_did: bytes
    draft_did: bytes
    authors: tuple[str, ...]


def previewed(connection: Connection, merge: DraftMerge) -> WrittenPreview:
    """Compute a merge, and return its parts for the page as JSON."""
    found = merging(connection, merge)
    write_json = msgspec.json.encode
    return WrittenPreview(
        changes=write_json(found.changes),
        conflicts=write_json(found.conflicts),
        problems=write_json(found.problems),
        umrf=write_json(found.umrf),
        origin_did=write_json(found.did["origin"]),
        draft_did=write_json(found.did["draft"]),
        authors=authors_of(connection, merge.source, found.places),
    )


def made_merge(connection: Connection, merge: DraftMerge) -> MadeMerge:
    """Compute a merge, and return the update to store and what is needed to check and record it."""
    found = merging(connection, merge)
    left = [conflict for conflict in found.conflicts if conflict.place not in merge.choices]
    unmade = UnmadeChoices(
        len(left),
        tuple(conflict.what for conflict in left[:_NAMED]),
        tuple(conflict.place for conflict in left[:_TOLD]),
    )
    authors = authors_of(connection, merge.source, found.places)
    return MadeMerge(found.update, authors, bool(found.conflicts), unmade if left else None)


def authors_of(
    connection: Connection, source: GraphAtSeq, places: Collection[Place]
) -> tuple[str, ...]:
    """Return the ids of the persons who set the present values at these places (root map and key)
    in `source`, the last one first."""
    wanted = frozenset(places)
    owners = {owner_of(*place) for place in wanted}
    last = index_queries.latest(connection, source.graph, source.seq, owners)
    changes = [change for change in last if change.place in wanted]
    made = originals(connection, source.graph, changes)
    newest = sorted(made, key=lambda each: each.change.at, reverse=True)
    return tuple(dict.fromkeys(each.change.author for each in newest))


def apart_since(connection: Connection, sides: DraftSides) -> tuple[int, int]:
    """Return how many things the origin, and how many the draft, changed since they were equal."""
    maps: dict[DraftSide, Maps] = {side: read(sides.of(side)).moment.maps for side in DRAFT_SIDES}
    did = _did(_base_of(connection, sides), maps)
    return count(did["origin"]), count(did["draft"])


def _base_of(connection: Connection, sides: DraftSides) -> Maps:
    """Return, as root maps, the state in which both sides were last equal."""
    return maps_of(state_of(index_queries.at(connection, sides.base.graph, sides.base.seq)))


def merging(connection: Connection, merge: DraftMerge) -> FoundMerge:
    """Compute the merge of the source of `merge` into its target, with conflicts and new problems.
    Nothing is stored."""
    was, into = _base_of(connection, merge.sides), merge.into
    maps_by_side = {side: read(merge.sides.of(side)).moment.maps for side in DRAFT_SIDES}
    ours, mine = merge.target, read(merge.target)
    chosen: Choices = {place: _side(side, into) for place, side in merge.choices.items()}
    found = merged(
        _places(was), _places(mine.moment.maps), _places(maps_by_side[other_side(into)]), chosen
    )
    result = _places(mine.moment.maps) | found.targets
    maps = _maps({place: v for place, v in result.items() if v is not msgspec.UNSET})
    graph = read_maps(maps)
    teller = _Teller(was, maps_by_side, into)
    known = {(problem.code, problem.message) for problem in mine.problems(merge.inside)}
    problems = check_written(graph, graphs_of(merge.inside), merge.inside.resolution)
    worse = [each for each in problems if (each.code, each.message) not in known]
    return FoundMerge(
        setting(ours.state, {(root, key): v for (root, key), v in found.targets.items()}),
        tuple(found.targets),
        tuple(teller.told(conflict) for conflict in found.conflicts),
        _changes(mine.moment.graph, graph, {owner_of(*place) for place in found.targets}),
        tuple(worse[:_WORSE]),
        teller.did,
        write(graph, Stamp(ours.graph)),
    )


def count(changes: Changes) -> int:
    """Return how many things were changed, those not listed included."""
    kinds = (changes.fields, changes.actions, changes.relations, changes.notes)
    return sum(map(len, kinds)) + changes.more


class _Teller:
    """Describes the conflicts of a merge in words."""

    def __init__(self, base: Maps, sides: Mapping[DraftSide, Maps], into: DraftSide) -> None:
        self._base = _places(base)
        self._graph = read_maps(base)
        self._sides = {side: _places(maps) for side, maps in sides.items()}
        self._graphs = {side: read_maps(maps) for side, maps in sides.items()}
        self._differences = {
            side: difference((0, self._graph), (0, graph)) for side, graph in self._graphs.items()
        }
        self._into: Final = into
        shown = [self._graph, self._graphs[other_side(into)], self._graphs[into]]
        self._names = {a.key: a.full_name for graph in shown for a in graph.actions}
        self.did: Final = _did(base, sides)

    def label(self, owner: str) -> str:
        """Return the name of an action or arrow for people; for other keys (`owner`) "the note" or
        "the graph"."""
        ends = ends_of(owner)
        if ends is not None:
            return f"{self._name(ends.parent)} → {self._name(ends.child)}"
        return self._name(owner) if is_aid(owner) else "the note" if owner else "the graph"

    def told(self, conflict: FoundConflict) -> DraftConflict:
        """Return a conflict in words, with the changes of each side."""
        label, key = self.label(conflict.owner), conflict.key
        if key is None:
            tell, what = self._thing, label
        else:
            tell, what = self._key, f"{_words(*key)} of {label}"
        removed = None if conflict.removed is None else _named(conflict.removed, self._into)
        return DraftConflict(
            place=conflict.place,
            what=what,
            removed=removed,
            origin=tell(conflict, "origin"),
            draft=tell(conflict, "draft"),
        )

    def _name(self, key: str) -> str:
        return self._names.get(key, key if key in {ENTRY, EXIT} else "an action that is gone")

    def _thing(self, conflict: FoundConflict, side: DraftSide) -> Changes:
        """Return the changes of one side to the action of a conflict and its arrows, or to its
        arrow."""
        found = self._differences[side]
        owner, ends = conflict.owner, ends_of(conflict.owner)

        def belongs(change: RelationChange) -> bool:
            return owner in change.ends if ends is None else change.ends == tuple(ends[:2])

        actions = tuple(change for change in found.actions if change.aid == owner)
        relations = tuple(change for change in found.relations if belongs(change))
        return shortened(Difference(0, 0, (), actions, relations), {owner})

    def _key(self, conflict: FoundConflict, side: DraftSide) -> Changes:
        """Return the change of one side to the key of a conflict."""
        place = conflict.key or ("meta", "")
        owner, ends = conflict.owner, ends_of(conflict.owner)
        before, after = self._base.get(place), self._sides[side].get(place)
        field = Field(field_of(*place) or "name", before, after)
        label = self.label(owner)
        if ends is not None:
            parent, child = self._name(ends.parent), self._name(ends.child)
            arrow = RelationChange("changed", parent, child, (field,), (ends.parent, ends.child))
            return Changes(relations=(arrow,))
        if is_aid(owner):
            return Changes(actions=(ActionChange("changed", owner, label, (field,)),))
        if owner:
            notes = self._differences[side].notes
            mine: tuple[NoteChange, ...] = tuple(n for n in notes if f"g/{n.id}" == owner)
            return Changes(notes=mine)
        return Changes(fields=(field,))


def _words(root: str, key: str) -> str:
    """Return the words for people that name a field of a document, such as “input speed”. `root`,
    `key`: its root map and key."""
    field = key if root == "meta" else key.partition("|")[2]
    if root == "positions":
        return "text"
    side, slash, path = field.partition("/")
    if slash and side in {"in", "out"}:
        return f"{'input' if side == 'in' else 'output'} {path}"
    return {"": "name", "instance_id": "number"}.get(field, field.replace("_", " "))


def _did(base: Maps, sides: Mapping[DraftSide, Maps]) -> dict[DraftSide, Changes]:
    was, then = _places(base), read_maps(base)
    found: dict[DraftSide, Changes] = {}
    for side, maps in sides.items():
        now = _places(maps)
        touched = (p for p in {*was, *now} if not is_same(was.get(p), now.get(p)))
        found[side] = _changes(then, read_maps(maps), by_owner(touched).keys())
    return found


def _changes(before: Graph, after: Graph, owners: Iterable[str]) -> Changes:
    return shortened(difference((0, before), (0, after)), set(owners))


def other_side(side: DraftSide) -> DraftSide:
    """Return the other side: "draft" for "origin", and "origin" for "draft"."""
    return "draft" if side == "origin" else "origin"


def _side(side: DraftSide, into: DraftSide) -> Side:
    return "ours" if side == into else "theirs"


def _named(side: Side, into: DraftSide) -> DraftSide:
    return into if side == "ours" else other_side(into)


def _places(maps: Maps) -> dict[Place, Any]:
    """Return the values that a merge considers, by root map and key: all but comments."""
    return {
        (root, key): value
        for root in ROOTS
        if root != "comments"
        for key, value in maps[root].items()
        if value is not None
    }


def _maps(places: Mapping[Place, Any]) -> Maps:
    maps: Maps = {root: {} for root in ROOTS}
    for (root, key), value in places.items():
        maps[root][key] = value
    return maps
