"""Edits that the server makes itself: made on a copy, then submitted to the room as one update (rule R9)."""

import time
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Final, Generic, NamedTuple, TypeVar

from action_assistant.editor.interchange.document_edits import calling_actions, renaming, restoring
from action_assistant.editor.log.graph_events import DocumentKind
from action_assistant.editor.rooms.batch import HELD_S
from action_assistant.errors import Overtaken
from action_assistant.web.workers.lanes import RunInWorker, run_here

if TYPE_CHECKING:  # slow to load
    from action_assistant.editor.rooms.remote_room import AnyRoom

T = TypeVar("T")

_TRIES: Final = 5
#: Tries after which the edits of others wait while the edit is computed, if that is quick.
_FREE_TRIES: Final = 2


class StoredEdit(NamedTuple, Generic[T]):
    """An edit of the server that is stored. `computed`: what it was made from; `before`: the last
    change that it takes into account; `seq`: its own number, or `before` if it changed nothing."""

    computed: T
    before: int
    seq: int

    @property
    def changed(self) -> bool:
        """Return whether the edit has changed the document."""
        return self.seq > self.before


class _Computing(Generic[T]):
    """Computes an edit of the server. `took`: the seconds of the last time, also if that failed."""

    def __init__(
        self, compute: Callable[[bytes, int], Awaitable[T]], update_of: Callable[[T], bytes]
    ) -> None:
        self._compute = compute
        self._update_of = update_of
        self._last: tuple[T, int]
        self.took = 0.0

    async def update(self, state: bytes, seq: int) -> bytes:
        """Compute the edit from a document (encoded) and the number of its last change, and return
        its update."""
        begun = time.monotonic()
        try:
            computed = await self._compute(state, seq)
        finally:
            self.took = time.monotonic() - begun
        self._last = computed, seq
        return self._update_of(computed)

    def stored(self, seq: int) -> StoredEdit[T]:
        """Return the edit that was computed last, once it is stored. `seq`: its number."""
        return StoredEdit(*self._last, seq)


async def store(
    room: "AnyRoom",
    author: str,
    compute: Callable[[bytes, int], Awaitable[T]],
    update_of: Callable[[T], bytes],
    *,
    insists: bool = False,
) -> StoredEdit[T]:
    """Store an edit of the server that depends on what the document holds, in the name of `author`.
    `compute` is given the document (encoded) and the number of its last change; `update_of` returns
    the update of what it returns. If people change the document meanwhile, it is computed again: an
    update made without their edits could remove or replace what they have set. After a few times their
    edits wait meanwhile, unless to compute it takes longer than `HELD_S`; `compute` must not ask the
    room. Where it sets values of its own only (`insists`), it is stored at the last try whatever they
    have changed. Raise what `compute` raises; Overtaken, when nothing is stored, if people were faster
    each time; BadInput or TooLarge if the edit is refused, Conflict if the log is damaged, Unavailable
    if the room is closed or the edit cannot be stored."""
    computing = _Computing(compute, update_of)
    for tries in range(_TRIES):
        try:
            if tries >= _FREE_TRIES and computing.took < HELD_S:
                seq = await room.submit_in_turn(author, computing.update)
            else:
                before, state = await room.now()
                update = await computing.update(state, before)
                expected = None if insists and tries + 1 == _TRIES else before
                seq = await room.submit(update, author, expected=expected)
        except Overtaken:
            continue
        return computing.stored(seq)
    raise Overtaken(
        f"Others have changed this {_TRIES} times while the edit was worked out, so it was not made "
        "here; try again."
    )


async def store_update(
    room: "AnyRoom",
    author: str,
    compute: Callable[[bytes, int], Awaitable[bytes]],
    *,
    insists: bool = False,
) -> StoredEdit[bytes]:
    """Do what `store` does, with the update that `compute` returns."""
    return await store(room, author, compute, lambda update: update, insists=insists)


async def rename(
    room: "AnyRoom",
    author: str,
    *,
    name: str | None,
    description: str | None,
    kind: DocumentKind = "graph",
    run_in_worker: RunInWorker = run_here,
) -> int:
    """Give the graph or library action (`kind`) in a room another name or description, in the name
    of `author`; None keeps the old one. Return the number (seq) of this edit, or of the last change
    if it changed nothing. Raise the errors of `store`."""
    edit = await store_update(
        room,
        author,
        lambda state, _: run_in_worker(renaming, state, name, description, kind),
        insists=True,
    )
    return edit.seq


async def call_actions(
    room: "AnyRoom", author: str, before: str, name: str, *, run_in_worker: RunInWorker = run_here
) -> bool:
    """Rename all actions called `before` to `name`, as one edit in the name of `author`. Return
    whether there was one. Raise the errors of `store`."""
    edit = await store_update(
        room, author, lambda state, _: run_in_worker(calling_actions, state, before, name)
    )
    return edit.changed


async def restore(
    room: "AnyRoom", author: str, then: bytes, *, run_in_worker: RunInWorker = run_here
) -> StoredEdit[bytes]:
    """Restore a graph to the content of the document `then` (encoded) by an ordinary edit in the
    name of `author`, which can be undone. Its comments stay as they are now. Raise the errors of
    `store`."""
    return await store_update(room, author, lambda state, _: run_in_worker(restoring, state, then))
