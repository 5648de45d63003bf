"""The archive file of a run: gzipped JSON lines with checksums, readable by any program.

The first line is a title, each further line an event as it was stored, and the last one has the
SHA-256 of all lines before it. The chain of hashes through the events is that of the journal, so
that a file holds what was in the log, or is refused.
"""

import gzip
import hashlib
import os
import zlib
from base64 import b64decode, b64encode
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.errors import Refused
from action_assistant.journal.chain import NOTHING, Head, link
from action_assistant.journal.events import Event
from action_assistant.private_files import make_folder, opener, sync
from action_assistant.version import VERSION

_FORMAT: Final = 1
_LONGEST: Final = 64 << 20  # characters of one line


class Damaged(Refused):
    """The content of an archive differs from its checksums."""

    title = "The archive is damaged"
    status = 409


class Title(msgspec.Struct, frozen=True, kw_only=True):
    """The first line of an archive file. `place` is the path of the file in the folder of archives;
    the stream ends at `events`, the number of its last event, with the hash `chain` (hex)."""

    format: int
    version: str
    stream: str
    place: str
    events: int
    chain: str

    @property
    def end(self) -> Head:
        """The end of the archived stream: the number of its last event, and its chain of hashes."""
        return Head(self.events, bytes.fromhex(self.chain))


class _ArchiveLine(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    seq: int
    kind: str
    author: str
    at: int
    position: int
    body: msgspec.Raw = msgspec.Raw(b"null")
    base64: str | None = None  # a body that is not JSON in one line


class _Footer(msgspec.Struct, frozen=True):
    sha256: str


class ArchiveFile:
    """Writes an archive file. An interruption leaves no file under its name."""

    def __init__(self, path: Path, stream: str, place: str, end: Head) -> None:
        self._path = path
        self._part = path.with_name(f".{path.name}.part")
        self._end = end
        self._end_so_far = NOTHING
        self._hash = hashlib.sha256()
        make_folder(path.parent)
        self._raw = open(self._part, "wb", opener=opener)  # noqa: SIM115 - closed at its end
        self._file = gzip.GzipFile("", "wb", 6, self._raw, mtime=0)
        title = Title(
            format=_FORMAT,
            version=VERSION,
            stream=stream,
            place=place,
            events=end.seq,
            chain=end.chain.hex(),
        )
        self._write(title)

    def add(self, events: list[Event]) -> None:
        """Write the next events of the stream."""
        for event in events:
            self._end_so_far = Head(event.seq, link(self._end_so_far.chain, event))
            self._write(_line(event))

    def close(self) -> str:
        """Verify the complete file, rename it to its name and return its SHA-256. Raise Damaged if
        it differs from the journal's chain or from its own checksums, OSError if it cannot be
        written or read. After an error the unfinished file is removed."""
        try:
            if self._end_so_far != self._end:
                raise Damaged("The journal does not hold what its chain says; `verify` tells more.")
            self._write(_Footer(self._hash.hexdigest()))
            self._file.close()
            self._raw.flush()
            os.fsync(self._raw.fileno())
            self._raw.close()
            for _ in read(self._part):
                pass
            digest = sha256_of(self._part)
            self._part.replace(self._path)
            sync(self._path.parent)
        finally:
            self.abandon()
        return digest

    def abandon(self) -> None:
        """Remove the file unless it was completed by `close`."""
        self._raw.close()
        self._part.unlink(missing_ok=True)

    def _write(self, line: msgspec.Struct) -> None:
        data = msgspec.json.encode(line) + b"\n"
        self._hash.update(data)
        self._file.write(data)


def read(path: Path) -> Iterator[Event]:
    """Yield the events of the archive file `path`, from the first. Raise Damaged at the first
    difference from its checksums, at the latest after the last event; OSError if it cannot be read.
    """
    title = title_of(path)
    seen, digest = NOTHING, hashlib.sha256()
    try:
        with gzip.open(path) as file:
            digest.update(file.readline(_LONGEST))
            for number, text in enumerate(iter(lambda: file.readline(_LONGEST), b""), 1):
                if number > title.events:
                    footer = msgspec.json.decode(text, type=_Footer)
                    _check(seen == title.end, path, "its chain does not end as it says")
                    _check(footer.sha256 == digest.hexdigest(), path, "its sum is another one")
                    _check(not file.read(1), path, "something follows its end")
                    return
                digest.update(text)
                event = _event(title.stream, msgspec.json.decode(text, type=_ArchiveLine))
                _check(event.seq == number, path, f"event {number} is missing")
                seen = Head(number, link(seen.chain, event))
                yield event
    except (EOFError, zlib.error, gzip.BadGzipFile, ValueError) as error:
        raise Damaged(f"{path.name} cannot be read to its end: {error}.") from error
    raise Damaged(f"{path.name} has no end.")


def title_of(path: Path) -> Title:
    """Return the title (first line) of the archive file `path`. Raise Damaged if it is no archive,
    OSError if it cannot be read."""
    try:
        with gzip.open(path) as file:
            title = msgspec.json.decode(file.readline(_LONGEST), type=Title)
            title.end  # noqa: B018 - its chain has to be readable
    except (EOFError, zlib.error, gzip.BadGzipFile, ValueError) as error:
        raise Damaged(f"{path.name} is no archive of a run: {error}.") from error
    _check(title.format == _FORMAT, path, f"it was made by a newer version, {title.version}")
    parts = Path(title.place).parts
    is_inside = bool(parts) and ".." not in parts and not Path(title.place).is_absolute()
    _check(is_inside, path, "it names no place for itself")
    return title


def put(source: Path, target: Path) -> str:
    """Copy the file `source` to `target`, completely or not at all, and return its SHA-256 in hex.
    Raise Damaged if the copy differs, OSError if a file cannot be read or written."""
    make_folder(target.parent)
    part = target.with_name(f".{target.name}.part")
    try:
        with source.open("rb") as there, open(part, "wb", opener=opener) as here:
            while block := there.read(1 << 20):
                here.write(block)
            here.flush()
            os.fsync(here.fileno())
        digest = sha256_of(part)
        if digest != sha256_of(source):
            raise Damaged(f"{source.name} is not the same after it was copied.")
        part.replace(target)
        sync(target.parent)
    finally:
        part.unlink(missing_ok=True)
    return digest


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of the file `path`, in hex. Raise OSError if it cannot be read."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _check(holds: bool, path: Path, why: str) -> None:
    if not holds:
        raise Damaged(f"{path.name} is damaged: {why}.")


def _line(event: Event) -> _ArchiveLine:
    body, base64 = msgspec.Raw(event.body), None
    try:
        msgspec.json.decode(event.body, type=msgspec.Raw)
        is_line = b"\n" not in event.body and event.body.strip() == event.body
    except msgspec.DecodeError:
        is_line = False
    if not is_line:
        body, base64 = msgspec.Raw(b"null"), b64encode(event.body).decode()
    return _ArchiveLine(
        seq=event.seq,
        kind=event.kind,
        author=event.author,
        at=event.at,
        position=event.position,
        body=body,
        base64=base64,
    )


def _event(stream: str, line: _ArchiveLine) -> Event:
    body = b64decode(line.base64) if line.base64 is not None else bytes(line.body)
    return Event(stream, line.seq, line.kind, line.author, line.at, body, line.position)
