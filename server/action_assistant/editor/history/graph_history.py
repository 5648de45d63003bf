"""The history of a graph: events of its two streams by session, with what each session changed.

A session holds the edits of one person with short pauses.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import datetime
from typing import Any, Final, Literal, NamedTuple, TypeAlias

import msgspec
from msgspec.structs import replace
from sqlalchemy import Connection, Row, and_, or_, select

from action_assistant.editor.catalogue.versions import VersionView, versions_by_event
from action_assistant.editor.documents.values import ends_of
from action_assistant.editor.history import index_queries
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.change_summaries import Changes, Stretch, told
from action_assistant.editor.history.key_changes import LoggedChange, OverwrittenValue, owner_of
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.people.people import stored_people
from action_assistant.journal.slots import order_in_time
from action_assistant.schema import editor_tables
from action_assistant.web.auth.keys import PersonRef

_ONE_GO: Final = 5 * 60  # seconds between two edits of one session

Kind: TypeAlias = Literal[
    "created",
    "imported",
    "edited",
    "published",
    "restored",
    "reverted",
    "adapted",
    "merged",
    "deleted",
    "recovered",
]


class Step(NamedTuple):
    """An event to be grouped. `seq`: the change of the document; None if it is none. `told`: for an
    event about the graph, its seq in that other stream; 0 for a change."""

    kind: Kind
    author: str
    at: datetime
    seq: int | None
    told: int = 0


class EditSession(msgspec.Struct, frozen=True):
    """The edits of one person between `at` and `until`, from the change `from_seq` to `seq`; others
    may have edited in between. For an entry that is no edit, `from_seq` is None and `seq` is the
    change before it."""

    kind: Kind
    author: str
    at: datetime
    until: datetime
    seq: int
    from_seq: int | None = None
    told: int = 0


def edit_sessions(steps: Iterable[Step]) -> list[EditSession]:
    """Return steps, which are in order of time, grouped into sessions, sorted by their ends. A step
    that is no edit ends all open sessions, since it may refer to the document at that time."""
    done: dict[int, EditSession] = {}
    open_of: dict[str, int] = {}
    seq = 1
    for number, step in enumerate(steps):
        seq = step.seq or seq
        if step.kind == "imported" and done:
            before = done.popitem()[1]
            done[number] = replace(before, kind="imported")
        elif (
            step.kind == "created" and done
        ):  # a large file is stored before the graph that was made of it
            continue
        elif step.kind == "edited":
            mine = done.pop(open_of.get(step.author, -1), None)
            if mine is not None and (step.at - mine.until).total_seconds() >= _ONE_GO:
                done[open_of[step.author]] = mine
                mine = None
            begun = EditSession("edited", step.author, step.at, step.at, seq, seq)
            done[number] = begun if mine is None else replace(mine, until=step.at, seq=seq)
            open_of[step.author] = number
        else:
            open_of.clear()
            changed = seq if step.seq is not None and step.kind != "created" else None
            done[number] = EditSession(
                step.kind, step.author, step.at, step.at, seq, changed, step.told
            )
    return [done[number] for number in sorted(done)]


_EVENTS: Final = (2_000, 10_000)  # that one answer looks at, if the fewer are not enough
_CHANGES: Final = 20_000  # of keys that one answer tells of

#: Events about a graph as a whole, and what history calls them.
_WHOLE: Final[Mapping[str, Kind]] = {
    h.CREATED: "created",
    h.IMPORTED: "imported",
    h.PUBLISHED: "published",
    h.DELETED: "deleted",
    h.RECOVERED: "recovered",
}


class TakenFrom(msgspec.Struct, frozen=True):
    """The document whose parameters were taken over, "" for a file, its change then, and the name of
    the action. `document`: null for a graph that the person who asks may not see."""

    document: str | None
    seq: int
    action: str


class Reverted(msgspec.Struct, frozen=True):
    """The edits that were reverted: their author, the first and the last change."""

    author: PersonRef
    from_seq: int
    seq: int


class MergedIn(msgspec.Struct, frozen=True):
    """The edits that were merged: the changes `from_seq` to `seq` of the graph `source`, and their authors.
    `source` is the draft called `name`, or the graph of which that is a draft."""

    draft: str
    name: str
    source: str
    from_seq: int
    seq: int
    authors: tuple[PersonRef, ...]


#: The change that was gone back to, of what parameters were taken over, what was taken back or merged.
_Special: TypeAlias = int | TakenFrom | Reverted | MergedIn


class HistoryEntry(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """One entry of the history of a graph, from `at` to `until`.

    `seq`: the change after which `…/umrf?at=` and `…/restore` show the graph after this entry.
    Edits begin at `from_seq`, and others may have edited in between. `restored`: the change that
    was restored; `adapted`: the change of the action whose parameters were taken over; `reverted`:
    the edits that were reverted; `merged`: the edits that were merged. `changes`: what this person
    changed; None if there is nothing or too much to list.
    """

    kind: Kind
    author: PersonRef
    at: datetime
    until: datetime
    seq: int
    from_seq: int | None = None
    restored: int | None = None
    adapted: TakenFrom | None = None
    reverted: Reverted | None = None
    merged: MergedIn | None = None
    version: VersionView | None = None
    changes: Changes | None = None


class GraphHistory:
    """Answers, for a page of a graph's history, what happened to it, as JSON that a worker wrote."""

    def __init__(self, index: ChangeIndex) -> None:
        self._index = index

    async def of(self, graph: str, *, limit: int, before: int | None) -> bytes:
        """Return the JSON of up to `limit` `HistoryEntry`s of a graph, newest first; with `before`,
        only entries before that change. Raise Unavailable if the journal cannot be read."""
        if last := await self._index.value(last_edit_of, graph, limit, before):
            await self._index.upto(graph, last)
        return await self._index.text(history_of, graph, limit, before)


