"""Files put into a folder that an engine indexes: whole or not at all, and nothing of others is lost.

Under its name a file is whole from the first moment on. One that is replaced is put aside first, under a
name that no engine looks for, and stays there. No link below the folder is followed.
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
from action_assistant.umrf.files.file_names import graph_file_name, unmarked

_NUMBERS: Final = 1_000  # names that are tried
_KEPT: Final = 120  # bytes of the name of a file that is put aside


class NewFile(msgspec.Struct, frozen=True):
    """The file of a graph. `replaces`: the path of the one that goes aside, "" for none; `old`: the SHA-256
    of what that has in it, in hex."""

    graph: str
    text: bytes
    replaces: str = ""
    old: str = ""


class WrittenFile(msgspec.Struct, frozen=True, omit_defaults=True):
    """A file that was written, and where the one that it replaced is kept."""

    graph: str
    path: str
    kept: str = ""


class WritingOutcome(msgspec.Struct, frozen=True):
    """What was written; `failed`: why the rest was not, a sentence, "" where all was."""

    written: tuple[WrittenFile, ...]
    failed: str = ""


class _Prepared(msgspec.Struct):
    """A file that is on the disk under a name of its own, in the folder that is open there."""

    file: NewFile
    folder: int
    fresh: str


class _Changed(Exception):
    """Somebody else was quicker; the message is a sentence."""


def write(folder: Path, files: Sequence[NewFile]) -> WritingOutcome:
    """Write them. All are on the disk before the first of them gets its name. Never raises."""
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
    """The SHA-256 of a text, in hex."""
    return hashlib.sha256(text).hexdigest()


def _as_folder() -> int:
    """How a folder is opened. Windows, which has no runner, lacks the name."""
    return os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC


@contextmanager
def _opened(folder: Path) -> Iterator[int]:
    """The folder as the administrator named it, be that a link."""
    found = os.open(folder, _as_folder())
    try:
        yield found
    finally:
        os.close(found)


@contextmanager
def _entered(top: int, path: str) -> Iterator[int]:
    """The folder of a file, by no link. Raises OSError."""
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
    """The permissions of the file that is replaced; of a new one those of its folder, which the engine
    reads, whatever this process keeps to itself. Raises OSError, _Changed."""
    if not path:
        return os.fstat(folder).st_mode & 0o666
    try:
        found = os.stat(_base(path), dir_fd=folder, follow_symlinks=False)
    except FileNotFoundError as gone:
        raise _Changed(_changed(path)) from gone
    return stat.S_IMODE(found.st_mode) & 0o777


@contextmanager
def _fresh(folder: int, text: bytes, mode: int) -> Iterator[str]:
    """A file with this text, on the disk, under a name that is gone afterwards. Raises OSError."""
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
    """Under a name that nothing has."""
    for number in range(1, _NUMBERS):
        name = graph_file_name(each.file.graph, number)
        try:
            _link(each.folder, each.fresh, name)
        except FileExistsError:
            continue
        return WrittenFile(each.file.graph, name)
    raise OSError("every name is taken")


def _replaced(each: _Prepared) -> WrittenFile:
    """In the place of a file that is still what it was."""
    path, folder = each.file.replaces, each.folder
    name, above = _base(path), path[: len(path) - len(_base(path))]
    kept = os.fsdecode(os.fsencode(unmarked(name))[:_KEPT]) + f".{secrets.token_hex(4)}.replaced"
    aside = shown_path(above + kept)
    changed = _changed(path)
    _require_same(folder, name, each.file.old, changed)
    os.rename(name, kept, src_dir_fd=folder, dst_dir_fd=folder)
    try:
        _require_same(folder, kept, each.file.old, changed)
        _link(folder, each.fresh, name)
    except FileExistsError as quicker:  # what somebody has written anew stays
        raise _Changed(f"{changed} What was there before is {aside}.") from quicker
    except (OSError, _Changed) as failed:
        if not _put_back(folder, kept, name):
            raise _Changed(f"{changed} What was there before is {aside}.") from failed
        raise
    return WrittenFile(each.file.graph, shown_path(path), aside)


def _changed(path: str) -> str:
    return f"{shown_path(path)} was changed meanwhile; look again."


def _require_same(folder: int, name: str, old: str, changed: str) -> None:
    """Raises _Changed, OSError."""
    try:
        if _sha_of(folder, name) == old:
            return
    except FileNotFoundError:
        pass
    raise _Changed(changed)


def _put_back(folder: int, kept: str, name: str) -> bool:
    """Whether what was put aside has its name again; not where something else has it by now."""
    try:
        _link(folder, kept, name)
        os.unlink(kept, dir_fd=folder)
    except FileExistsError:
        return False
    except OSError:  # where there are no second names
        os.rename(kept, name, src_dir_fd=folder, dst_dir_fd=folder)
    return True


def _link(folder: int, old: str, new: str) -> None:
    os.link(old, new, src_dir_fd=folder, dst_dir_fd=folder, follow_symlinks=False)


def _sha_of(folder: int, name: str) -> str:
    """Of a regular file; "" of anything else. Raises OSError."""
    flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
    with os.fdopen(os.open(name, flags, dir_fd=folder), "rb") as opened:
        if not stat.S_ISREG(os.fstat(opened.fileno()).st_mode):
            return ""
        return hashlib.file_digest(opened, "sha256").hexdigest()


def _base(path: str) -> str:
    return path.rpartition("/")[2]
