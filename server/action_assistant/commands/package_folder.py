"""A folder that packages are written into: compared first, nothing replaced, no link followed."""

import errno
import os
import stat
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.errors import CannotStart

_FOLDER: Final = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_READ: Final = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
_MAKE: Final = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC


class FolderComparison(msgspec.Struct, frozen=True):
    """What is there in comparison with what is to be. `changed` has the contents that are there, by
    path; `barred` says why a path can neither be read nor written: a link, a folder, something else."""

    missing: tuple[str, ...] = ()
    same: tuple[str, ...] = ()
    changed: dict[str, bytes] = {}
    barred: dict[str, str] = {}


def compared(root: Path, files: Mapping[str, bytes]) -> FolderComparison:
    """Paths of `files` are relative, with `/`. Raises CannotStart for a folder that cannot be read."""
    missing: list[str] = []
    same: list[str] = []
    changed: dict[str, bytes] = {}
    barred: dict[str, str] = {}
    try:
        top = os.open(root, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except FileNotFoundError:
        return FolderComparison(missing=tuple(files))
    except OSError as error:
        raise CannotStart(f"Cannot read {root}: {error.strerror}.") from error
    try:
        for path, content in files.items():
            try:
                there = _content(top, path)
            except FileNotFoundError:
                missing.append(path)
            except OSError as error:
                barred[path] = _reason(error)
            else:
                if there == content:
                    same.append(path)
                else:
                    changed[path] = there
    finally:
        os.close(top)
    return FolderComparison(tuple(missing), tuple(same), changed, barred)


def write_new(root: Path, files: Mapping[str, bytes]) -> None:
    """Makes files that are not there, and the folders that they need; all of the files or none. Raises
    CannotStart."""
    made: list[str] = []
    try:
        root.mkdir(parents=True, exist_ok=True)
        top = os.open(root, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except OSError as error:
        raise CannotStart(f"Cannot make {root}: {error.strerror}.") from error
    try:
        for path, content in files.items():
            _write(top, path, content, made)
    except OSError as error:
        for each in made:
            with suppress(OSError):
                _unlink(top, each)
        raise CannotStart(
            f"Cannot write {root / path}: {_reason(error)}. Nothing was kept."
        ) from error
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


def _inside(top: int, path: str, make: bool) -> tuple[int, str]:
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


def _content(top: int, path: str) -> bytes:
    at, name = _inside(top, path, make=False)
    try:
        file = os.open(name, _READ, dir_fd=at)
    finally:
        os.close(at)
    with os.fdopen(file, "rb") as opened:
        if not stat.S_ISREG(os.fstat(opened.fileno()).st_mode):
            raise OSError(errno.EINVAL, "it is no file")
        return opened.read()


def _write(top: int, path: str, content: bytes, made: list[str]) -> None:
    at, name = _inside(top, path, make=True)
    try:
        file = os.open(name, _MAKE, 0o666, dir_fd=at)
    finally:
        os.close(at)
    made.append(path)
    with os.fdopen(file, "wb") as opened:
        opened.write(content)


def _unlink(top: int, path: str) -> None:
    at, name = _inside(top, path, make=False)
    try:
        os.unlink(name, dir_fd=at)
    finally:
        os.close(at)
