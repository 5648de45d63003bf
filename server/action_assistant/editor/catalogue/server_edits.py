"""Edits that the server makes itself: made on a copy, then submitted to the room as one update (rule R9)."""

from action_assistant.editor.interchange.document_edits import calling_actions, renaming, restoring
from action_assistant.editor.log.graph_events import DocumentKind
from action_assistant.editor.rooms.room import Room
from action_assistant.web.workers.lanes import RunInWorker, run_here


async def rename(
    room: Room,
    author: str,
    *,
    name: str | None,
    description: str | None,
    kind: DocumentKind = "graph",
    run_in_worker: RunInWorker = run_here,
) -> int:
    """Give the graph or library action (`kind`) in a room another name or description, in the name
    of `author`; None keeps the old one. Return the number (seq) of the last change in its log then.
    Raise BadInput or TooLarge if the edit is refused, Conflict if the log is damaged, Unavailable
    if the room is closed or the edit cannot be stored."""
    state = await room.read(lambda replica, _: replica.state())
    update = await run_in_worker(renaming, state, name, description, kind)
    return await room.submit(update, author)


async def call_actions(
    room: Room, author: str, before: str, name: str, *, run_in_worker: RunInWorker = run_here
) -> bool:
    """Rename all actions called `before` to `name`, as one edit in the name of `author`. Return
    whether there was one. Raise BadInput or TooLarge if the edit is refused, Conflict if the log is
    damaged, Unavailable if the room is closed or the edit cannot be stored."""
    state, seq = await room.read(lambda replica, seq: (replica.state(), seq))
    update = await run_in_worker(calling_actions, state, before, name)
    return await room.submit(update, author) > seq


async def restore(
    room: Room, author: str, then: bytes, *, run_in_worker: RunInWorker = run_here
) -> int:
    """Restore a graph to the content of the document `then` (encoded) by an ordinary edit in the
    name of `author`, which can be undone. Its comments stay as they are now. Return the number
    (seq) of the last change in its log then. Raise BadInput or TooLarge if the edit is refused,
    Conflict if the log is damaged, Unavailable if the room is closed or the edit cannot be stored.
    """
    state = await room.read(lambda replica, _: replica.state())
    return await room.submit(await run_in_worker(restoring, state, then), author)
