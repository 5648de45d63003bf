"""The file of a backup: a zip that says what has to be in it, with the size and SHA-256 of each part.

`about.json` comes first in reading and last in writing. Journals are `editor.db` and `runner.db`, SQLite
files whatever database they came from; `files/…` is what else was in the data folder, `archive/…` the
archives of runs. Format 1 had the journals alone, without sizes.
"""

import hashlib
import os
import shutil
import stat
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path, PurePosixPath
from typing import IO, Final

import msgspec

from action_assistant.commands.backups.progress import Progress
from action_assistant.errors import CannotStart
from action_assistant.journal.database import Branch
from action_assistant.journal.migrate import ProgramVersion, revisions_of
from action_assistant.private_files import sync
from action_assistant.schema.branches import BRANCHES
from action_assistant.version import VERSION, commit, described

FORMAT: Final = 2
FILES: Final = "files"
ARCHIVE: Final = "archive"
_ABOUT: Final = "about.json"
_CHUNK: Final = 1 << 20
_LONGEST: Final = 64 << 20  # bytes of about.json: a line for each of half a million files
_LEVEL: Final = 1
#: Bytes that one byte may become. What we write stays below 230 at this level, whatever it is.
_TIGHTEST: Final = 300
_ROOM: Final = 64 << 20  # bytes that have to be left on the disk
_MODE: Final = 0o600


class NoRoom(CannotStart):
    """The disk has less space left than the packed files need."""


class JournalCopy(msgspec.Struct, frozen=True):
    """One journal in a backup: the position of its last event, and the SHA-256 and size of its
    file."""

    events: int
    sha256: str
    bytes: int | None = None


class BackupPart(msgspec.Struct, frozen=True):
    """A file in a backup: its size, and its SHA-256 in hex."""

    bytes: int
    sha256: str


class BackupManifest(msgspec.Struct, frozen=True, kw_only=True):
    """The description that a backup holds of itself.

    `made_at` is in seconds since 1970. `database` is where the graphs were, without a password; None
    means the data folder. `commit` is
    that of the version, None if unknown. `schemas` holds the revisions of the tables, `settings`
    those of the environment without the token, and `missing` one sentence for each missing part.
    """

    format: int
    version: str
    made_at: float
    journals: dict[Branch, JournalCopy]
    commit: str | None = None
    schemas: dict[str, str] = {}
    files: dict[str, BackupPart] = {}
    database: str | None = None
    settings: dict[str, str] = {}
    missing: tuple[str, ...] = ()


class Packer:
    """Writes a backup file. It has its final name once `close` returns; until then no file has that
    name."""

    def __init__(self, folder: Path, progress: Progress) -> None:
        self.files: dict[str, BackupPart] = {}
        self._part = folder / "backup.zip"
        descriptor = os.open(self._part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _MODE)
        self._raw = os.fdopen(descriptor, "wb")
        self._zip = zipfile.ZipFile(self._raw, "w", zipfile.ZIP_DEFLATED, compresslevel=_LEVEL)
        self._progress = progress

    def journal(self, branch: Branch, path: Path, events: int) -> JournalCopy:
        """Add the copy of a journal (`path`) with `events` events to the backup; return its size
        and SHA-256."""
        held = self._take(f"{branch}.db", path)
        return JournalCopy(events, held.sha256, held.bytes)

    def file(self, name: str, path: Path) -> BackupPart:
        """Add the file `path` to the backup under `name`; return its size and SHA-256. Raise
        OSError if it cannot be read or written."""
        self.files[name] = self._take(name, path)
        return self.files[name]

    def text(self, name: str, content: bytes) -> None:
        """Add `content` to the backup as a file of this name."""
        self._write(name, content)
        self.files[name] = BackupPart(len(content), hashlib.sha256(content).hexdigest())

    def close(self, manifest: BackupManifest, target: Path, verify: Callable[[Path], None]) -> None:
        """Add the manifest, finish the file, verify it, and rename it to `target`. `verify` raises
        an error if the file at its path is damaged; the file then keeps its temporary name."""
        self._write(_ABOUT, msgspec.json.format(msgspec.json.encode(manifest)))
        self._zip.close()
        self._raw.flush()
        os.fsync(self._raw.fileno())
        self._raw.close()
        verify(self._part)
        self._part.replace(target)
        sync(target.parent)

    def abandon(self) -> None:
        """Close the unfinished backup file, which has a temporary name."""
        self._raw.close()

    def _write(self, name: str, content: bytes) -> None:
        # By `open`, which gives an entry no time: `writestr` does, and a zip has none before 1980, where
        # the clock may be. The backup says itself when it was made.
        with self._zip.open(name, "w") as here:
            here.write(content)

    def _take(self, name: str, path: Path) -> BackupPart:
        entry = zipfile.ZipInfo(name) if path.suffix == ".gz" else name  # the former: as it is
        with path.open("rb") as there, self._zip.open(entry, "w", force_zip64=True) as here:
            size, digest = _copied(there, here, f"packing {name}", self._progress)
        return BackupPart(size, digest)


