"""Groups the edits of a document into sessions: the edits of one person with short pauses. Pure."""

from collections.abc import Iterable
from datetime import datetime
from typing import Final, Literal, NamedTuple, TypeAlias

import msgspec
from msgspec.structs import replace

_ONE_GO: Final = 5 * 60  # seconds between two edits of one session

Kind: TypeAlias = Literal[
    "created",
    "imported",
    "edited",
    "published",
    "restored",
    "reverted",
    "adapted",
    "merged",
    "deleted",
    "recovered",
]


class Step(NamedTuple):
    """An event to be grouped. `seq`: the change of the document; None if it is none. `told`: for an
    event about the graph, its seq in that other stream; 0 for a change."""

    kind: Kind
    author: str
    at: datetime
    seq: int | None
    told: int = 0


class EditSession(msgspec.Struct, frozen=True):
    """The edits of one person between `at` and `until`, from the change `from_seq` to `seq`; others
    may have edited in between. For an entry that is no edit, `from_seq` is None and `seq` is the
    change before it."""

    kind: Kind
    author: str
    at: datetime
    until: datetime
    seq: int
    from_seq: int | None = None
    told: int = 0


def edit_sessions(steps: Iterable[Step]) -> list[EditSession]:
    """Group steps, given in order of time, into sessions, sorted by their ends. A step that is no
    edit ends all open sessions, since it may refer to the document at that time."""
    done: dict[int, EditSession] = {}
    open_of: dict[str, int] = {}
    seq = 1
    for number, step in enumerate(steps):
        seq = step.seq or seq
        if step.kind == "imported" and done:
            before = done.popitem()[1]
            done[number] = replace(before, kind="imported")
        elif (
            step.kind == "created" and done
        ):  # a large file is stored before the graph that was made of it
            continue
        elif step.kind == "edited":
            mine = done.pop(open_of.get(step.author, -1), None)
            if mine is not None and (step.at - mine.until).total_seconds() >= _ONE_GO:
                done[open_of[step.author]] = mine
                mine = None
            begun = EditSession("edited", step.author, step.at, step.at, seq, seq)
            done[number] = begun if mine is None else replace(mine, until=step.at, seq=seq)
            open_of[step.author] = number
        else:
            open_of.clear()
            changed = seq if step.seq is not None and step.kind != "created" else None
            done[number] = EditSession(
                step.kind, step.author, step.at, step.at, seq, changed, step.told
            )
    return [done[number] for number in sorted(done)]
