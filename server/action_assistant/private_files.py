"""Private files: folders that only this user may enter, files that only they may read."""

import contextlib
import logging
import os
import re
import stat
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Final, NamedTuple, TypeVar

import msgspec

from action_assistant.errors import CannotStart
from action_assistant.random_ids import random_id

log: Final = logging.getLogger(__name__)
_T = TypeVar("_T")

#: The names of files and folders that this program creates in a data folder.
_OURS: Final = re.compile(
    r"(editor|runner)\.(address|database|db|mark).*|editor-\d+\.lock|restore\.unfinished|token|\.token-.*|\.probe-.*|open\.html"
    r"|revoked|sessions|people|passkeys|released|confirmed|tokens|views|runners\.json.*|graph-(rules|sights)\.json.*|tls|archive|recordings|photos|before-(restore-|move-|upgrade).*|\.(backup|restore|rehearsal|move)-.*"
    r"|backups\.json.*|\.backups\.json\.part"
)
_OTHERS: Final = stat.S_IRWXG | stat.S_IRWXO
_MOST: Final = 64 * 1024 * 1024  # bytes of a small file; nothing of ours comes near it
#: Ends the name of a file that held nothing readable, and was replaced.
_DAMAGED: Final = ".damaged-"


class DamagedFile(ValueError):
    """A file exists, and holds no value of the form that is wanted. The text says why."""


class FileState(NamedTuple):
    """The state of a file as a listing has it, which changes with each write."""

    changed_ns: int
    number: int
    size: int


def opener(path: str, flags: int) -> int:
    """Open the file `path` with the flags of `os.open`, and return its descriptor. A new file can
    be read and written by this user only. Use it as `open(…, opener=opener)`."""
    return os.open(path, flags, 0o600)


def make_folder(path: Path) -> None:
    """Create the folder `path` and its missing parents, open to this user only. Raise OSError if
    that fails."""
    if not path.is_dir():
        make_folder(path.parent)
        path.mkdir(mode=0o700, exist_ok=True)


def replace_file(
    path: Path, content: bytes, *, part: Path | None = None, is_durable: bool = True
) -> None:
    """Write a private file so that others find the old content or the new one, never a part of it.
    Raise OSError if it cannot be written.

    The content is written to `part` first (by default the path with `.part` appended). With
    `is_durable` it survives a power cut; call `sync` on the folder to make the rename durable, too.
    """
    part = part or path.with_name(f"{path.name}.part")
    part.unlink(missing_ok=True)  # it may have other rights
    with open(part, "wb", opener=opener) as out:
        out.write(content)
        out.flush()
        if is_durable:
            os.fsync(out.fileno())
    part.replace(path)


def state_of(path: Path) -> FileState:
    """Return the state of a file. Raise OSError if it has none."""
    found = path.stat()
    return FileState(found.st_mtime_ns, found.st_ino, found.st_size)


def read_json(path: Path, kind: type[_T]) -> _T:
    """Return the value in a small JSON file. Raise OSError if the file cannot be read, DamagedFile if
    it holds no value of this kind, whatever else it holds."""
    flags = getattr(os, "O_NONBLOCK", 0)  # a pipe in its place keeps nobody waiting
    with open(path, "rb", opener=lambda name, mode: os.open(name, mode | flags)) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise DamagedFile("it is no file")
        content = file.read(_MOST + 1)
    if len(content) > _MOST:
        raise DamagedFile(f"it has more than {_MOST} bytes")
    try:
        content.decode()  # what is skipped is not looked at below
        return msgspec.json.decode(content, type=kind)
    except (ValueError, RecursionError) as error:  # no text, no JSON, too deep, or another form
        raise DamagedFile(str(error)) from error


def read_logged(path: Path, kind: type[_T]) -> _T | None:
    """Return the value in a small JSON file; None, with a line in the log, if it holds no value of this
    kind. Raise OSError if the file cannot be read."""
    try:
        return read_json(path, kind)
    except DamagedFile as error:
        log_unreadable(path, error)
        return None