def without_hidden(entries: bytes, sees: Callable[[str], bool]) -> bytes:
    """Return entries of a history (JSON) without the ids of graphs to which `sees` says no."""
    if b'"adapted":' not in entries:
        return entries
    found: list[dict[str, Any]] = msgspec.json.decode(entries)
    sources = [entry["adapted"] for entry in found if "adapted" in entry]
    for source in sources:
        if source["document"] and not sees(source["document"]):
            source["document"] = None
    return msgspec.json.encode(found)


def history_of(
    connection: Connection, graph: str, limit: int, before: int | None
) -> list[HistoryEntry]:
    """Return the newest entries of a graph's history, newest first, at most `limit`. `before`: the
    number of a change of the graph; only entries older than that change are returned; None for
    the newest ones."""
    person = stored_people(connection)
    versions = versions_by_event(connection, graph)
    special = _special(connection, graph, person)
    shown = _shown(connection, graph, special, limit, before)
    changes = _changes(connection, graph, shown)
    return [
        _entry(session, special, versions, changes.get((session.author, session.seq)), person)
        for session in shown
    ]


def last_edit_of(connection: Connection, graph: str, limit: int, before: int | None) -> int:
    """Return the number of the last change that a page of the history shows, up to which it needs
    the index; 0 if it shows none. The page has at most `limit` entries, from before the change
    `before` (None: the newest)."""
    special = _special(connection, graph, stored_people(connection))
    edits = _edits(_shown(connection, graph, special, limit, before))
    return max((each.last for each in edits), default=0)


def _shown(
    connection: Connection,
    graph: str,
    special: Mapping[int, _Special],
    limit: int,
    before: int | None,
) -> list[EditSession]:
    return _edit_sessions(connection, graph, special, limit, before)[::-1][:limit]


def _edits(shown: Sequence[EditSession]) -> list[Stretch]:
    """Return the sessions of a page that changed the document, as stretches of changes."""
    return [
        Stretch(session.author, session.from_seq, session.seq)
        for session in shown
        if session.from_seq is not None and session.seq > 1
    ]


def _edit_sessions(
    connection: Connection,
    graph: str,
    special: Mapping[int, _Special],
    limit: int,
    before: int | None,
) -> list[EditSession]:
    """Return more than `limit` sessions of a graph before the change `before` (None: the newest),
    or all that there are. The first one may be incomplete. `special`: restores, reverts and merges
    by seq."""
    for most in _EVENTS:
        rows = _rows(connection, graph, before, most)
        found = edit_sessions(step for row in reversed(rows) if (step := _step(row, special)))
        if len(found) > limit or len(rows) < most:
            break
    return found


def _entry(
    session: EditSession,
    special: Mapping[int, _Special],
    versions: Mapping[int, VersionView],
    changes: Changes | None,
    person: Callable[[str], PersonRef],
) -> HistoryEntry:
    how = special.get(session.seq) if session.from_seq is not None else None
    version = versions[session.told] if session.kind == "published" else None
    return HistoryEntry(
        kind=session.kind,
        author=person(session.author),
        at=session.at,
        until=session.until,
        seq=session.seq if version is None else version.seq,
        from_seq=session.from_seq,
        restored=how if isinstance(how, int) else None,
        adapted=how if isinstance(how, TakenFrom) else None,
        reverted=how if isinstance(how, Reverted) else None,
        merged=how if isinstance(how, MergedIn) else None,
        version=version,
        changes=changes,
    )


