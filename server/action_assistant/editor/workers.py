"""The editor's workers: whatever grows with what one person sends happens in them, so that nobody
else waits for it."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Final, TypeVar, cast

import msgspec
from anyio import CapacityLimiter

from action_assistant.web.workers.lanes import Lane, opened, start_fork_server

T = TypeVar("T")

#: Modules that the fork server imports before it forks a worker.
_PRELOADED: Final = (
    "action_assistant.web.workers.lanes",
    "action_assistant.editor.crdt.loading",
    "action_assistant.editor.crdt.updates.update_pieces",
    "action_assistant.editor.interchange.importing",
    "action_assistant.editor.interchange.rehearsal",
    "action_assistant.editor.interchange.edited_text",
    "action_assistant.editor.crdt.trial",
    "action_assistant.editor.library.action_uses",
    "action_assistant.editor.interchange.action_packages",
    "action_assistant.editor.interchange.subgraphs",
    "action_assistant.journal.sqlite",
    "action_assistant.editor.history.graph_history",
    "action_assistant.editor.history.blame",
    "action_assistant.editor.history.restoring",
    "action_assistant.editor.history.course_search",
    "action_assistant.editor.history.drafts.merge_previews",
)
_NICE: Final = 5


def prepare_workers() -> None:
    """Fork the fork server of the editor's workers: at the start, before there are threads, data or
    sockets."""
    start_fork_server(_PRELOADED)


class EditorWorkers:
    """The lanes of an editor: queues of jobs with worker processes of their own. `files`: imports
    and simulations. `graphs`: reading of stored graphs. `edits`: trials of large updates."""

    def __init__(self) -> None:
        threads = CapacityLimiter(8)
        self.files: Final = Lane("files", 2, 30.0, _NICE, threads, _PRELOADED)
        self.graphs: Final = Lane("graphs", 2, 60.0, _NICE, threads, _PRELOADED)
        self.edits: Final = Lane("edits", 2, 8.0, _NICE, threads, _PRELOADED)

    @classmethod
    @asynccontextmanager
    async def opened(cls) -> "AsyncIterator[EditorWorkers]":
        """Return a context with the lanes, whose worker processes are made when they are needed."""
        lanes = cls()
        async with opened(lanes.files, lanes.graphs, lanes.edits):
            yield lanes


def encoded(kind: type[T], answer: bytes) -> T:
    """Return `answer`, the JSON of a value of the type `kind` that a worker wrote, in a form that a
    route can send unchanged, so that the event loop neither decodes nor encodes it. The result has
    the type `kind` for the type checker only."""
    return cast("T", msgspec.Raw(answer))
