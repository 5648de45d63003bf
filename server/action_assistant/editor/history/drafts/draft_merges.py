"""Previews merges of drafts, and merges them by an edit of the server."""

import msgspec

from action_assistant.editor.catalogue.graph_checks import GraphChecks
from action_assistant.editor.catalogue.server_edits import store
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.change_summaries import Changes
from action_assistant.editor.history.drafts.drafts import DraftPair, Drafts
from action_assistant.editor.history.drafts.merge_previews import (
    DraftConflict,
    DraftMerge,
    DraftSide,
    DraftSides,
    MadeMerge,
    UnmadeChoices,
    made_merge,
    other_side,
    previewed,
)
from action_assistant.editor.history.merge_origins import bring_up, grafts_of
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.people.people import People
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.editor.workers import encoded
from action_assistant.errors import Conflict
from action_assistant.journal.journal import Journal
from action_assistant.umrf.model import Problem
from action_assistant.web.auth.keys import PersonRef


class AskedMerge(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The side that the other side's changes are merged into, and, by the place of a conflict, the
    side whose value is chosen."""

    into: DraftSide = "origin"
    choices: dict[str, DraftSide] = {}


class WantedMerge(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The merge that was previewed: of the origin after its change `seq`, and of the draft after
    its change `draft_seq`."""

    seq: int
    draft_seq: int
    into: DraftSide = "origin"
    choices: dict[str, DraftSide] = {}


class MergePreview(msgspec.Struct, frozen=True, kw_only=True):
    """The effect of a merge on the side `into`, where a conflict without a choice keeps this side's
    value. `seq`, `draft_seq`: the compared changes of origin and draft. `changes`: what would
    change. `problems`: those that would be new. `umrf`: the resulting text. `authors`: the
    people whose changes are merged. `origin_did`, `draft_did`: the changes of each side since
    the last merge."""

    into: DraftSide
    seq: int
    draft_seq: int
    changes: Changes
    conflicts: tuple[DraftConflict, ...]
    problems: tuple[Problem, ...]
    umrf: str
    authors: tuple[PersonRef, ...]
    origin_did: Changes
    draft_did: Changes


class MergedDraft(msgspec.Struct, frozen=True):
    """The graph that was merged into, its last change now, and whether the merge changed it."""

    graph: str
    seq: int
    changed: bool


class DraftMerges:
    """Previews and makes merges of drafts."""

    def __init__(
        self,
        journal: Journal,
        rooms: Rooms,
        drafts: Drafts,
        index: ChangeIndex,
        people: People,
        checks: GraphChecks,
    ) -> None:
        self._journal = journal
        self._rooms = rooms
        self._drafts = drafts
        self._index = index
        self._people = people
        self._checks = checks

    async def preview(self, draft: str, asked: AskedMerge) -> MergePreview:
        """Compute the merge of a draft (`asked`: into which side, with which choices) without
        storing anything. Raise NotFound for an unknown draft, Unavailable if the journal cannot be
        read."""
        sides = (await self._drafts.pair(draft)).sides
        found = await self._index.value(previewed, await self._merge(sides, asked))
        return MergePreview(
            into=asked.into,
            seq=sides.origin.seq,
            draft_seq=sides.draft.seq,
            changes=encoded(Changes, found.changes),
            conflicts=encoded(tuple[DraftConflict, ...], found.conflicts),
            problems=encoded(tuple[Problem, ...], found.problems),
            umrf=encoded(str, found.umrf),
            authors=tuple(self._people.person(each) for each in found.authors),
            origin_did=encoded(Changes, found.origin_did),
            draft_did=encoded(Changes, found.draft_did),
        )

    async def merge(self, draft: str, author: str, wanted: WantedMerge) -> MergedDraft:
        """Merge a draft with its origin, as it was previewed (`wanted`), by one edit in the name of
        `author`; return the graph that was changed. Raise Conflict if a side has changed since the
        preview or a conflict has no choice; NotFound for an unknown draft; Unavailable if the
        journal cannot be written."""
        row = (await self._drafts.pair(draft)).row
        target: str = row.draft_of if wanted.into == "origin" else draft
        seen = wanted.seq if wanted.into == "origin" else wanted.draft_seq

        async def compute(_: bytes, seq: int) -> tuple[DraftPair, DraftMerge, MadeMerge]:
            pair = await self._drafts.pair(draft)
            _require_moments(pair.sides, wanted)
            if seq != seen:
                raise _moved_on(wanted.into)
            merge = await self._merge(pair.sides, wanted)
            found = await self._index.value(made_merge, merge)
            _require_choices(found.left)
            return pair, merge, found

        async with self._rooms.reach(h.graph_stream(target)) as room:
            edit = await store(room, author, compute, lambda computed: computed[2].update)
        pair, merge, found = edit.computed
        if edit.changed or found.any_conflicts:
            source = merge.source
            since = await self._since(pair, source.graph, target)
            seq = edit.seq if edit.changed else 0
            body = h.GraphMerged(
                draft, pair.row.draft_name, source.graph, since, source.seq, seq, found.authors
            )
            await self._journal.append(h.about_stream(target), [h.draft(h.MERGED, author, body)])
        return MergedDraft(target, edit.seq, edit.changed)

    async def _merge(self, sides: DraftSides, asked: AskedMerge | WantedMerge) -> DraftMerge:
        """Return the merge to compute for a request, once the index has the side that is brought
        in, for its authors."""
        source, target = sides.of(other_side(asked.into)), sides.of(asked.into)
        await bring_up(self._index, source.graph, source.seq)
        inside = await self._checks.inside(target, source)
        return DraftMerge(sides, asked.into, asked.choices, inside)

    async def _since(self, pair: DraftPair, source: str, target: str) -> int:
        """Return the first change of the graph `source` (one side of a draft) that was not merged
        into `target`, the other side."""
        if pair.row.base_graph == source:
            return int(pair.row.base_seq) + 1
        grafts = await self._index.value(grafts_of, source)
        merged = [graft.seq for graft in grafts.values() if graft.source == target]
        return max(merged, default=int(pair.row.drafted_seq)) + 1


def _require_moments(sides: DraftSides, wanted: WantedMerge) -> None:
    if sides.origin.seq != wanted.seq:
        raise _moved_on("origin")
    if sides.draft.seq != wanted.draft_seq:
        raise _moved_on("draft")


def _require_choices(left: UnmadeChoices | None) -> None:
    """Raise Conflict if there are conflicts without a choice (`left`; None: no conflict lacks one)."""
    if left is not None:
        things = "one thing" if left.count == 1 else f"{left.count} things"
        raise Conflict(
            f"Both sides changed {things}, and it is not said whose counts: {', '.join(left.what)}"
            f"{' and others' if left.count > len(left.what) else ''}.",
            where={"places": list(left.places)},
        )


def _moved_on(side: DraftSide) -> Conflict:
    what = "The graph" if side == "origin" else "The draft"
    return Conflict(
        f"{what} was changed since this merge was looked at. Nothing was written.",
        where={"side": side},
    )