def _changes(
    connection: Connection, graph: str, shown: Sequence[EditSession]
) -> dict[tuple[str, int], Changes]:
    """Return the changes that each session made, keyed by the author of the session and the number
    of its last change. Old sessions are missing if all of them together have too many changes to
    read."""
    edits = _edits(shown)
    if not edits:
        return {}
    last = max(each.last for each in edits)
    first = max(min(each.first for each in edits), 2)
    rows = index_queries.between(connection, graph, first - 1, last, _CHANGES + 1)
    if len(rows) > _CHANGES:
        first = rows[0].seq + 1  # of which not everything may be here
        rows = [row for row in rows if row.seq >= first]
    edits = [each for each in edits if each.first >= first]
    lost = index_queries.overwritten_between(connection, graph, first - 1, last, _CHANGES)
    base = index_queries.at(connection, graph, first - 1, _touched([*rows, *lost]))
    found = told(base, rows, edits, lost)
    return {(e.author, e.last): each for e, each in zip(edits, found, strict=True)}


def _rows(connection: Connection, graph: str, before: int | None, most: int) -> list[Row[Any]]:
    event = editor_tables.editor_event.c
    document = h.graph_stream(graph)
    order = order_in_time(connection, event.position, event.at, event.seq)
    chosen = (
        select(event.seq, event.kind, event.author, event.at)
        .where(event.stream.in_([document, h.about_stream(graph)]))
        .order_by(*(column.desc() for column in order))
        .limit(most)
    )
    if before is not None:
        first = order[0]
        there = select(first).where(event.stream == document, event.seq == before)
        earlier = first < there.scalar_subquery()
        if first is event.at:  # events of one batch have the same time
            same = and_(event.stream == document, event.seq < before)
            earlier = or_(same, and_(event.stream != document, earlier))
        chosen = chosen.where(earlier)
    return list(connection.execute(chosen))


def _special(
    connection: Connection, graph: str, person: Callable[[str], PersonRef]
) -> dict[int, _Special]:
    """Return, by seq, the changes of a graph that were a restore, an adaption, a revert or a merge,
    with what the log says of them. A merge that changed nothing has the key 0. `person`: returns
    the person of an author's id."""
    event = editor_tables.editor_event.c
    kinds = [h.RESTORED, h.ADAPTED, h.REVERTED, h.MERGED]
    chosen = select(event.kind, event.body).where(
        event.stream == h.about_stream(graph), event.kind.in_(kinds)
    )
    found: dict[int, _Special] = {}
    for row in connection.execute(chosen):
        match row.kind:
            case h.RESTORED:
                restored = msgspec.json.decode(row.body, type=h.GraphRestored)
                found[restored.seq] = restored.restored
            case h.ADAPTED:
                adapted = msgspec.json.decode(row.body, type=h.GraphAdapted)
                found[adapted.seq] = TakenFrom(adapted.source, adapted.at, adapted.name)
            case h.MERGED:
                merged = msgspec.json.decode(row.body, type=h.GraphMerged)
                found[merged.seq] = _merged(merged, person)
            case _:
                back = msgspec.json.decode(row.body, type=h.GraphReverted)
                found[back.seq] = Reverted(person(back.author), back.from_seq, back.upto)
    return found


def _merged(merged: h.GraphMerged, person: Callable[[str], PersonRef]) -> MergedIn:
    authors = tuple(person(each) for each in merged.authors)
    of = (merged.draft, merged.name, merged.source)
    return MergedIn(*of, merged.from_seq, merged.upto, authors)


def _step(row: Row[Any], special: Mapping[int, _Special]) -> Step | None:
    """Return the event in `row` as a step to be grouped; None if the history does not show it.
    `special`: restores, reverts and merges by seq."""
    at = h.when(row.at)
    if row.kind in {h.UPDATED, h.DEFERRED}:
        if row.seq == 1:
            return None  # what the graph was created with
        match special.get(row.seq):
            case int():
                return Step("restored", row.author, at, row.seq)
            case TakenFrom():
                return Step("adapted", row.author, at, row.seq)
            case Reverted():
                return Step("reverted", row.author, at, row.seq)
            case MergedIn():
                return Step("merged", row.author, at, row.seq)
            case _:
                return Step("edited", row.author, at, row.seq)
    kind = _WHOLE.get(row.kind)
    if kind is None:
        return None
    return Step(kind, row.author, at, 1 if kind == "created" else None, row.seq)


def _touched(rows: Sequence[LoggedChange | OverwrittenValue]) -> set[str]:
    """Return the keys of the actions, arrows and notes that these rows changed, and of the actions
    at both ends of changed arrows."""
    owners = {owner_of(row.root, row.key) for row in rows}
    ends = {end for owner in owners if (found := ends_of(owner)) for end in found[:2]}
    return owners | ends
