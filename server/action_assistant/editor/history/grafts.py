"""Where changes come from that entered a graph from another one: by a merge, or with the making of a draft.

Such a change is the merger's edit in the log of the graph, and somebody else's in the log of the other.
Whoever asks who set a value is told the latter.
"""

from collections import defaultdict
from collections.abc import Collection, Iterable, Sequence
from datetime import datetime

import msgspec
from sqlalchemy import select

from action_assistant.editor.catalogue.people import People
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.key_changes import LoggedChange, Place, owner_of
from action_assistant.editor.log import graph_events as h
from action_assistant.journal.journal import Journal
from action_assistant.schema.editor_tables import editor_event
from action_assistant.web.auth.keys import PersonRef


class Graft(msgspec.Struct, frozen=True):
    """What the change `seq` of a graph brought in was what `source` was after its change `upto`. `name`:
    what the draft is called, None where the graph itself was made as a draft."""

    seq: int
    source: str
    upto: int
    name: str | None = None


class Original(msgspec.Struct, frozen=True):
    """A change in the log in which somebody made it. `via`: the merge by which it entered the graph that
    was asked about, and the number that it has in the log that was merged."""

    change: LoggedChange
    via: Graft | None = None
    seq: int = 0


class MergedBy(msgspec.Struct, frozen=True):
    """How a value came from another graph: which, and its change there; by whom and when it was merged;
    what the draft is called."""

    graph: str
    seq: int
    name: str
    by: PersonRef
    at: datetime


class Grafts:
    """Follows changes to who made them."""

    def __init__(self, journal: Journal, index: ChangeIndex, people: People) -> None:
        self._journal = journal
        self._index = index
        self._people = people

    async def of(self, graph: str) -> dict[int, Graft]:
        """By the change with which something came."""
        event = editor_event.c
        rows = await self._journal.query(
            select(event.kind, event.body).where(
                event.stream == h.about_stream(graph), event.kind.in_([h.DRAFTED, h.MERGED])
            )
        )
        found: dict[int, Graft] = {}
        for row in rows:
            if row.kind == h.DRAFTED:
                made = msgspec.json.decode(row.body, type=h.GraphDrafted)
                found[1] = Graft(1, made.origin, made.seq)
            else:
                merged = msgspec.json.decode(row.body, type=h.GraphMerged)
                if merged.seq:
                    found[merged.seq] = Graft(merged.seq, merged.source, merged.upto, merged.name)
        return found

    async def originals(self, graph: str, changes: Sequence[LoggedChange]) -> list[Original]:
        """Each change as somebody made it, wherever that was. Raises Unavailable."""
        grafts = await self.of(graph)
        found = [Original(change) for change in changes]
        by_graft: dict[int, list[int]] = defaultdict(list)
        for n, change in enumerate(changes):
            if change.seq in grafts:
                by_graft[change.seq].append(n)
        for seq, numbers in by_graft.items():
            graft = grafts[seq]
            there = await self._there(graft, [changes[n] for n in numbers])
            known = [n for n in numbers if changes[n].place in there]
            sources = [there[changes[n].place] for n in known]
            deeper = await self.originals(graft.source, sources)
            for n, source, original in zip(known, sources, deeper, strict=True):
                found[n] = Original(original.change, graft, source.seq)
        return found

    async def _there(
        self, graft: Graft, changes: Iterable[LoggedChange]
    ) -> dict[Place, LoggedChange]:
        """The changes that made the same of the same keys in the other graph, as it was then."""
        await self._index.upto(graft.source, graft.upto)
        wanted = {change.place: change.after for change in changes}
        owners: Collection[str] = {owner_of(*place) for place in wanted}
        last = await self._index.latest(graft.source, graft.upto, of=owners)
        return {
            change.place: change
            for change in last
            if change.place in wanted and change.after == wanted[change.place]
        }

    def merged_by(self, change: LoggedChange, original: Original) -> MergedBy | None:
        """How a change of a graph came there; None of one that was made there, or that a draft began
        with."""
        via = original.via
        if via is None or via.name is None:
            return None
        by = self._people.person(change.author)
        return MergedBy(via.source, original.seq, via.name, by, h.when(change.at))
