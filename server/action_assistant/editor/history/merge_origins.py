"""Finds the origin of changes that came from another graph, by a merge or when a draft was made.

Such a change is the merger's edit in the log of the graph, and somebody else's in the log of the other.
Whoever asks who set a value is told the latter. Questions over a connection: for workers.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from datetime import datetime

import msgspec
from sqlalchemy import Connection, select

from action_assistant.editor.history import index_queries
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.key_changes import LoggedChange, Place, owner_of
from action_assistant.editor.log import graph_events as h
from action_assistant.schema.editor_tables import editor_event
from action_assistant.web.auth.keys import PersonRef


class MergeOrigin(msgspec.Struct, frozen=True):
    """The origin of the change `seq` of a graph: a merge of the graph `source` up to its change
    `upto`. `name`: the name of the draft; None if the graph was made as a draft of `source`."""

    seq: int
    source: str
    upto: int
    name: str | None = None


class Original(msgspec.Struct, frozen=True):
    """A change where it was first made. `via`: the merge that brought it into the given graph, None
    if it was made there; `seq`: its number in the log of the merged graph."""

    change: LoggedChange
    via: MergeOrigin | None = None
    seq: int = 0


class MergedBy(msgspec.Struct, frozen=True):
    """The origin of a merged value: the graph and its change there, who merged it and when, and the
    name of the draft."""

    graph: str
    seq: int
    name: str
    by: PersonRef
    at: datetime


async def bring_up(index: ChangeIndex, graph: str, seq: int | None = None) -> int:
    """Bring the index of a graph up to the change `seq` (None: the newest), and also the indexes of
    all graphs from which changes were merged into it. Return the last indexed seq of `graph`.
    Raise Unavailable if the journal cannot be read."""
    done = await index.upto(graph, seq)
    asked = {(graph, done)}
    waiting = list(await index.value(sources, graph))
    while waiting:
        source, upto = waiting.pop()
        if (source, upto) not in asked:
            asked.add((source, upto))
            await index.upto(source, upto)
            waiting += await index.value(sources, source)
    return done


def sources(connection: Connection, graph: str) -> list[tuple[str, int]]:
    """Return the ids of the graphs from which changes came into this graph, by a merge or when it
    was made as a draft, each with the number of its last change that came."""
    return sorted({(graft.source, graft.upto) for graft in grafts_of(connection, graph).values()})


def grafts_of(connection: Connection, graph: str) -> dict[int, MergeOrigin]:
    """Return the merges into a graph, and its beginning as a draft, by the number of the change
    that each made."""
    event = editor_event.c
    rows = connection.execute(
        select(event.kind, event.body).where(
            event.stream == h.about_stream(graph), event.kind.in_([h.DRAFTED, h.MERGED])
        )
    )
    found: dict[int, MergeOrigin] = {}
    for row in rows:
        if row.kind == h.DRAFTED:
            made = msgspec.json.decode(row.body, type=h.GraphDrafted)
            found[1] = MergeOrigin(1, made.origin, made.seq)
        else:
            merged = msgspec.json.decode(row.body, type=h.GraphMerged)
            if merged.seq:
                found[merged.seq] = MergeOrigin(merged.seq, merged.source, merged.upto, merged.name)
    return found


def originals(
    connection: Connection, graph: str, changes: Sequence[LoggedChange]
) -> list[Original]:
    """Return, for each of `changes` of a graph, the change by which the value was first made, in
    this graph or a merged one. Call `bring_up` first."""
    grafts = grafts_of(connection, graph)
    found = [Original(change) for change in changes]
    by_graft: dict[int, list[int]] = defaultdict(list)
    for n, change in enumerate(changes):
        if change.seq in grafts:
            by_graft[change.seq].append(n)
    for seq, numbers in by_graft.items():
        graft = grafts[seq]
        there = _there(connection, graft, [changes[n] for n in numbers])
        known = [n for n in numbers if changes[n].place in there]
        made = [there[changes[n].place] for n in known]
        deeper = originals(connection, graft.source, made)
        for n, source, original in zip(known, made, deeper, strict=True):
            found[n] = Original(original.change, graft, source.seq)
    return found


def _there(
    connection: Connection, graft: MergeOrigin, changes: Iterable[LoggedChange]
) -> dict[Place, LoggedChange]:
    """Return, by place, the changes in the merged graph (`graft`) that gave the same keys the same
    values as `changes`."""
    wanted = {change.place: change.after for change in changes}
    owners = {owner_of(*place) for place in wanted}
    return {
        change.place: change
        for change in index_queries.latest(connection, graft.source, graft.upto, owners)
        if change.place in wanted and change.after == wanted[change.place]
    }


def merged_by(
    change: LoggedChange, original: Original, person: Callable[[str], PersonRef]
) -> MergedBy | None:
    """Return how a change came into the graph; None if it was made in the graph or the draft began
    with it. `original`: where the value was first made; `person`: returns the person of an author's
    id."""
    via = original.via
    if via is None or via.name is None:
        return None
    by = person(change.author)
    return MergedBy(via.source, original.seq, via.name, by, h.when(change.at))
