"""Who is in a room, as the server vouches for it (rule R6)."""

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
    """What the server says about a person, in the field `user` of every entry."""

    id: str
    name: str
    color: str


def stamp_of(person: PersonRef, colour: str) -> bytes:
    """The stamp as JSON."""
    return msgspec.json.encode(PersonStamp(person.id, person.name, colour))


class PresenceOwner:
    """The one client id that a socket speaks for."""

    def __init__(self, person: PersonRef, colour: str = NOBODYS) -> None:
        self.person: Final = person
        self.client: int | None = None
        self._stamp: Final = msgspec.Raw(stamp_of(person, colour))

    def stamped(self, entry: PresenceEntry) -> PresenceEntry | None:
        """The entry under the person's own name; None when it is none that can be shown."""
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
    """What many are told about who is where: put into bytes once for all of them."""

    def __init__(self, entries: Iterable[PresenceEntry]) -> None:
        self.entries: Final = {entry.client: entry for entry in entries}

    @cached_property
    def frame(self) -> bytes:
        """As a message."""
        return messages.presence(self.entries.values())

    @cached_property
    def framed(self) -> bytes:
        """As it goes over the wire."""
        return framed(self.frame)

    def followed_by(self, later: "PresenceNews") -> "PresenceNews":
        """Both; what is later about the same client counts."""
        return PresenceNews((self.entries | later.entries).values())


class RoomPresence:
    """The entries of a room. Each belongs to an owner and vanishes with it."""

    def __init__(self) -> None:
        self._entries: dict[int, PresenceEntry] = {}
        self._owners: dict[int, PresenceOwner] = {}

    def hear(self, owner: PresenceOwner, entries: tuple[PresenceEntry, ...]) -> list[PresenceEntry]:
        """What the others are to be told; entries that are not this owner's are dropped."""
        told: list[PresenceEntry] = []
        for entry in entries:
            if not self._is_own(owner, entry):
                continue
            stamped = owner.stamped(entry)
            if stamped is None:
                continue
            if stamped.state == _GONE:
                told += self.leave(owner, entry.clock)
                continue
            owner.client = entry.client
            self._owners[entry.client] = owner
            self._entries[entry.client] = stamped
            told.append(stamped)
        return told

    def leave(self, owner: PresenceOwner, clock: int | None = None) -> list[PresenceEntry]:
        """Take an owner's entry away; what the others are to be told."""
        client, owner.client = owner.client, None
        if client is None or self._owners.get(client) is not owner:
            return []
        del self._owners[client]
        last = self._entries.pop(client)
        # The same clock, so that the client's next word, should it come back, is newer.
        return [PresenceEntry(client, last.clock if clock is None else clock, _GONE)]

    def holder(self, client: int) -> str | None:
        """The person whose socket speaks for a client."""
        owner = self._owners.get(client)
        return None if owner is None else owner.person.id

    def people(self) -> tuple[PersonRef, ...]:
        """Who is there now, each once, by name."""
        there = {owner.person.id: owner.person for owner in self._owners.values()}
        return tuple(
            PersonRef(person.id, person.name)
            for person in sorted(there.values(), key=lambda person: (person.name, person.id))
        )

    def everyone(self) -> tuple[PresenceEntry, ...]:
        """Who is there now."""
        return tuple(self._entries.values())

    def _is_own(self, owner: PresenceOwner, entry: PresenceEntry) -> bool:
        """Stock clients echo what they hear of others; those entries are not theirs to say.

        A socket speaks for the first client id it names. If another socket of the same person
        speaks for that one, it is what is left of the connection before this one.
        """
        if owner.client is not None:
            return owner.client == entry.client
        if entry.state == _GONE:
            return False
        holder = self._owners.get(entry.client)
        return holder is None or holder.person.id == owner.person.id
