"""Keeps a run as an incident: it stays in the journal, and one file holds all that is known of it.

The file is a ZIP with fixed names inside; names that people and robots chose stand in JSON only. `at` is
microseconds UTC.
"""

import hashlib
import io
import platform
import sqlite3
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Final

import msgspec
from sqlalchemy import Connection, select

from action_assistant.errors import TooLarge
from action_assistant.journal.chain import NOTHING, Head, link
from action_assistant.journal.events import Event
from action_assistant.kit.clock import utc_us
from action_assistant.runner.archives.retention import is_incident
from action_assistant.runner.runs.events import Requested
from action_assistant.runner.runs.views import time
from action_assistant.safe_text import one_line
from action_assistant.schema.runner_tables import run
from action_assistant.umrf.kept_values import as_json
from action_assistant.umrf.start_values import StartValues
from action_assistant.version import VERSION, commit
from action_assistant.web.audit.rows import AuditRow

_MOST: Final = 256 << 20  # bytes of the parts together
_AROUND_US: Final = 3600 * 1_000_000  # before the start and after the end, of robots and the audit


class IncidentRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The body of a request to keep a run as an incident. `editor_audit`: the rows of the editor's
    audit about its graph, which the runner cannot ask for; they count as told by the client."""

    reason: Annotated[str, msgspec.Meta(max_length=1000)] = ""
    editor_audit: Annotated[tuple[AuditRow, ...], msgspec.Meta(max_length=5000)] = ()


class _EventLine(msgspec.Struct, frozen=True):
    """A stored event with the chain up to it (hex), as `journal/chain.py` computes it."""

    stream: str
    seq: int
    kind: str
    author: str
    at: int
    position: int
    chain: str
    body: Any


class StreamProof(msgspec.Struct, frozen=True):
    """The check of one stream. `chain`: as it follows from the events of the file; `stored`: as the
    log has it; `is_sound`: both are equal, so no event was altered or is missing."""

    stream: str
    events: int
    chain: str
    stored: str
    is_sound: bool


class RobotLine(msgspec.Struct, frozen=True):
    """A stored event of a robot's log."""

    stream: str
    seq: int
    kind: str
    author: str
    at: int
    body: Any


class RobotFacts(msgspec.Struct, frozen=True):
    """A robot of the run: its registration as it is now, null if it is none any more, and what was
    recorded of it in that time."""

    name: str
    registration: dict[str, Any] | None
    events: tuple[RobotLine, ...]


class Software(msgspec.Struct, frozen=True):
    """The versions of the software that wrote the file. `written_by`: the versions of this program
    that wrote the log before."""

    version: str
    commit: str | None
    python: str
    sqlite: str
    system: str
    written_by: tuple[dict[str, Any], ...] = ()


class Incident(msgspec.Struct, frozen=True, kw_only=True):
    """The title of the file. Times are in UTC. `graphs`: name and digest of each graph, in the order
    of the files in `graphs/`; `values`: those that were given at the start."""

    run: str
    number: int
    made_at: str
    made_by: str
    reason: str
    is_over: bool
    graph_name: str
    version: str
    digest: str
    engine: str
    robots: tuple[str, ...]
    graphs: tuple[tuple[str, str], ...]
    streams: tuple[StreamProof, ...]
    software: Software
    values: StartValues = {}


def window(requested_at: int, ended_at: int | None, now: int) -> tuple[int, int]:
    """Return the begin and end (µs UTC) of the time from which an incident contains robots' logs
    and audit: that of the run, with a margin. `ended_at`: None for a run that goes on until `now`.
    """
    return requested_at - _AROUND_US, (now if ended_at is None else ended_at) + _AROUND_US


def incident_times(connection: Connection) -> list[tuple[int, int]]:
    """Return the begins and ends (µs UTC) whose audit belongs to the runs that an owner keeps."""
    chosen = select(run.c.requested_at, run.c.ended_at).where(is_incident(run.c.id))
    now = utc_us()
    return [window(row.requested_at, row.ended_at, now) for row in connection.execute(chosen)]


