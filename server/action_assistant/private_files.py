"""Private files: folders that only this user may enter, files that only they may read."""

import os
import re
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Final, TypeVar

import msgspec

from action_assistant.errors import CannotStart

#: The names of files and folders that this program creates in a data folder.
_OURS: Final = re.compile(
    r"(editor|runner)\.(database|db|mark).*|restore\.unfinished|token|\.token-.*|\.probe-.*|open\.html"
    r"|revoked|sessions|people|passkeys|released|confirmed|tokens|views|graph-(rules|sights)\.json.*|tls|archive|recordings|before-(restore-|move-|upgrade).*|\.(backup|restore|rehearsal|move)-.*"
    r"|backups\.json.*|\.backups\.json\.part"
)
_OTHERS: Final = stat.S_IRWXG | stat.S_IRWXO
_T = TypeVar("_T")


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


def decoded(content: bytes, kind: type[_T]) -> _T:
    """Return the value of this kind that a file of this program holds as JSON. Raise
    msgspec.DecodeError for every other content: of itself msgspec raises other errors for text that is
    not UTF-8 or is nested too deeply, and a damaged file would stop whoever reads it."""
    try:
        return msgspec.json.decode(content, type=kind)
    except (UnicodeError, RecursionError) as error:
        raise msgspec.DecodeError(f"{error}") from error


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
