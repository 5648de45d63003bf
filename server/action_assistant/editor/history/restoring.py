"""Restores a graph or one action of it, or reverts the edits of one person; each by a new edit.

Workers compute the updates."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import msgspec
from msgspec import UNSET
from sqlalchemy import Connection

from action_assistant.editor.catalogue import server_edits
from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.catalogue.server_edits import StoredEdit, store, store_update
from action_assistant.editor.documents.values import ends_of
from action_assistant.editor.history import index_queries
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.key_changes import (
    LoggedChange,
    Packed,
    Place,
    arrows_of,
    by_owner,
    is_place_of_card,
    owner_of,
    places_of,
    proves,
    unpacked,
)
from action_assistant.editor.interchange.document_edits import setting
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import BadInput, Conflict, NotFound, TooLarge
from action_assistant.journal.journal import Journal
from action_assistant.umrf.model import ENTRY, EXIT
from action_assistant.web.workers.lanes import RunInWorker, run_here


class RevertedEdits(msgspec.Struct, frozen=True):
    """The update that reverts edits. `left`: the actions, arrows and notes, as `owner_of` names
    them, that were not fully reverted, since others have changed or used them."""

    update: bytes
    left: tuple[str, ...]


def reverting_edits(
    connection: Connection, graph: str, state: bytes, author: str, first: int, last: int, limit: int
) -> RevertedEdits | None:
    """Return the update that reverts what `author` changed in a graph from the change `first` to
    `last`; None if there is nothing to revert. `state`: its present document. Raise TooLarge if
    there are more than `limit` changes."""
    changes = index_queries.between(connection, graph, first - 1, last, limit + 1, author)
    if len(changes) > limit:
        raise TooLarge("That is too much to take back at once; go back to the moment before.")
    if not changes:
        return None
    return reverting(state, changes, index_queries.latest_since(connection, graph, first))


def one_as_it_was(connection: Connection, graph: str, state: bytes, seq: int, owner: str) -> bytes:
    """Return the update that restores one action, arrow or note (`owner`: its key) of a graph to
    its state after the change `seq`. `state`: its present document. Raise NotFound if it did not
    exist then."""
    then = index_queries.at(connection, graph, seq)
    if not owner or all(owner_of(*change.place) != owner for change in then):
        raise NotFound(f"There was nothing {owner!r} in this graph after its change {seq}.")
    return as_it_was(state, then, owner)


def reverting(
    state: bytes, changes: Sequence[LoggedChange], latest: Mapping[Place, int]
) -> RevertedEdits:
    """Return the update that reverts `changes`, those of one person in a sitting (edits close in
    time), and what it does not revert. `state`: the present document. `latest`: the number of the
    last change of each key since the sitting began. A field that was set since stays; one that
    another person set during the sitting gets that person's value. A thing made in the sitting is
    removed only if no other person has changed it or connected an arrow to it since; its position
    does not matter."""
    session = _EditSession(changes, places_of(state), latest)
    return RevertedEdits(_setting(state, session.targets()), session.left())


def as_it_was(state: bytes, then: Sequence[LoggedChange], owner: str) -> bytes:
    """Return the update that restores an action, arrow or note (`owner`: its key). `state`: the
    present document; `then`: the changes that made up the graph at that time. A removed action
    comes back with its arrows."""
    now = places_of(state)
    owners = {owner}
    if ("actions", owner) not in now:
        alive = {key for root, key in now if root == "actions" and "|" not in key}
        alive |= {owner, ENTRY, EXIT}
        for each in {owner_of(*change.place) for change in then}:
            ends = ends_of(each)
            if ends is not None and owner in ends[:2] and alive.issuperset(ends[:2]):
                owners.add(each)
    targets: dict[Place, Packed] = {place: None for place in now if owner_of(*place) in owners}
    targets |= {change.place: change.after for change in then if owner_of(*change.place) in owners}
    return _setting(state, targets)


class _EditSession:
    """The changes of one person by key, compared with the present document."""

    def __init__(
        self,
        changes: Sequence[LoggedChange],
        now: Mapping[Place, Any],
        latest: Mapping[Place, int],
    ) -> None:
        self._now = now
        self._latest = latest
        self._first: dict[Place, Packed] = {}
        self._last: dict[Place, LoggedChange] = {}
        for change in changes:
            place, before = change.place, change.before
            if change.root == "comments":
                continue  # what people said stays
            if place not in self._last or self._last[place].after != before:
                self._first[place] = before
            self._last[place] = change
        self._places = by_owner(now)
        self._arrows = arrows_of({_owner(place) for place in latest} & self._places.keys())
        made = {owner for owner in map(_owner, self._first) if self._was_made(owner)}
        self._made = made
        self._kept = set[str]()  # of those, what stays
        while more := {o for o in made - self._kept if self._is_in_use(o)}:
            self._kept |= more

    def targets(self) -> dict[Place, Packed]:
        """Return the old value of each key that is reverted: the one from before this person's
        changes, or the one that another person gave it in between. None stands for a key that had
        no value."""
        return {p: old for p, old in self._first.items() if self._goes_back(p)}

    def left(self) -> tuple[str, ...]:
        """Return the keys of the actions, arrows and notes that are not fully reverted."""
        stay = {
            owner_of(*place)
            for place, old in self._first.items()
            if not self._goes_back(place) and old != self._last[place].after
        }
        return tuple(sorted(stay))

    def _goes_back(self, place: Place) -> bool:
        owner = _owner(place)
        if owner in self._made:
            return owner not in self._kept
        return self._is_untouched(place)

    def _is_mine(self, place: Place) -> bool:
        return place in self._last and self._is_untouched(place)

    def _is_untouched(self, place: Place) -> bool:
        """Return whether a key (`place`: root map and key) still has the value that this person
        gave it last."""
        mine = self._last[place]
        return self._latest[place] == mine.seq and self._now.get(place) == unpacked(mine.after)

    def _was_made(self, owner: str) -> bool:
        """Return whether a thing (`owner`: its key) that exists now was made by the changes of this
        person."""
        proofs = [place for place in self._places.get(owner, ()) if proves(place)]
        return bool(proofs) and all(self._first.get(place, b"") is None for place in proofs)

    def _is_in_use(self, owner: str) -> bool:
        """Return whether others have changed a thing (`owner`: its key), or connected an arrow to
        it that stays."""
        own = [place for place in self._places[owner] if not is_place_of_card(place)]
        if any(place in self._latest and not self._is_mine(place) for place in own):
            return True
        return not self._arrows.get(owner, set()) <= self._made - self._kept


def _owner(place: Place) -> str:
    return owner_of(*place)


def _setting(state: bytes, targets: Mapping[Place, Packed]) -> bytes:
    return setting(
        state, {p: UNSET if value is None else unpacked(value) for p, value in targets.items()}
    )


_MOST: Final = 100_000  # changes of keys that are taken back at once


class EditsOfOne(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to revert the changes of one person (by id) from the change `from_seq` to `seq`."""

    author: str
    from_seq: int
    seq: int


