"""Writes files into a folder that an engine indexes: each as a whole or not at all, without losing
files of others.

A file is complete from the moment on at which it has its name. A file that is replaced is renamed
first, to a name that no engine looks for, and stays there. No link below the folder is followed.
"""

import hashlib
import os
import secrets
import stat
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.runner.index_folders.scan import shown_path
from action_assistant.umrf.files.writing import graph_file_name, unmarked

_MOST_NAMES: Final = 1_000  # that are tried for a new file
_KEPT_NAME: Final = 120  # bytes of the old name in that of a file that was moved away


class NewFile(msgspec.Struct, frozen=True):
    """The new file of a graph. `replaces`: the path of the file that it replaces, "" for none;
    `old`: the SHA-256 of that file, in hex."""

    graph: str
    text: bytes
    replaces: str = ""
    old: str = ""


class WrittenFile(msgspec.Struct, frozen=True, omit_defaults=True):
    """A file that was written. `kept`: the path to which the file that it replaced was moved, ""
    for none."""

    graph: str
    path: str
    kept: str = ""


class WritingOutcome(msgspec.Struct, frozen=True):
    """The files that were written; `failed`: a sentence that says why the others were not, "" where
    all were."""

    written: tuple[WrittenFile, ...]
    failed: str = ""


class _Prepared(msgspec.Struct):
    """A file that is on the disk under a temporary name (`fresh`), in the open folder `folder` (a
    descriptor)."""

    file: NewFile
    folder: int
    fresh: str


class _Changed(Exception):
    """Another program has changed a file meanwhile; the message is a sentence."""


def write(folder: Path, files: Sequence[NewFile]) -> WritingOutcome:
    """Write all files into the folder: all contents are on the disk before the first file gets its
    name. No error is raised: the result says what was written and what went wrong."""
    written: list[WrittenFile] = []
    place = str(folder)
    try:
        with ExitStack() as stack:
            top = stack.enter_context(_opened(folder))
            prepared: list[_Prepared] = []
            for file in files:
                place = str(folder / (file.replaces or graph_file_name(file.graph)))
                below = stack.enter_context(_entered(top, file.replaces))
                mode = _mode(below, file.replaces)
                fresh = stack.enter_context(_fresh(below, file.text, mode))
                prepared.append(_Prepared(file, below, fresh))
            for each in prepared:
                place = str(folder / (each.file.replaces or graph_file_name(each.file.graph)))
                written.append(_replaced(each) if each.file.replaces else _added(each))
                os.fsync(each.folder)
    except _Changed as changed:
        return WritingOutcome(tuple(written), str(changed))
    except OSError as error:
        why = error.strerror or str(error)
        return WritingOutcome(tuple(written), f"{shown_path(place)} cannot be written: {why}.")
    return WritingOutcome(tuple(written))


def sha(text: bytes) -> str:
    """Return the SHA-256 of the bytes `text`, in hex."""
    return hashlib.sha256(text).hexdigest()


def _as_folder() -> int:
    """Return the flags to open a folder. A function, since Windows, which has no runner, lacks one
    of them."""
    return os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC


@contextmanager
def _opened(folder: Path) -> Iterator[int]:
    """Return a context with the descriptor of the index folder, whose path may be a link."""
    found = os.open(folder, _as_folder())
    try:
        yield found
    finally:
        os.close(found)


@contextmanager
def _entered(top: int, path: str) -> Iterator[int]:
    """Return a context with the descriptor of the folder that has the file `path`. `path` is
    relative to the folder with the descriptor `top`. No symbolic link is followed. Raise OSError if
    a folder cannot be opened or the path leads out of `top`."""
    found = os.dup(top)
    try:
        for name in path.split("/")[:-1]:
            if name in {"", ".", ".."}:
                raise OSError("its path leads out of the folder")
            below = os.open(name, _as_folder() | os.O_NOFOLLOW, dir_fd=found)
            os.close(found)
            found = below
        yield found
    finally:
        os.close(found)


