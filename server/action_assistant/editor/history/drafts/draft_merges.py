"""Merges of drafts: what one would do, and doing it as an edit of the server's own."""

from collections.abc import Mapping
from typing import Final

import msgspec

from action_assistant.editor.catalogue.graph_checks import GraphChecks
from action_assistant.editor.catalogue.people import People
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.drafts.drafts import DraftPair, Drafts
from action_assistant.editor.history.drafts.told_merges import (
    DraftConflict,
    DraftSide,
    FoundMerge,
    merging,
)
from action_assistant.editor.history.grafts import Grafts
from action_assistant.editor.history.key_changes import owner_of
from action_assistant.editor.history.told_changes import Changes
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import Conflict
from action_assistant.journal.journal import Journal
from action_assistant.umrf.model import Problem
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.workers.lanes import RunInWorker, run_here

_TOLD: Final = 50  # places of conflicts in a refusal


class AskedMerge(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Into which side what the other did is brought, and whose value counts where both changed the same,
    by the places of the conflicts."""

    into: DraftSide = "origin"
    choices: dict[str, DraftSide] = {}


class WantedMerge(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The merge that was looked at: of the origin as it was after its change `seq`, and of the draft after
    its change `draft_seq`."""

    seq: int
    draft_seq: int
    into: DraftSide = "origin"
    choices: dict[str, DraftSide] = {}


class MergePreview(msgspec.Struct, frozen=True, kw_only=True):
    """What a merge would do to the side `into`, where everything that has no choice stays as it is there.

    `seq`, `draft_seq`: the moments that it is about. `changes`: what would change. `problems`: those that this side has not now.
    `umrf`: the text of what comes of it. `authors`: whose changes they are. `origin_did`, `draft_did`: what each side did since they were one.
    """

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
    """The side into which was merged, and how far its log goes now; whether that changed anything."""

    graph: str
    seq: int
    changed: bool


class DraftMerges:
    """Looks at merges, and makes them."""

    def __init__(
        self,
        journal: Journal,
        rooms: Rooms,
        drafts: Drafts,
        index: ChangeIndex,
        grafts: Grafts,
        people: People,
        checks: GraphChecks,
        run_in_worker: RunInWorker = run_here,
    ) -> None:
        self._journal = journal
        self._rooms = rooms
        self._drafts = drafts
        self._index = index
        self._grafts = grafts
        self._people = people
        self._checks = checks
        self._run_in_worker = run_in_worker

    async def preview(self, draft: str, asked: AskedMerge) -> MergePreview:
        """What a merge would do now; nothing is stored. Raises NotFound, Unavailable."""
        pair = await self._drafts.pair(draft)
        found = await self._found(pair, asked.into, asked.choices)
        authors = await self._authors(pair, asked.into, found)
        return MergePreview(
            into=asked.into,
            seq=pair.origin.seq,
            draft_seq=pair.draft.seq,
            changes=found.changes,
            conflicts=found.conflicts,
            problems=found.problems,
            umrf=found.umrf,
            authors=tuple(self._people.person(each) for each in authors),
            origin_did=found.did["origin"],
            draft_did=found.did["draft"],
        )

    async def merge(self, draft: str, author: str, wanted: WantedMerge) -> MergedDraft:
        """Bring in what the other side did. Raises Conflict where either has moved on since it was looked
        at, or something has no choice; NotFound, Unavailable."""
        row = (await self._drafts.pair(draft)).row
        target: str = row.draft_of if wanted.into == "origin" else draft
        async with self._rooms.enter(h.graph_stream(target)) as room:
            pair = await self._drafts.pair(draft)
            _require_moments(pair, wanted)
            found = await self._found(pair, wanted.into, wanted.choices)
            _require_choices(found, wanted.choices)
            authors = await self._authors(pair, wanted.into, found)
            seen = wanted.seq if wanted.into == "origin" else wanted.draft_seq
            if room.seq != seen:
                raise _moved_on(wanted.into)
            now = await room.submit(found.update, author)
        seq = await self._entered(target, seen, now, found.update)
        source = pair.draft if wanted.into == "origin" else pair.origin
        if seq or found.conflicts:
            since = await self._since(pair, source.graph, target)
            body = h.GraphMerged(
                draft, pair.row.draft_name, source.graph, since, source.seq, seq, authors
            )
            await self._journal.append(h.about_stream(target), [h.draft(h.MERGED, author, body)])
        return MergedDraft(target, now, seq > 0)

    async def _entered(self, graph: str, before: int, now: int, update: bytes) -> int:
        """Which change the update became, others perhaps beside it; 0 when it changed nothing."""
        events = await self._journal.read(h.graph_stream(graph), after=before, upto=now)
        return next((event.seq for event in events if event.body == update), 0)

    async def _found(
        self, pair: DraftPair, into: DraftSide, choices: Mapping[str, DraftSide]
    ) -> FoundMerge:
        sides = (pair.origin, pair.draft) if into == "origin" else (pair.draft, pair.origin)
        inside = await self._checks.inside(*sides)
        return await self._run_in_worker(
            merging, pair.base, pair.origin, pair.draft, into, dict(choices), inside
        )

    async def _authors(
        self, pair: DraftPair, into: DraftSide, found: FoundMerge
    ) -> tuple[str, ...]:
        """Whose changes the keys that are set hold, the last one first."""
        source = pair.draft if into == "origin" else pair.origin
        await self._index.upto(source.graph, source.seq)
        owners = {owner_of(*place) for place in found.places}
        last = await self._index.latest(source.graph, source.seq, of=owners)
        wanted = [change for change in last if change.place in set(found.places)]
        originals = await self._grafts.originals(source.graph, wanted)
        newest = sorted(originals, key=lambda each: each.change.at, reverse=True)
        return tuple(dict.fromkeys(each.change.author for each in newest))

    async def _since(self, pair: DraftPair, source: str, target: str) -> int:
        """The first change of one side that the other has not been given."""
        if pair.row.base_graph == source:
            return int(pair.row.base_seq) + 1
        grafts = await self._grafts.of(source)
        merged = [graft.seq for graft in grafts.values() if graft.source == target]
        return max(merged, default=int(pair.row.drafted_seq)) + 1


def _require_moments(pair: DraftPair, wanted: WantedMerge) -> None:
    if pair.origin.seq != wanted.seq:
        raise _moved_on("origin")
    if pair.draft.seq != wanted.draft_seq:
        raise _moved_on("draft")


def _require_choices(found: FoundMerge, choices: Mapping[str, DraftSide]) -> None:
    """Raises Conflict where something has no choice."""
    left = [conflict for conflict in found.conflicts if conflict.place not in choices]
    if left:
        things = "one thing" if len(left) == 1 else f"{len(left)} things"
        named = ", ".join(conflict.what for conflict in left[:3])
        raise Conflict(
            f"Both sides changed {things}, and it is not said whose counts: {named}"
            f"{' and others' if len(left) > 3 else ''}.",
            where={"places": [conflict.place for conflict in left[:_TOLD]]},
        )


def _moved_on(side: DraftSide) -> Conflict:
    what = "The graph" if side == "origin" else "The draft"
    return Conflict(
        f"{what} was changed since this merge was looked at. Nothing was written.",
        where={"side": side},
    )
