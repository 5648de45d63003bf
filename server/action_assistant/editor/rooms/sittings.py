"""The sittings of people who edit one graph, as the audit keeps them.

An edit is stored as the Yjs update that came, in which nothing can be said about its connection. So
the first edit of a sitting brings an event of the audit along, in its transaction. A sitting ends
after five minutes without an edit of this person, and when the person goes on by another connection.
"""

import time
from collections.abc import Sequence
from typing import Final

from action_assistant.editor.rooms.batch import SubmittedEdit
from action_assistant.journal.events import Addition, Draft
from action_assistant.kit.clock import utc_us
from action_assistant.web.audit.events import EditingBegan, draft_of, stream_at
from action_assistant.web.auth.caller import Origin, acting_for

_PAUSE_S: Final = 300.0
_NOTHING: Final[tuple[Addition, ...]] = ()


class EditSittings:
    """Remembers by which connection each person has edited a graph last, and when."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[Origin | None, float]] = {}

    def begun(self, graph: str, edits: Sequence[SubmittedEdit], seq: int) -> Sequence[Addition]:
        """Return the events that record who begins to edit a graph: for the first time, after a
        pause, or by another connection. `edits`: those of one batch; `seq`: the number that the
        first of them gets. No event is returned while the connection of a person is unknown."""
        drafts: list[Draft] = []
        now = time.monotonic()
        for number, edit in enumerate(edits, seq):
            before, at = self._last.get(edit.author, (None, 0.0))
            self._last[edit.author] = edit.origin, now
            if edit.origin == before and (before is None or now - at < _PAUSE_S):
                continue
            with acting_for(edit.author, edit.origin):
                drafts.append(draft_of(EditingBegan(graph, number), edit.author))
        return [Addition(stream_at(utc_us()), tuple(drafts))] if drafts else _NOTHING