class GoneBack(msgspec.Struct, frozen=True):
    """The result of a restore or revert. `seq`: the last change of the graph now. `left`: keys of
    actions, notes and arrows that were not fully reverted, since others have changed or used
    them."""

    seq: int
    left: tuple[str, ...] = ()


class Restoring:
    """Makes restores and reverts, and records in the log what they are."""

    def __init__(
        self,
        journal: Journal,
        rooms: Rooms,
        graph_reader: GraphReader,
        index: ChangeIndex,
        run_in_worker: RunInWorker = run_here,
    ) -> None:
        self._journal = journal
        self._rooms = rooms
        self._graph_reader = graph_reader
        self._index = index
        self._run_in_worker = run_in_worker

    async def restore(self, graph: str, author: str, seq: int) -> GoneBack:
        """Restore a graph to its state after the change `seq`, in the name of `author`; return its
        last change then. Raise NotFound for an unknown graph, Conflict for an unknown change,
        Unavailable if the journal cannot be read or written."""
        then = await self._graph_reader.at(graph, seq)
        async with self._rooms.reach(h.graph_stream(graph)) as room:
            edit = await server_edits.restore(
                room, author, then.state, run_in_worker=self._run_in_worker
            )
        return await self._said(graph, author, seq, edit)

    async def restore_one(self, graph: str, author: str, seq: int, owner: str) -> GoneBack:
        """Restore one action, arrow or note (`owner`: its key) of a graph to its state after the
        change `seq`, in the name of `author`; return the graph's last change then. Raise NotFound
        if it did not exist then, Conflict for an unknown change, Unavailable if the journal cannot
        be read or written."""
        upto = await self._index.upto(graph)
        if not 1 <= seq <= upto:
            raise Conflict(
                f"This graph has the changes 1 to {upto}; there is no {seq}.",
                where={"path": "/seq"},
            )
        async with self._rooms.reach(h.graph_stream(graph)) as room:
            edit = await store_update(
                room,
                author,
                lambda state, _: self._index.value(one_as_it_was, graph, state, seq, owner),
            )
        return await self._said(graph, author, seq, edit)

    async def revert(self, graph: str, author: str, edits: EditsOfOne) -> GoneBack:
        """Revert the edits of one person in a graph, in the name of `author`; return its last
        change then, and the things that were not fully reverted. Raise BadInput for an impossible
        range, NotFound for an unknown graph or if there was no change, TooLarge for too many
        changes, Unavailable if the journal cannot be read or written."""
        first, last = edits.from_seq, edits.seq
        if not 2 <= first <= last:
            raise BadInput(
                "What a graph began with cannot be taken back, and nothing ends before it begins.",
                where={"path": "/from_seq"},
            )

        async def compute(state: bytes, _: int) -> RevertedEdits:
            upto = await self._index.upto(graph)  # with whatever that state holds
            found = await self._index.value(
                reverting_edits, graph, state, edits.author, first, min(last, upto), _MOST
            )
            if found is None:
                raise NotFound("This person changed nothing then.")
            return found

        async with self._rooms.reach(h.graph_stream(graph)) as room:
            edit = await store(room, author, compute, lambda found: found.update)
        if edit.changed:
            body = h.GraphReverted(edits.author, first, last, edit.seq)
            await self._journal.append(h.about_stream(graph), [h.draft(h.REVERTED, author, body)])
        return GoneBack(edit.seq, edit.computed.left)

    async def _said(self, graph: str, author: str, then: int, edit: StoredEdit[bytes]) -> GoneBack:
        if edit.changed:
            restored = h.draft(h.RESTORED, author, h.GraphRestored(then, edit.seq))
            await self._journal.append(h.about_stream(graph), [restored])
        return GoneBack(edit.seq)
