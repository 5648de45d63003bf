"""The database in the model of several editors: tables, locks of slots and sessions, and the rules that every append
must keep."""

from dataclasses import dataclass
from typing import Final, Literal, get_args

Mutant = Literal[
    "",
    "no epoch in the compare",
    "check without lock",
    "acknowledge before the commit",
    "take over without loading",
    "relay without 421",
    "position from a sequence",
]
#: Mistakes in the rules, each of which the model has to find.
MUTANTS: Final[tuple[Mutant, ...]] = tuple(each for each in get_args(Mutant) if each)

DEAD: Final = 2.0  # seconds without a beat


class Broken(AssertionError):
    """A rule of the model was broken."""


class LostError(Exception):
    """No answer came; nobody knows whether it was done."""


class OvertakenError(Exception):
    """A stream has another end or epoch."""


@dataclass(frozen=True)
class Head:
    """The end of a stream."""

    seq: int = 0
    chain: int = 0
    epoch: int = 0


@dataclass(frozen=True)
class Entry:
    """A stored event: an edit of a client, or a shared note."""

    stream: str
    seq: int
    edit: int
    slot: int
    n: int
    chain: int
    epoch: int | None  # that its author named


@dataclass
class Registered:
    """The row of an editor."""

    editor: int
    slot: int
    beat_at: float
    draining: bool = False


class Database:
    """The tables, the locks of slots, and the sessions."""

    def __init__(self) -> None:
        self.heads: dict[str, Head] = {}
        self.log: dict[str, list[Entry]] = {}
        self.places: dict[tuple[int, int], Entry] = {}
        self.edits: set[int] = set()
        self.rooms: dict[str, tuple[int, int]] = {}  # life and epoch
        self.registered: dict[int, Registered] = {}  # by life
        self.slots: dict[int, int] = {}  # sessions
        self.sessions: set[int] = set()
        self.sequence = 0

    def end_session(self, session: int | None) -> None:
        """End a session, and free its slot."""
        if session in self.sessions:
            self.sessions.discard(session)
            self.slots = {slot: who for slot, who in self.slots.items() if who != session}

    def store(self, entries: list[Entry], known: dict[str, Head], mutant: Mutant) -> None:
        """Append, if every stream still is what the writer knows."""
        for stream, head in known.items():
            now = self.heads.get(stream, Head())
            same = (now.seq, now.chain) == (head.seq, head.chain)
            if mutant != "check without lock" and not (
                same and (mutant == "no epoch in the compare" or now.epoch == head.epoch)
            ):
                raise OvertakenError
        for entry in entries:
            now = self.heads.get(entry.stream, Head())
            if entry.seq != now.seq + 1:
                raise Broken(f"{entry} behind {now}")
            if entry.epoch is not None and entry.epoch != now.epoch:
                raise Broken(f"{entry} in epoch {now.epoch}")
            if (entry.slot, entry.n) in self.places:
                raise Broken(f"{entry} has the place of another event")
            if entry.edit in self.edits:
                raise Broken(f"{entry} is there twice")
            self.edits.add(entry.edit)
            self.places[entry.slot, entry.n] = entry
            self.log.setdefault(entry.stream, []).append(entry)
            self.heads[entry.stream] = Head(entry.seq, entry.chain, now.epoch)

    def lives(self, life: int, now: float) -> bool:
        """Return whether the editor of a life counts as living."""
        row = self.registered.get(life)
        return (
            row is not None
            and not row.draining
            and now - row.beat_at <= DEAD
            and row.slot in self.slots
        )

    def look(self, stream: str, life: int, now: float) -> tuple[str, int]:
        """Return who owns a stream, taken if need be, as `SharedOwners` does in one transaction."""
        shown = self.rooms.get(stream)
        if shown is not None and shown[0] == life:
            return "here", shown[1]
        if shown is not None and self.lives(shown[0], now):
            return "elsewhere", self.registered[shown[0]].editor
        if life in self.registered and self.registered[life].draining:
            return "nobody", 0
        head = self.heads.get(stream, Head())
        self.heads[stream] = Head(head.seq, head.chain, head.epoch + 1)
        self.rooms[stream] = life, head.epoch + 1
        return "here", head.epoch + 1


def link(before: int, entry: Entry) -> int:
    """Return the chain at an entry."""
    return hash((before, entry.stream, entry.seq, entry.edit, entry.slot, entry.n))
