"""The presence entries of a room, in which the server writes the name of each person (rule R6)."""

from collections.abc import Iterable
from functools import cached_property
from typing import Final

import msgspec

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.messages import PresenceEntry
from action_assistant.editor.rooms.colours import NOBODYS
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.server.direct import framed

STATE_LIMIT: Final = 32_768  # bytes of one client's entry
MOST_NUMBER: Final = 2**53 - 2  # of a client or a clock: pages read it, and the one after it
_GONE: Final = b"null"
_decode: Final = msgspec.json.Decoder(dict[str, msgspec.Raw])


class PersonStamp(msgspec.Struct, frozen=True):
    """The name and colour of a person, which the server writes into the field `user` of each entry."""

    id: str
    name: str
    color: str


def stamp_of(person: PersonRef, colour: str) -> bytes:
    """Return the JSON of a person's `PersonStamp`."""
    return msgspec.json.encode(PersonStamp(person.id, person.name, colour))


class PresenceOwner:
    """Binds a socket to the one Yjs client id in whose name it sends presence."""

    def __init__(self, person: PersonRef, colour: str = NOBODYS) -> None:
        self.person: Final = person
        self.client: int | None = None
        self._stamp: Final = msgspec.Raw(stamp_of(person, colour))

    def stamped(self, entry: PresenceEntry) -> PresenceEntry | None:
        """Return the entry with the person's own name in it; None for one that is too large or unreadable."""
        if max(entry.client, entry.clock) > MOST_NUMBER:
            return None
        if entry.state == _GONE:
            return entry
        if len(entry.state) > STATE_LIMIT:
            return None
        try:
            entry.state.decode()  # raw parts of it are passed on as they are
            state = _decode.decode(entry.state)
        except (msgspec.DecodeError, RecursionError, UnicodeDecodeError):
            return None
        state["user"] = self._stamp
        return PresenceEntry(entry.client, entry.clock, msgspec.json.encode(state))


class PresenceNews:
    """Presence entries for many members, encoded once for all of them."""

    def __init__(self, entries: Iterable[PresenceEntry]) -> None:
        self.entries: Final = {entry.client: entry for entry in entries}

    @cached_property
    def frame(self) -> bytes:
        """The entries as an awareness message."""
        return messages.presence(self.entries.values())

    @cached_property
    def framed(self) -> bytes:
        """The message of `frame` with the header of a WebSocket frame."""
        return framed(self.frame)

    def followed_by(self, later: "PresenceNews") -> "PresenceNews":
        """Return these entries and later ones together; the later entry of a client replaces the
        earlier one."""
        return PresenceNews((self.entries | later.entries).values())


class RoomPresence:
    """The presence entries of a room. Each belongs to a socket, and is removed with it."""

    def __init__(self) -> None:
        self._entries: dict[int, PresenceEntry] = {}
        self._owners: dict[int, PresenceOwner] = {}

    def update(
        self, owner: PresenceOwner, entries: tuple[PresenceEntry, ...]
    ) -> list[PresenceEntry]:
        """Store the entries that a socket sent, and return those to be sent on. Entries for other clients
        are dropped."""
        accepted: list[PresenceEntry] = []
        for entry in entries:
            if not self._is_own(owner, entry):
                continue
            stamped = owner.stamped(entry)
            if stamped is None:
                continue
            if stamped.state == _GONE:
                accepted += self.leave(owner, entry.clock)
                continue
            owner.client = entry.client
            self._owners[entry.client] = owner
            self._entries[entry.client] = stamped
            accepted.append(stamped)
        return accepted

    def leave(self, owner: PresenceOwner, clock: int | None = None) -> list[PresenceEntry]:
        """Remove the entry of a socket, and return the entries that tell the others."""
        client, owner.client = owner.client, None
        if client is None or self._owners.get(client) is not owner:
            return []
        del self._owners[client]
        last = self._entries.pop(client)
        # The same clock, so that the client's next word, should it come back, is newer.
        return [PresenceEntry(client, last.clock if clock is None else clock, _GONE)]

    def holder(self, client: int) -> str | None:
        """Return the id of the person whose socket sends for a client; None where there is none."""
        owner = self._owners.get(client)
        return None if owner is None else owner.person.id

    def people(self) -> tuple[PersonRef, ...]:
        """Return the people in the room, each once, sorted by name."""
        there = {owner.person.id: owner.person for owner in self._owners.values()}
        return tuple(
            PersonRef(person.id, person.name)
            for person in sorted(there.values(), key=lambda person: (person.name, person.id))
        )

    def everyone(self) -> tuple[PresenceEntry, ...]:
        """Return the entries of everybody in the room."""
        return tuple(self._entries.values())

    def _is_own(self, owner: PresenceOwner, entry: PresenceEntry) -> bool:
        """Return whether a socket may send this entry. Stock clients also echo the entries of others.

        A socket sends for the first client id that it names. If another socket of the same person already
        sends for that id, it is the connection before this one.
        """
        if owner.client is not None:
            return owner.client == entry.client
        if entry.state == _GONE:
            return False
        holder = self._owners.get(entry.client)
        return holder is None or holder.person.id == owner.person.id
