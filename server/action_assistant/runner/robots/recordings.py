"""Recordings of raw messages of engines, in one file per hour.

They are kept beside the journal and with their own retention: one folder per robot, with compressed
files of JSON lines. Of an answer only the graphs that differ from the answer before are kept. A
file is a row of gzip members, so that a crash costs the last seconds only.
"""

import gzip
import logging
from collections import deque
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Final

import anyio
import msgspec

from action_assistant.errors import NotFound
from action_assistant.private_files import make_folder, opener
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.links.port import Answer, Feedback
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

_EVERY_S: Final = 2.0
_WAITING: Final = 2_000  # lines in memory; beyond that the oldest are dropped
_KEPT_DAYS: Final = 7
_KEPT_BYTES: Final = 500_000_000
_ENDING: Final = ".jsonl.gz"


class GetLine(msgspec.Struct, frozen=True, omit_defaults=True, tag="get", tag_field="kind"):
    """An answer: changed graphs as the engine wrote them, and the names of graphs that it does not
    hold any more."""

    at: int
    asked_at: int
    incarnation: str
    changed: dict[str, str] = {}
    gone: tuple[str, ...] = ()


class FeedbackLine(msgspec.Struct, frozen=True, tag="feedback", tag_field="kind"):
    """A message of feedback, with its snapshots, oldest first."""

    at: int
    actor: str
    snapshots: tuple[Snapshot, ...]


class Recording(msgspec.Struct, frozen=True):
    """A file of recordings: its name (the hour, UTC) and its size in bytes."""

    name: str
    bytes: int


class Recordings:
    """Writes recordings while `run` runs. `kept_bytes` bounds all robots together. Without
    `prunes`, the caller has to remove the files that are `due`."""

    def __init__(
        self,
        folder: Path,
        run_in_worker: RunInWorker,
        *,
        kept_days: int = _KEPT_DAYS,
        kept_bytes: int = _KEPT_BYTES,
        prunes: bool = True,
    ) -> None:
        self._folder = folder
        self._prunes = prunes
        self._run_in_worker = run_in_worker
        self._kept_days = kept_days
        self._kept_bytes = kept_bytes
        self._waiting: deque[tuple[str, int, bytes]] = deque(maxlen=_WAITING)
        self._texts: dict[str, dict[str, str]] = {}

    def record_answer(self, robot: str, answer: Answer) -> None:
        """Queue the graphs of an answer that have changed, and the names of those that are gone since
        the robot's last answer. `run` writes the queue; if it is full, the oldest line is lost."""
        before = self._texts.get(robot, {})
        changed = {name: text for name, text in answer.texts.items() if before.get(name) != text}
        gone = tuple(sorted(before.keys() - answer.texts.keys()))
        if not changed and not gone:
            return
        self._texts[robot] = answer.texts
        line = GetLine(answer.at, answer.asked_at, answer.incarnation, changed, gone)
        self._waiting.append((robot, answer.at, msgspec.json.encode(line)))

    def record_feedback(self, robot: str, feedback: Feedback) -> None:
        """Queue feedback of a robot, as `record_answer` does; ignore a message without snapshots."""
        if feedback.snapshots:
            at = feedback.snapshots[-1].at
            line = FeedbackLine(at, feedback.actor, feedback.snapshots)
            self._waiting.append((robot, at, msgspec.json.encode(line)))

    async def run(self) -> None:
        """Write every two seconds until cancelled. A full disk loses recordings, never a run."""
        is_logged = False
        while True:
            await anyio.sleep(_EVERY_S)
            lines, self._waiting = self._waiting, deque(maxlen=_WAITING)
            if not lines:
                continue
            try:
                await self._run_in_worker(partial(self._write, lines))
                is_logged = False
            except Exception:
                if not is_logged:
                    log.exception("recordings of robots cannot be written")
                is_logged = True

    def _write(self, lines: Iterable[tuple[str, int, bytes]]) -> None:
        files: dict[Path, list[bytes]] = {}
        for robot, at, line in lines:
            hour = datetime.fromtimestamp(at / 1e6, UTC).strftime("%Y-%m-%dT%H")
            files.setdefault(self._folder / robot / f"{hour}{_ENDING}", []).append(line)
        for path, found in files.items():
            is_new = not path.exists()
            make_folder(path.parent)
            with open(path, "ab", opener=opener) as file:
                file.write(gzip.compress(b"\n".join(found) + b"\n"))
            if is_new and self._prunes:
                for each in self.due(self._kept_days):
                    each.unlink()

    def due(self, kept_days: float) -> list[Path]:
        """Return the files to remove, the oldest first: files older than `kept_days` days, and the
        oldest files beyond the bound of bytes. The newest file is never removed."""
        named = ((path, _hour_of(path)) for path in self._folder.glob(f"*/*{_ENDING}"))
        dated = {path: hour for path, hour in named if hour is not None}
        found = sorted(dated, key=lambda path: path.name)
        sizes = {path: path.stat().st_size for path in found}
        total = sum(sizes.values())
        due: list[Path] = []
        for path in found[:-1]:
            age = dated[found[-1]] - dated[path]
            if age >= timedelta(days=kept_days) or total > self._kept_bytes:
                due.append(path)
                total -= sizes[path]
        return due

    async def listed(self, robot: str) -> list[Recording]:
        """Return the files of a robot, newest first."""
        folder = self._folder / robot

        def read() -> list[Recording]:
            found = sorted(folder.glob(f"*{_ENDING}"), reverse=True)
            return [Recording(path.name, path.stat().st_size) for path in found]

        return await self._run_in_worker(read)

    async def file(self, robot: str, name: str) -> bytes:
        """Return the compressed contents of the file `name` of a robot. Raise NotFound if there is
        no such file."""
        if name not in {each.name for each in await self.listed(robot)}:
            raise NotFound("There is no such recording.")
        return await self._run_in_worker((self._folder / robot / name).read_bytes)


def hours(since: int, until: int) -> tuple[str, str]:
    """Return the file names, without ending, of the first and the last hour (UTC) of the time from
    `since` to `until` (µs UTC)."""
    first, last = (datetime.fromtimestamp(each / 1e6, UTC) for each in (since, until))
    return f"{first:%Y-%m-%dT%H}", f"{last:%Y-%m-%dT%H}"


def _hour_of(path: Path) -> datetime | None:
    """Return the hour of a recording; None for any other file, which must not be removed."""
    try:
        return datetime.strptime(path.name, f"%Y-%m-%dT%H{_ENDING}").replace(tzinfo=UTC)
    except ValueError:
        return None
