"""Files below a folder, read and replaced all together; no link is followed."""

import errno
import os
import secrets
import stat
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.errors import CannotStart

_TOP: Final = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC
_FOLDER: Final = _TOP | os.O_NOFOLLOW
_READ: Final = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
_MAKE: Final = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC


class FolderContents(msgspec.Struct, frozen=True):
    """What is there, by path. `barred` says why a path can neither be read nor written: a link, a
    folder, something else. What is in neither is missing."""

    present: dict[str, bytes] = {}
    barred: dict[str, str] = {}


class FileStep(msgspec.Struct, frozen=True):
    """One step of writing: the file is replaced or made, or removed where `content` is None."""

    path: str
    content: bytes | None


def contents(root: Path, paths: Iterable[str]) -> FolderContents:
    """Paths are relative, with `/`. Raises CannotStart for a folder that cannot be read."""
    present: dict[str, bytes] = {}
    barred: dict[str, str] = {}
    try:
        top = os.open(root, _TOP)
    except FileNotFoundError:
        return FolderContents()
    except OSError as error:
        raise CannotStart(f"Cannot read {root}: {error.strerror}.") from error
    try:
        for path in paths:
            try:
                present[path] = _content(top, path)[0]
            except FileNotFoundError:
                pass
            except OSError as error:
                barred[path] = _reason(error)
    finally:
        os.close(top)
    return FolderContents(present, barred)


def write_all(root: Path, steps: Sequence[FileStep], known: Mapping[str, bytes]) -> None:
    """Does the steps in their order, or none of them; makes the folders that they need. `known` is what
    the files are known to hold: one that holds anything else by now stops it all. Raises CannotStart.

    Everything is written into new files beside first, where nothing is lost if the disk is full; what
    then remains is renaming, and each file is the old one or the new one at any moment.
    """
    try:
        root.mkdir(parents=True, exist_ok=True)
        top = os.open(root, _TOP)
    except OSError as error:
        raise CannotStart(f"Cannot make {root}: {error.strerror}.") from error
    staged: list[str | None] = []
    done: list[FileStep] = []
    at = ""
    try:
        for step in steps:
            at = step.path
            staged.append(None if step.content is None else _stage(top, at, step.content))
        for at in dict.fromkeys(step.path for step in steps):
            _prove_unchanged(top, at, known.get(at))
        for step, name in zip(steps, staged, strict=True):
            at = step.path
            done.append(step)  # it may fail half-way: renamed, and not on the disk
            _do(top, at, name)
    except BaseException as error:
        _undo(top, done, known)
        for step, name in zip(steps, staged, strict=False):
            if name is not None:
                with suppress(OSError):
                    _remove(top, _beside(step.path, name))
        if isinstance(error, OSError):
            reason = f"Cannot write {root / at}: {_reason(error)}. Nothing was kept."
            raise CannotStart(reason) from error
        raise
    finally:
        os.close(top)


def _reason(error: OSError) -> str:
    """In words: with `O_NOFOLLOW`, a link is one level too many, or no folder."""
    match error.errno:
        case errno.ELOOP:
            return "it is a link, which is not followed"
        case errno.ENOTDIR:
            return "what should be a folder above it is a file or a link"
        case _:
            return error.strerror or str(error)


def _inside(top: int, path: str, make: bool = False) -> tuple[int, str]:
    """The folder of a path, opened step by step, and the last name."""
    *folders, name = path.split("/")
    if any(part in {"", ".", ".."} or "\x00" in part for part in (*folders, name)):
        raise OSError(errno.EINVAL, "the path leads out of the folder")
    at = os.dup(top)
    for folder in folders:
        try:
            if make:
                with suppress(FileExistsError):
                    os.mkdir(folder, dir_fd=at)
            below = os.open(folder, _FOLDER, dir_fd=at)
        finally:
            os.close(at)
        at = below
    return at, name


def _content(top: int, path: str) -> tuple[bytes, int]:
    """What a file holds, and who may do what with it."""
    at, name = _inside(top, path)
    try:
        file = os.open(name, _READ, dir_fd=at)
    finally:
        os.close(at)
    with os.fdopen(file, "rb") as opened:
        mode = os.fstat(opened.fileno()).st_mode
        if not stat.S_ISREG(mode):
            raise OSError(errno.EINVAL, "it is no file")
        return opened.read(), stat.S_IMODE(mode)


def _prove_unchanged(top: int, path: str, known: bytes | None) -> None:
    try:
        there = _content(top, path)[0]
    except FileNotFoundError:
        there = None
    if there != known:
        raise OSError(errno.EBUSY, "it was changed while this was at work; call again")


def _stage(top: int, path: str, content: bytes) -> str:
    """Writes a new file beside the path, as open to others as the one that is there. Returns its name."""
    at, name = _inside(top, path, make=True)
    new = f".{name}.{secrets.token_hex(4)}"
    try:
        file = os.open(new, _MAKE, 0o666, dir_fd=at)
        try:
            with os.fdopen(file, "wb") as opened:
                with suppress(FileNotFoundError):
                    os.fchmod(file, _content(top, path)[1])
                opened.write(content)
                opened.flush()
                os.fsync(file)
        except BaseException:
            os.unlink(new, dir_fd=at)
            raise
    finally:
        os.close(at)
    return new


def _beside(path: str, name: str) -> str:
    return "/".join((*path.split("/")[:-1], name))


def _do(top: int, path: str, staged: str | None) -> None:
    at, name = _inside(top, path)
    try:
        if staged is None:
            os.unlink(name, dir_fd=at)
        else:
            os.replace(staged, name, src_dir_fd=at, dst_dir_fd=at)
        os.fsync(at)  # the steps reach the disk in their order, too
    finally:
        os.close(at)


def _undo(top: int, done: Sequence[FileStep], known: Mapping[str, bytes]) -> None:
    """The last first, as far as the disk lets us; what stays is a call that was not finished."""
    for path in reversed(dict.fromkeys(step.path for step in done)):
        with suppress(OSError):
            if path in known:
                _do(top, path, _stage(top, path, known[path]))
            else:
                _remove(top, path)


def _remove(top: int, path: str) -> None:
    _do(top, path, None)