def write_json(
    path: Path, value: object, kind: type[object] | None = None, *, is_durable: bool = True
) -> None:
    """Write a value as a private JSON file, also while the other process writes it; its folder is made.
    What was there before is kept beside it if it holds no value of this `kind` (by default the value's
    type). Raise OSError if it cannot be written."""
    make_folder(path.parent)
    keep_damaged(path, kind or type(value))
    part = path.with_name(f"{path.name}.{random_id()}.part")
    replace_file(path, msgspec.json.encode(value), part=part, is_durable=is_durable)


def log_unreadable(path: Path, error: OSError | DamagedFile) -> None:
    """Write into the log that a file cannot be read, once for each state of it."""
    state = None
    with contextlib.suppress(OSError):
        state = state_of(path)
    why = error.strerror if isinstance(error, OSError) else str(error)
    _log_once(path, state, why or type(error).__name__)


@lru_cache(1000)
def _log_once(path: Path, _: FileState | None, why: str) -> None:
    log.error("%s cannot be read, and is kept as it is: %s", path, why)


def keep_damaged(path: Path, kind: type[object]) -> None:
    """Rename a file that holds no value of this kind, so that it can be looked at after another one
    has taken its place. Raise OSError if that fails."""
    try:
        read_json(path, kind)
    except FileNotFoundError:
        return
    except DamagedFile as error:
        kept = path.with_name(f"{path.name}{_DAMAGED}{path.stat().st_mtime_ns}")
        log.error("%s is replaced, and kept as %s: %s", path, kept.name, error)
        path.rename(kept)


def sync(path: Path) -> None:
    """Flush the file or folder `path` to disk, so that its content or a rename survives a power
    cut. The call waits for the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def own_folder(data: Path) -> Path:
    """Make the data folder if it is missing, check that it is writable, close the files of this
    program in it to other users, and return its path. The folder itself stays open to other users
    if it also holds foreign files. Raise CannotStart if it cannot be written."""
    prove_writable(data)
    for path in open_to_others(data):
        if path != data or holds_nothing_else(data):
            _close(path)
    return data


def prove_writable(data: Path) -> None:
    """Make the data folder if it is missing, and check that files can be made in it. Raise
    CannotStart if they cannot."""
    try:
        data.mkdir(mode=0o700, parents=True, exist_ok=True)
        probe = data / f".probe-{os.getpid()}"
        os.close(os.open(probe, os.O_WRONLY | os.O_CREAT, 0o600))
        probe.unlink()
    except OSError as error:
        raise CannotStart(f"Cannot write to the data folder {data}: {error.strerror}.") from error


def open_to_others(data: Path) -> list[Path]:
    """Return the paths that other users of this computer may read or enter: the data folder first,
    then files of this program in it. The list is empty on Windows, where modes say nothing about
    rights."""
    if not hasattr(os, "geteuid"):
        return []  # Windows keeps rights in lists of its own, of which modes tell nothing
    return [path for path in (data, *_own_files(data)) if _is_open(path)]


def holds_nothing_else(data: Path) -> bool:
    """Return whether the data folder holds only files of this program. If it holds others, the
    permissions of the folder are left as they are."""
    return all(_OURS.fullmatch(entry.name) for entry in data.iterdir())


def _own_files(data: Path) -> Iterator[Path]:
    """Yield the files and folders of this program in a data folder, each folder before its content;
    symbolic links are skipped."""
    for entry in sorted(data.iterdir()):
        if not _OURS.fullmatch(entry.name) or entry.is_symlink():
            continue
        yield entry
        if entry.is_dir():
            for folder, folders, files in os.walk(entry):
                yield from (Path(folder, name) for name in (*folders, *files))


def _is_open(path: Path) -> bool:
    try:
        found = path.lstat()
    except OSError:  # gone meanwhile
        return False
    return not stat.S_ISLNK(found.st_mode) and bool(found.st_mode & _OTHERS)


def _close(path: Path) -> None:
    try:
        path.chmod(0o700 if path.is_dir() else 0o600)
    except OSError:  # another user's; `doctor` reports it
        return


def of_others(data: Path) -> list[Path]:
    """Return the files of this program in a data folder that belong to another user than the folder
    does."""
    owner = data.stat().st_uid
    found: list[Path] = []
    for path in _own_files(data):
        try:
            if path.lstat().st_uid != owner:
                found.append(path)
        except OSError:  # gone meanwhile
            continue
    return found
