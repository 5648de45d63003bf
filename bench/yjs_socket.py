"""A Yjs client as one socket: y-protocols, or Hocuspocus' form of it."""

import asyncio
import base64
import json
import os
from typing import Any, Final, Literal, NamedTuple, Protocol

BINARY: Final = 0x82
PRESENCE_CLIENT: Final = 1 << 20


class Plan(NamedTuple):
    """What is to be done. `kind`: edits under new keys, of one key each, or awareness only."""

    port: int
    pid: int
    dialect: Literal["plain", "hocuspocus"]
    path: str  # with {room}
    rooms: list[str]
    headers: list[str]
    operation: Literal["fan out", "lockstep", "idle", "fill", "open", "one by one"]
    people: int = 1
    rate: float = 10.0  # per second and person
    seconds: float = 5.0
    kind: Literal["add", "drag", "presence"] = "add"
    count: int = 0  # of edits, or of rounds in lockstep
    burst: int = 10  # edits of a round
    gap: float = 0.01  # seconds between rounds


class Audience(Protocol):
    """What a socket tells of: what it heard, and that it was lost."""

    plan: Plan
    ending: bool
    lost: int

    def heard(self, person: "Person", data: bytes) -> None: ...


def number(value: int) -> bytes:
    """lib0's varUint."""
    out = bytearray()
    while value > 0x7F:
        out.append(0x80 | value & 0x7F)
        value >>= 7
    return bytes((*out, value))


def read_number(data: bytes, at: int) -> tuple[int, int]:
    """A varUint, and where it ends."""
    value = shift = 0
    while True:
        value |= (data[at] & 0x7F) << shift
        at += 1
        if data[at - 1] < 0x80:
            return value, at
        shift += 7


class Person(asyncio.Protocol):
    """One socket. Speaks y-protocols, or Hocuspocus' form of it, which names the room each time."""

    def __init__(self, clients: Audience, name: int, room: str) -> None:
        self.clients, self.name, self.room = clients, name, room
        plan = clients.plan
        self.prefix = b""
        if plan.dialect == "hocuspocus":
            self.prefix = number(len(room)) + room.encode()
        self.synced: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()
        self.acknowledged = self.sent = 0
        self.news = asyncio.Event()
        self.last: dict[int, int] = {}
        self._buffer = bytearray()
        self._open = False
        self._client = PRESENCE_CLIENT + name

    def connection_made(self, transport: Any) -> None:
        self.transport = transport
        plan = self.clients.plan
        lines = [
            f"GET {plan.path.format(room=self.room)} HTTP/1.1",
            *(f"Host: 127.0.0.1:{plan.port}", "Upgrade: websocket", "Connection: Upgrade"),
            f"Sec-WebSocket-Key: {base64.b64encode(os.urandom(16)).decode()}",
            *("Sec-WebSocket-Version: 13", *plan.headers, "", ""),
        ]
        transport.write("\r\n".join(lines).encode())

    def data_received(self, data: bytes) -> None:
        self._buffer += data
        if not self._open:
            end = self._buffer.find(b"\r\n\r\n")
            if end < 0:
                return
            if b" 101 " not in self._buffer[:end]:
                self.synced.set_exception(ConnectionError(bytes(self._buffer[:end]).decode()))
                return
            del self._buffer[: end + 4]
            self._open = True
            self._greet()
        at = 0
        while (frame := self._frame(at)) is not None:
            kind, start, at = frame
            if kind == BINARY:
                self._take(bytes(self._buffer[start:at]))
            elif kind == 0x89:
                self._write(0x8A, bytes(self._buffer[start:at]))
        del self._buffer[:at]

    def connection_lost(self, _: Exception | None) -> None:
        self.clients.lost += not self.clients.ending
        self.news.set()

    def _frame(self, at: int) -> tuple[int, int, int] | None:
        """Kind, start and end of the payload of the frame at `at`, if all of it is there."""
        buffer = self._buffer
        if len(buffer) < at + 2:
            return None
        size, start = buffer[at + 1], at + 2
        if size > 125:
            width = 2 if size == 126 else 8
            size = int.from_bytes(buffer[start : start + width], "big")
            start += width
        return (buffer[at], start, start + size) if len(buffer) >= start + size else None

    def _write(self, kind: int, payload: bytes) -> None:
        """A frame, under a mask of noughts."""
        size = len(payload)
        length = bytes((0x80 | size,)) if size < 126 else b"\xfe" + size.to_bytes(2, "big")
        if size > 0xFFFF:
            length = b"\xff" + size.to_bytes(8, "big")
        self.transport.write(bytes((kind,)) + length + bytes(4) + payload)

    def say(self, message: bytes) -> None:
        self._write(BINARY, self.prefix + message)

    def _greet(self) -> None:
        if self.clients.plan.dialect == "hocuspocus":
            self.say(b"\x02\x00" + b"\x05token")
        self.say(b"\x00\x00\x01\x00")  # step 1: nothing is known

    def edit(self, update: bytes) -> None:
        self.sent += 1
        self.say(b"\x00\x02" + number(len(update)) + update)

    def be_somewhere(self, nth: int, now: bytes) -> None:
        """Awareness, as a page sends it while something is dragged."""
        mark = f"<{self.name:04d}{nth:07d}{now.decode()}>"
        state = json.dumps({"drag": {"ids": ["a"], "dx": nth, "dy": 1}, "mark": mark}).encode()
        entry = number(1) + number(self._client) + number(nth + 1) + number(len(state)) + state
        self.say(b"\x01" + number(len(entry)) + entry)

    def _take(self, data: bytes) -> None:
        at = 0
        if self.prefix:
            size, at = read_number(data, 0)
            at += size
        kind, at = read_number(data, at)
        if kind == 1:
            self.clients.heard(self, data)
        elif kind in (0, 4):
            self._sync(*read_number(data, at), data)
        elif kind == 100 or (kind == 8 and self.prefix):
            # Ours: so many are durable. Hocuspocus': one more was applied in memory.
            self.acknowledged = read_number(data, at)[0] if kind == 100 else self.acknowledged + 1
            self.news.set()

    def _sync(self, step: int, at: int, data: bytes) -> None:
        if step == 0:
            self.sent += 1
            self.say(b"\x00\x01\x02\x00\x00")
        elif step == 1 and not self.synced.done():
            self.synced.set_result(data[read_number(data, at)[1] :])
        elif step == 2:
            self.clients.heard(self, data)
