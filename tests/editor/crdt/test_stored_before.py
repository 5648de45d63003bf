"""A graph that holds what no room takes any more: it opens as it did, and goes on."""

import pytest

from action_assistant.editor.crdt.loading import fold, fold_sound
from action_assistant.editor.crdt.messages import NOTHING_NEW, number, text
from action_assistant.editor.crdt.replica import EventColumns, ReplicaState
from action_assistant.editor.log.graph_events import DEFERRED, UPDATED
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.journal.events import Draft
from action_assistant.journal.journal import Journal
from editor.client import STREAM, Client, settle


def undefined_type(client: int, clock: int = 0) -> bytes:
    """A shared type that only the library knows, in a root; with two clients in one update, so that it is
    read as a whole."""
    place = b"\x27\x01" + text(b"things") + text(b"k")
    other = (
        b"\x01" + number(client + 1) + b"\x00\x28\x01" + text(b"things") + text(b"o") + b"\x01\x7e"
    )
    return b"\x02" + other + b"\x01" + number(client) + number(clock) + place + b"\x0f\x00"


@pytest.mark.parametrize("with_snapshot", [False, True])
async def test_a_graph_with_such_an_update_in_its_log_opens_and_takes_edits(
    journal: Journal, with_snapshot: bool
) -> None:
    drafts = [
        Draft(UPDATED, "eve", undefined_type(5)),
        Draft(DEFERRED, "eve", undefined_type(8, 3)),
    ]
    await journal.append(STREAM, drafts)
    for _ in range(1 + with_snapshot):  # the first one keeps a snapshot when it ends
        rooms = Rooms(journal, linger=60, window=0)
        ada = Client("ada")
        async with rooms.enter(STREAM) as room:
            assert room.damaged is None
            waiting = (await room.quiet()).waiting
            assert waiting == (undefined_type(8, 3),)
            ada.join(room)
            await settle(ada)
            ada.map["a"] = "1"
            await settle(ada)
            assert ada.durable == ada.sent
            assert ada.things["a"] == "1"
        await rooms.close()


@pytest.mark.parametrize("learned", [True, False])
def test_workers_put_such_updates_together_too(learned: bool) -> None:
    updates = [undefined_type(5), undefined_type(8)]
    events = EventColumns(1, [UPDATED] * 2, ["eve"] * 2, updates)
    folded = fold_sound(b"", events) if learned else fold(b"", events, learn=False)
    assert folded is not None
    assert folded.damaged is None
    assert ReplicaState.state_of(folded.document) != NOTHING_NEW