def event_lines(events: Sequence[Event]) -> tuple[bytes, Head]:
    """Return the events of one stream as lines of JSON, and the end of the chain through them. Raise
    TooLarge if they are too many for one file."""
    head, out = NOTHING, io.BytesIO()
    for event in events:
        head = Head(event.seq, link(head.chain, event))
        line = _EventLine(
            event.stream,
            event.seq,
            event.kind,
            event.author,
            event.at,
            event.position,
            head.chain.hex(),
            body_of(event.body),
        )
        out.write(msgspec.json.encode(line) + b"\n")
        if out.tell() > _MOST:
            raise TooLarge("The events of this run are too many for one file.")
    return out.getvalue(), head


def body_of(body: bytes) -> Any:
    """Return the stored body of an event as JSON data; as text in hex if it is no JSON."""
    try:
        msgspec.json.decode(body, type=msgspec.Raw)
    except msgspec.DecodeError:
        return {"hex": body.hex()}
    return msgspec.Raw(body)


def proof_of(stream: str, found: Head, stored: Head) -> StreamProof:
    """Return the check of a stream (by name): `found` is the end that follows from its events,
    `stored` its end as the log has it."""
    return StreamProof(stream, found.seq, found.chain.hex(), stored.chain.hex(), found == stored)


def graph_files(first: Requested) -> Iterator[tuple[str, str, str]]:
    """Yield name, digest and UMRF of the graph that was sent, and of each graph inside."""
    yield first.graph_name, first.digest, first.umrf
    for inner in first.subgraphs:
        yield inner.name, inner.digest, inner.umrf


def software(written_by: Sequence[Mapping[str, Any]]) -> Software:
    """Return the versions of this program and of what it runs on."""
    return Software(
        VERSION,
        commit(),
        platform.python_version(),
        sqlite3.sqlite_version,
        platform.platform(),
        tuple(dict(each) for each in written_by),
    )


def packed(incident: Incident, parts: Mapping[str, bytes]) -> bytes:
    """Return the ZIP file of an incident, with a title, a text for people and the sums of all parts.
    Raise TooLarge if it is too large to be one file."""
    whole = {
        "README.txt": _readme(incident).encode(),
        "incident.json": msgspec.json.format(msgspec.json.encode(incident)),
        **parts,
    }
    if sum(map(len, whole.values())) > _MOST:
        raise TooLarge("All that is known of this run is too much for one file.")
    sums = "".join(f"{hashlib.sha256(part).hexdigest()}  {name}\n" for name, part in whole.items())
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as file:
        for name, part in {**whole, "SHA256SUMS": sums.encode()}.items():
            file.writestr(zipfile.ZipInfo(name, _moment(incident)), part, zipfile.ZIP_DEFLATED)
    return out.getvalue()


def _moment(incident: Incident) -> tuple[int, int, int, int, int, int]:
    at = incident.made_at
    year, month, day = int(at[:4]), int(at[5:7]), int(at[8:10])
    return year, month, day, int(at[11:13]), int(at[14:16]), int(at[17:19])


def _readme(incident: Incident) -> str:
    """Return the text for people, in which no name can begin a line of its own."""
    unsound = [each.stream for each in incident.streams if not each.is_sound]
    verdict = (
        f"NOT SOUND: {', '.join(unsound)}"
        if unsound
        else "all events are what was written, by the chain of the log"
    )
    lines = (
        f"Run {incident.number} of {incident.graph_name} ({incident.run})",
        f"on {', '.join(incident.robots) or incident.engine}",
        f"made at {incident.made_at} by {incident.made_by}; the run is "
        + ("over" if incident.is_over else "NOT over"),
        f"reason: {incident.reason or 'none was given'}",
        *(
            f"set at the start: {action} {name} = {as_json(value)}"
            for action, given in incident.values.items()
            for name, value in given.items()
        ),
        f"check of the logs: {verdict}",
    )
    names = (
        "events/        every event of the run, and of each piece, with the chain of hashes",
        "graphs/        the graph that was sent, and the graphs inside; names in incident.json",
        "robots.json    registrations, and what was recorded of the robots from an hour before to an",
        "               hour after",
        "audit.json     who did what in that time, as the runner has it",
        "audit-of-editor.json  likewise of the graph, as the editor told whoever made this file",
        "SHA256SUMS     of all parts",
    )
    return "".join(f"{one_line(each)}\n" for each in (*lines, "", *names))


def made_at(now: int) -> str:
    """Return a time (µs UTC) as text, as the title of an incident writes it."""
    return time(now).strftime("%Y-%m-%dT%H:%M:%SZ")
