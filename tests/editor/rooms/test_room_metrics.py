"""Rooms count events for the metrics of the editor."""

from prometheus_client import CollectorRegistry

from action_assistant.editor.crdt import messages
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.journal.journal import Journal
from editor.client import STREAM, Client, settle


def counted(rooms: Rooms) -> float:
    """Acknowledgements that were timed."""
    registry = CollectorRegistry()
    registry.register(rooms.metrics)
    return registry.get_sample_value("action_assistant_ack_seconds_count") or 0


async def test_each_edit_is_counted_once_refused_or_acknowledged(journal: Journal) -> None:
    rooms = Rooms(journal, linger=0.05, window=0)
    ada, eve = Client("ada"), Client("eve")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        eve.join(room)
        await settle(ada, eve)
        before = counted(rooms)
        for n in range(3):
            ada.map[str(n)] = "1"
            await settle(ada)
        assert counted(rooms) == before + 3
        eve.deliver(messages.change(b"\x01\x01\x01nonsense"))
        await settle(ada)
        assert rooms.metrics.refused == {"malformed": 1}
        room.leave(ada.member)  # type: ignore[arg-type]
    assert (rooms.metrics.opened, rooms.metrics.unloaded) == (1, 0)
    await rooms.close()
    assert rooms.metrics.unloaded == 1
