"""A Yjs client without a network: a real document, and hands that carry its messages."""

import asyncio
from typing import Any

from pycrdt import Doc, Map

from action_assistant.editor.crdt import messages
from action_assistant.editor.documents.fingerprint import Fingerprint
from action_assistant.editor.rooms.member import Member
from action_assistant.editor.rooms.room import Room
from action_assistant.journal.journal import Journal
from action_assistant.web.auth.keys import Person

STREAM = "graph/g"


class Client:
    """Speaks the protocol as the page does, when and how far the test says."""

    def __init__(self, name: str = "ada", *, client_id: int | None = None) -> None:
        self.person = Person(name, name.title())
        self.doc: Doc[Any] = Doc() if client_id is None else Doc(client_id=client_id)
        self.map = self.doc.get("things", type=Map)
        self.out: list[bytes] = []
        self.member: Member | None = None
        self.room: Room | None = None
        self.seq = 0
        self.read_only = ""
        self.told: Fingerprint | None = None
        self.durable = 0
        self.sent = 0
        self.others: dict[int, bytes] = {}
        self._remote = False
        self._subscription = self.doc.observe(self._changed)

    def _changed(self, event: Any) -> None:
        if not self._remote and event.update != messages.NOTHING_NEW:
            self.out.append(messages.change(event.update))

    def join(self, room: Room, *, edits: bool = True) -> None:
        """Connect; what was not delivered before is lost and travels with step 2."""
        self.leave()
        self.member = Member(self.person, edits=edits, acks=True)
        self.room = room
        self.out = [messages.question(self.doc.get_state())]
        self.durable = self.sent = 0
        room.join(self.member)

    def leave(self) -> None:
        """Lose the connection and everything on its way."""
        if self.room is not None and self.member is not None:
            self.room.leave(self.member)
            self.member.close(1000)
        self.room = self.member = None
        self.out = []

    def speak(self, count: int | None = None) -> None:
        """Deliver the next messages to the room."""
        while self.out and count != 0:
            self.deliver(self.out.pop(0))
            count = None if count is None else count - 1

    def deliver(self, frame: bytes) -> None:
        """Deliver one message to the room."""
        assert self.room is not None
        assert self.member is not None
        message = messages.parse(frame)
        assert message is not None
        self.sent += isinstance(message, messages.Edit)
        self.room.receive(self.member, message)

    async def listen(self) -> bool:
        """Take in what the room has for us; whether there was anything."""
        if self.member is None or not (self.member.has_news or self.member.closed):
            return False
        frames = await self.member.take()
        for frame in frames:
            self.take(frame)
        return bool(frames)

    def take(self, frame: bytes) -> None:
        """One message of the room's."""
        if frame[0] == messages.ACKS:
            reader = messages.ByteReader(frame[1:])
            self.durable, self.seq = reader.number(), reader.number()
            assert self.durable <= self.sent
            return
        if frame[0] == messages.READ_ONLY:
            self.read_only = messages.ByteReader(frame[1:]).text().decode()
            return
        match messages.parse(frame):
            case messages.Question(state):
                self.out.append(messages.answer(self.doc.get_update(state)))
            case messages.Edit(update):
                self._remote = True
                self.doc.apply_update(update)
                self._remote = False
            case messages.CompareMessage(_, entries, total):
                self.told = Fingerprint(entries, total)
            case messages.Presence(entries):
                for entry in entries:
                    self.others[entry.client] = entry.state
                    if entry.state == b"null":
                        del self.others[entry.client]

    @property
    def things(self) -> dict[str, Any]:
        """Return the document's contents."""
        shown: dict[str, Any] = self.map.to_py() or {}
        return shown


async def settle(*clients: Client) -> None:
    """Carry messages until nobody has anything to say."""
    busy = True
    while busy:
        busy = False
        for client in clients:
            if client.room is not None:
                busy = bool(client.out) or busy
                client.speak()
                await asyncio.sleep(0)  # the room tells who is where when the window opens
                await client.room.quiet()
                busy = await client.listen() or busy


def updates(*changes: tuple[str, str | None]) -> list[bytes]:
    """The updates of one author who writes or erases things, in order."""
    client = Client("author")
    for name, value in changes:
        if value is None:
            del client.map[name]
        else:
            client.map[name] = value
    return [bytes(frame_update(frame)) for frame in client.out]


def frame_update(frame: bytes) -> bytes:
    message = messages.parse(frame)
    assert isinstance(message, messages.Edit)
    return message.update


async def bodies(journal: Journal) -> list[bytes]:
    return [event.body for event in await journal.read(STREAM)]
