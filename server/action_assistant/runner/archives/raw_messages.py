"""The raw messages of a robot from the time of a run: in the recordings, in an archive, or gone.

Times are microseconds UTC.
"""

from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from typing import ClassVar

import msgspec

from action_assistant.runner.robots.recordings import Recording, hours
from action_assistant.runner.runs import views
from action_assistant.runner.runs.run import Run


class RawArchived(msgspec.Struct, frozen=True):
    """An hour of raw messages of a robot was moved to an archive."""

    kind: ClassVar[str] = "raw.archived.v1"

    at: int
    robot: str
    name: str
    file: str
    bytes: int
    sha256: str


def stream_of_raw(robot: str) -> str:
    """Return the stream that records which raw messages of a robot were archived."""
    return f"raw/{robot}"


class RawHour(msgspec.Struct, frozen=True):
    """An hour of raw messages of `robot`: its name, its size in bytes (gzipped), and, once it is
    archived, since when and in which file of the folder of archives."""

    name: str
    bytes: int
    archived_at: datetime | None = None
    file: str | None = None
    robot: str = ""


class RawMessages(msgspec.Struct, frozen=True):
    """The raw messages from the hours of a run, of all robots of a led one, oldest first.
    `robot`: the engine of the run; `text`: a note for people about missing ones, "" if all are on
    this computer."""

    robot: str
    hours: list[RawHour]
    text: str


def raw_of(
    run: Run,
    here: Mapping[str, Sequence[Recording]],
    gone: Iterable[RawArchived],
    until: int,
) -> RawMessages:
    """Return the raw messages of a run. `here`: recordings from the run's time, by robot; `gone`:
    archived hours of its robots, from any time; `until`: the end of the run, or now, in
    microseconds UTC."""
    if run.simulated:
        return RawMessages(run.engine, [], "A simulated engine sends no messages.")
    first, last = hours(run.started_at or run.requested_at, until)
    found = {
        (put.name, put.robot): RawHour(put.name, put.bytes, views.time(put.at), put.file, put.robot)
        for put in gone
        if first <= put.name[: len(first)] <= last
    }
    found |= {
        (each.name, robot): RawHour(each.name, each.bytes, robot=robot)
        for robot, recorded in here.items()
        for each in recorded
    }
    listed = [found[name] for name in sorted(found)]
    return RawMessages(run.engine, listed, _text(listed))


def _text(found: Sequence[RawHour]) -> str:
    if not found:
        return "No raw messages of that time are kept."
    archived = [each for each in found if each.archived_at is not None]
    if not archived:
        return ""
    last = archived[-1]
    day = f"{last.archived_at:%Y-%m-%d}"
    many = (
        f"Raw messages of {len(archived)} of {len(found)} hours were"
        if len(found) > 1
        else ("Raw messages were")
    )
    return f"{many} archived on {day} to {last.file}."