class Package:
    """Reads a backup file. Nothing is unpacked before its manifest and total size were checked."""

    def __init__(self, source: Path) -> None:
        self._source = source
        try:
            self._zip = zipfile.ZipFile(source)
        except FileNotFoundError as error:
            raise CannotStart(f"There is no file {source}.") from error
        except (zipfile.BadZipFile, OSError) as error:
            raise self._no_backup(error) from error
        try:
            self.about: Final = self._read_about()
            self.parts: Final = self._parts()
        except BaseException:
            self._zip.close()
            raise

    def prove(self, progress: Progress) -> None:
        """Read every part of the backup and compare its SHA-256; write nothing but the progress.
        Raise CannotStart if a part is damaged."""
        self._check_total()
        for name in self.parts:
            with Path(os.devnull).open("wb") as nowhere:
                self._copy(name, nowhere, f"reading back {name}", progress)

    def unpack(self, folder: Path, progress: Progress) -> None:
        """Write all parts into `folder`, and compare the SHA-256 of each. Raise CannotStart if a
        part is damaged, NoRoom if the disk has too little space."""
        total = self._check_total()
        free = shutil.disk_usage(folder).free
        if total + _ROOM > free:
            raise NoRoom(
                f"{self._source} needs {total >> 20} MiB, and {folder} has {free >> 20} MiB left."
            )
        for name in self.parts:
            path = folder / name
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _MODE)
            with os.fdopen(descriptor, "wb") as here:
                self._copy(name, here, f"unpacking {name}", progress)

    def _check_total(self) -> int:
        """Return the unpacked size of all parts in bytes. Raise CannotStart if it is impossible for
        a file of this size."""
        total = sum(entry.file_size for entry, _ in self.parts.values())
        if total > _TIGHTEST * self._source.stat().st_size + _CHUNK:
            raise self._damaged("its parts lie over each other")
        return total

    def _copy(self, name: str, here: IO[bytes], text: str, progress: Progress) -> None:
        """Write the part called `name` into the file `here` and compare its SHA-256. `text`: the
        progress message. Raise CannotStart if it is damaged."""
        entry, sha256 = self.parts[name]
        try:
            with self._zip.open(entry) as there:
                _, digest = _copied(there, here, text, progress)
        except (zipfile.BadZipFile, zlib.error, EOFError) as error:
            raise self._damaged(f"{name} cannot be read ({error})") from error
        if digest != sha256:
            raise self._damaged(f"{name} is not what was written")

    def close(self) -> None:
        """Close the backup file that was read."""
        self._zip.close()

    def _read_about(self) -> BackupManifest:
        try:
            entry = self._entry(_ABOUT)
            if entry.file_size > _LONGEST:
                raise self._damaged(f"{_ABOUT} is too long")
            about = msgspec.json.decode(self._zip.read(entry), type=BackupManifest)
        except (zipfile.BadZipFile, ValueError, RecursionError, zlib.error, EOFError) as error:
            raise self._no_backup(error) from error
        if about.format > FORMAT:
            raise self._newer(about, f"format {about.format}", f"{FORMAT}")
        for branch, schema in about.schemas.items():
            ours = revisions_of(branch)
            if schema not in ours:
                raise self._newer(about, f"schema {schema}", ours[-1])
        return about

    def _newer(self, about: BackupManifest, what: str, known: str) -> CannotStart:
        made = ProgramVersion(about.version, about.commit or "", "")
        return CannotStart(
            f"{self._source} was made by a newer version, {made} ({what}); this is version "
            f"{described()}, which knows up to {known}. Restore it by version {about.version} or newer."
        )

    def _parts(self) -> dict[str, tuple[zipfile.ZipInfo, str]]:
        """Return the zip entry of every file of the backup, and the SHA-256 that the backup states
        for it, by name. Raise CannotStart if a file is missing, has an impossible name, or has not
        the size that is stated."""
        sizes = {f"{branch}.db": each.bytes for branch, each in self.about.journals.items()}
        digests = {f"{branch}.db": each.sha256 for branch, each in self.about.journals.items()}
        for name, held in self.about.files.items():
            if not _is_place(name):
                raise self._damaged(f"{name!r} is no name for one of its files")
            sizes[name], digests[name] = held.bytes, held.sha256
        parts = {}
        for name, size in sizes.items():
            entry = self._entry(name)
            if size is not None and size != entry.file_size:
                raise self._damaged(f"{name} has not the size that it should have")
            parts[name] = entry, digests[name]
        return parts

    def _entry(self, name: str) -> zipfile.ZipInfo:
        try:
            entry = self._zip.getinfo(name)
        except KeyError as error:
            raise self._no_backup(f"it has no {name}") from error
        mode = entry.external_attr >> 16
        if mode and stat.S_IFMT(mode) not in {0, stat.S_IFREG}:
            raise self._damaged(f"{name} is no plain file")
        if entry.compress_type not in {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}:
            raise self._damaged(f"{name} is packed in a way that we do not use")
        if entry.flag_bits & 1:
            raise self._damaged(f"{name} is encrypted")
        if entry.file_size > _TIGHTEST * entry.compress_size + _CHUNK:
            raise self._damaged(f"{name} is packed more tightly than we do")
        return entry

    def _damaged(self, why: str) -> CannotStart:
        return CannotStart(f"{self._source} is damaged, or no backup of ours: {why}.")

    def _no_backup(self, why: object) -> CannotStart:
        return CannotStart(f"{self._source} is no backup of ours, or is damaged: {why}.")


def about_now(**fields: object) -> BackupManifest:
    """Return a manifest with the version, commit and schemas of this program."""
    own = {
        "format": FORMAT,
        "version": VERSION,
        "commit": commit(),
        "schemas": {branch: revisions_of(branch)[-1] for branch in BRANCHES},
    }
    return msgspec.convert({**own, **fields}, type=BackupManifest)


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of the file `path`, in hex."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _is_place(name: str) -> bool:
    """Return whether a name in a backup is a plain relative path below FILES or ARCHIVE."""
    parts = PurePosixPath(name).parts
    plain = all(each not in {"", ".", ".."} and each.isprintable() for each in name.split("/"))
    return plain and len(parts) > 1 and parts[0] in {FILES, ARCHIVE} and "\\" not in name


def _copied(there: IO[bytes], here: IO[bytes], text: str, progress: Progress) -> tuple[int, str]:
    """Copy the stream `there` into `here`; return the number of bytes and the SHA-256 in hex.
    `text`: the progress message."""
    size, digest = 0, hashlib.sha256()
    while block := there.read(_CHUNK):
        here.write(block)
        digest.update(block)
        size += len(block)
        progress.tell(f"{text}: {size >> 20} MiB")
    return size, digest.hexdigest()