def _mode(folder: int, path: str) -> int:
    """Return the permissions for a new file: of the file that it replaces (`path`, in the folder
    with the descriptor `folder`), or for "" of the folder, so that the engine can read it whatever
    the umask is. Raise OSError if they cannot be read, _Changed if the file to replace is gone."""
    if not path:
        return os.fstat(folder).st_mode & 0o666
    try:
        found = os.stat(_base(path), dir_fd=folder, follow_symlinks=False)
    except FileNotFoundError as gone:
        raise _Changed(_changed(path)) from gone
    return stat.S_IMODE(found.st_mode) & 0o777


@contextmanager
def _fresh(folder: int, text: bytes, mode: int) -> Iterator[str]:
    """Return a context with the temporary name of a new file with this text, in the folder with the
    descriptor `folder` and with the permissions `mode`. That name is removed at the end. Raise
    OSError if it cannot be written."""
    name = f".action-assistant-{secrets.token_hex(8)}.new"
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
    opened = os.open(name, flags, 0o600, dir_fd=folder)
    try:
        with os.fdopen(opened, "wb") as file:
            file.write(text)
            file.flush()
            os.fchmod(file.fileno(), mode)
            os.fsync(file.fileno())
        yield name
    finally:
        os.unlink(name, dir_fd=folder)


def _added(each: _Prepared) -> WrittenFile:
    """Give a new file the first free name for its graph, and return what was written. Raise OSError
    if all names are taken."""
    for number in range(1, _MOST_NAMES):
        name = graph_file_name(each.file.graph, number)
        try:
            _link(each.folder, each.fresh, name)
        except FileExistsError:
            continue
        return WrittenFile(each.file.graph, name)
    raise OSError("every name is taken")


def _replaced(each: _Prepared) -> WrittenFile:
    """Give a new file the name of the old file, which is moved aside, and return what was written.
    Raise _Changed if the old file has other contents by now; it then stays."""
    path, folder = each.file.replaces, each.folder
    name, above = _base(path), path[: len(path) - len(_base(path))]
    kept = (
        os.fsdecode(os.fsencode(unmarked(name))[:_KEPT_NAME]) + f".{secrets.token_hex(4)}.replaced"
    )
    aside = shown_path(above + kept)
    changed = _changed(path)
    _require_same(folder, name, each.file.old, changed)
    os.rename(name, kept, src_dir_fd=folder, dst_dir_fd=folder)
    try:
        _require_same(folder, kept, each.file.old, changed)
        _link(folder, each.fresh, name)
    except FileExistsError as quicker:  # a new file of another program stays
        raise _Changed(f"{changed} What was there before is {aside}.") from quicker
    except (OSError, _Changed) as failed:
        if not _put_back(folder, kept, name):
            raise _Changed(f"{changed} What was there before is {aside}.") from failed
        raise
    return WrittenFile(each.file.graph, shown_path(path), aside)


def _changed(path: str) -> str:
    return f"{shown_path(path)} was changed meanwhile; look again."


def _require_same(folder: int, name: str, old: str, changed: str) -> None:
    """Raise _Changed with the message `changed` unless the file `name`, in the folder with the
    descriptor `folder`, has contents with the SHA-256 `old`; raise OSError if it cannot be read."""
    try:
        if _sha_of(folder, name) == old:
            return
    except FileNotFoundError:
        pass
    raise _Changed(changed)


def _put_back(folder: int, kept: str, name: str) -> bool:
    """Give a file that was moved aside (its name is now `kept`) its old name again; return False if
    another file has that name by now."""
    try:
        _link(folder, kept, name)
        os.unlink(kept, dir_fd=folder)
    except FileExistsError:
        return False
    except OSError:  # a file system without hard links
        os.rename(kept, name, src_dir_fd=folder, dst_dir_fd=folder)
    return True


def _link(folder: int, old: str, new: str) -> None:
    os.link(old, new, src_dir_fd=folder, dst_dir_fd=folder, follow_symlinks=False)


def _sha_of(folder: int, name: str) -> str:
    """Return the SHA-256 of a regular file, in hex; "" for anything else. `folder`: the descriptor
    of its folder. Raise OSError if it cannot be opened."""
    flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
    with os.fdopen(os.open(name, flags, dir_fd=folder), "rb") as opened:
        if not stat.S_ISREG(os.fstat(opened.fileno()).st_mode):
            return ""
        return hashlib.file_digest(opened, "sha256").hexdigest()


def _base(path: str) -> str:
    return path.rpartition("/")[2]
