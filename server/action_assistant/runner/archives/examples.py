"""Recorded runs as files that can be imported: the examples that the product ships.

One JSON object per line and event: `kind`, `author`, `at` (microseconds UTC) and `body`. An
imported run was recorded elsewhere, so it is labelled, and counts as simulated: no robot of this
runner moved.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.errors import BadInput
from action_assistant.journal.events import Draft, Event
from action_assistant.runner.runs.events import Requested, decode, draft_of
from action_assistant.web.auth.caller import without_origin

ENDING: Final = ".run.jsonl"
#: The label that examples carry.
LABEL: Final = "example"


class _Line(msgspec.Struct, frozen=True):
    kind: str
    author: str
    at: int
    body: msgspec.Raw


def written(events: Iterable[Event]) -> bytes:
    """Return the events of a stream as the contents of a file: lines of JSON, as `read` reads them."""
    bodies = ((each, msgspec.Raw(without_origin(each.body))) for each in events)
    lines = (_Line(each.kind, each.author, each.at, body) for each, body in bodies)
    return b"".join(msgspec.json.encode(line) + b"\n" for line in lines)


def read(text: bytes) -> tuple[Requested, tuple[Draft, ...]]:
    """Return the first event of a recorded run, and the events that follow. `text`: lines of JSON.
    Raise BadInput if it is no recorded run."""
    try:
        lines = [msgspec.json.decode(each, type=_Line) for each in text.splitlines() if each]
        first = decode(lines[0].kind, bytes(lines[0].body)) if lines else None
    except msgspec.DecodeError as wrong:
        raise BadInput(f"This is no recorded run: {wrong}") from wrong
    if not isinstance(first, Requested):
        raise BadInput("This is no recorded run: it does not begin with a start.")
    rest = tuple(Draft(each.kind, each.author, bytes(each.body)) for each in lines[1:])
    return first, rest


def numbered(first: Requested, number: int) -> Draft:
    """Return the draft of an example's first event for this runner: with this run number and a
    request id of its own, as a simulated run without a graph."""
    here = msgspec.structs.replace(
        first, number=number, simulated=True, graph=None, request_id=f"example/{first.run}"
    )
    return draft_of(here, here.author.id)


def shipped(folder: Path) -> Sequence[bytes]:
    """Return the contents of the example files in the folder, in the order of the times of their
    first events."""
    texts = [path.read_bytes() for path in folder.glob(f"*{ENDING}")]
    return sorted(texts, key=lambda text: read(text)[0].at)
