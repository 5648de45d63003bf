"""The presence entries of a room, in which the server writes the name of each person (rule R6)."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Final

import msgspec

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.messages import PresenceEntry
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.server.direct import framed

#: All equally light, 3 to 1 against both themes and 4.5 to 1 under white letters; as far from each
#: other as that leaves room for, the first ones furthest, and none like an outcome's or a state's.
PALETTE: Final = (
    "#d110bc", "#657d2d", "#056bfb", "#876999", "#9a40fd", "#c74573", "#2b7f89", "#8d6e59",
    "#ac50b0", "#626dc8", "#d72190", "#ba2cdf", "#8b5cce", "#b05b60", "#5f7b63", "#6a7587",
    "#8e7110", "#a65c86", "#5760fe", "#e1156e", "#bc4993", "#8e6b79", "#6572a5", "#a54ccc",
)  # fmt: skip
#: The colour of people who left before others took all colours.
NOBODYS: Final = "#757575"
STATE_LIMIT: Final = 32_768  # bytes of one client's entry
MOST_NUMBER: Final = 2**53 - 2  # of a client or a clock: pages read it, and the one after it
_GONE: Final = b"null"
_decode: Final = msgspec.json.Decoder(dict[str, msgspec.Raw])


def colour_at(place: int) -> str:
    """Return the colour with this index in the palette. Beyond its end the colours come again,
    slightly changed."""
    turn, at = divmod(place, len(PALETTE))
    red_and_green, blue = PALETTE[at][:5], int(PALETTE[at][5:], 16)
    return f"{red_and_green}{(blue + turn if blue < 128 else blue - turn) % 256:02x}"


class PersonColours:
    """Assigns colours to people, the same in all rooms (decision 57). A colour does not change while its person
    is connected.

    People who have left keep theirs until the palette is used up; then the one who left first loses
    theirs. A restart assigns colours again.
    """

    def __init__(self) -> None:
        self._places: dict[str, int] = {}  # by person, in the order in which they left
        self._sockets: dict[str, int] = {}  # open sockets of each person

    @contextmanager
    def held(self, person: str) -> Iterator[str]:
        """Count a socket of a person inside of the `with`, and yield their colour."""
        colour = self.given(person)
        self._sockets[person] = self._sockets.get(person, 0) + 1
        try:
            yield colour
        finally:
            self._sockets[person] -= 1
            if self._sockets[person] == 0:
                del self._sockets[person]
                self._places[person] = self._places.pop(person)

    def given(self, person: str) -> str:
        """Return the colour of a person; assign a free one if they have none."""
        if person not in self._places:
            self._places[person] = self._free()
        return colour_at(self._places[person])

    def of(self, person: str) -> str:
        """Return the colour of a person who may have left; grey if they have none any more."""
        place = self._places.get(person)
        return NOBODYS if place is None else colour_at(place)

    def _free(self) -> int:
        gone = [person for person in self._places if person not in self._sockets]
        if gone and len(self._places) >= len(PALETTE):
            first = min(gone, key=lambda person: self._places[person] // len(PALETTE))
            return self._places.pop(first)
        taken = set(self._places.values())
        return next(place for place in range(len(taken) + 1) if place not in taken)


class PersonStamp(msgspec.Struct, frozen=True):
    """The name and colour of a person, which the server writes into the field `user` of each entry."""

    id: str
    name: str
    color: str


def stamp_of(person: PersonRef, colour: str) -> bytes:
    """Return the JSON of a person's `PersonStamp` with this colour."""
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
        """The entries as one presence message of Yjs (awareness)."""
        return messages.presence(self.entries.values())

    @cached_property
    def framed(self) -> bytes:
        """The message of `frame` with the header of a WebSocket frame."""
        return framed(self.frame)

    def followed_by(self, later: "PresenceNews") -> "PresenceNews":
        """Return both collections of entries together; a later entry of a client replaces the
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
        """Store the entries that a socket (`owner`) sent, and return the ones to be sent to the
        others. Entries for other clients are dropped."""
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
        """Remove the entry of a socket (`owner`), and return the entries that say so to the others;
        none if it had none. `clock`: the number of the client's own last entry, None to use that of
        the stored one."""
        client, owner.client = owner.client, None
        if client is None or self._owners.get(client) is not owner:
            return []
        del self._owners[client]
        last = self._entries.pop(client)
        # The same clock, so that the client's next word, should it come back, is newer.
        return [PresenceEntry(client, last.clock if clock is None else clock, _GONE)]

    def holder(self, client: int) -> str | None:
        """Return the id of the person whose socket sends for this Yjs client id; None if no socket
        does."""
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
        """Return the presence entries of all clients in the room."""
        return tuple(self._entries.values())

    def _is_own(self, owner: PresenceOwner, entry: PresenceEntry) -> bool:
        """Return whether a socket (`owner`) may send this entry. Common clients also send back the
        entries of others. A socket sends for the first client id that it names. If another socket
        of the same person already sends for that id, it is the connection before this one."""
        if owner.client is not None:
            return owner.client == entry.client
        if entry.state == _GONE:
            return False
        holder = self._owners.get(entry.client)
        return holder is None or holder.person.id == owner.person.id
