"""Files below a folder, read and replaced all together; no link is followed."""

import errno
import secrets
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import msgspec

from action_assistant.commands.directories import Directory, closing, opened, why
from action_assistant.errors import CannotStart


class FolderContents(msgspec.Struct, frozen=True):
    """The files that are present, by path, and the paths that cannot be used.

    `barred` gives the reason for a path that can be neither read nor written, for example a link or
    a folder. A path in neither mapping is missing.
    """

    present: dict[str, bytes] = {}
    barred: dict[str, str] = {}


class FileStep(msgspec.Struct, frozen=True):
    """One step of writing: the file gets this content, or is removed if `content` is None."""

    path: str
    content: bytes | None


def contents(root: Path, paths: Iterable[str]) -> FolderContents:
    """Read the files at these relative paths (with `/`). Raise CannotStart if the folder cannot be
    read."""
    present: dict[str, bytes] = {}
    barred: dict[str, str] = {}
    try:
        top = opened(root)
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
                barred[path] = why(error)
    finally:
        top.close()
    return FolderContents(present, barred)


def write_all(root: Path, steps: Sequence[FileStep], known: Mapping[str, bytes]) -> None:
    """Carry out all steps in their order, or none of them; create missing folders. `known` gives
    the expected content of each file. Raise CannotStart if a file has another content by now or
    cannot be written.

    All contents are written into new files first, so that a full disk does no harm. Then the files
    are renamed: each file is the old one or the new one at any time.
    """
    try:
        root.mkdir(parents=True, exist_ok=True)
        top = opened(root)
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
            reason = f"Cannot write {root / at}: {why(error)}. Nothing was kept."
            raise CannotStart(reason) from error
        raise
    finally:
        top.close()


@contextmanager
def _inside(top: Directory, path: str, make: bool = False) -> Iterator[tuple[Directory, str]]:
    """Open the folders of a relative path one after the other below `top`, and yield the last
    folder and the last name of the path. `make` makes folders that are missing. Raise OSError if
    the path leads out of `top`."""
    *folders, name = path.split("/")
    if any(part in {"", ".", ".."} or "\x00" in part for part in (*folders, name)):
        raise OSError(errno.EINVAL, "the path leads out of the folder")
    with ExitStack() as held:
        at = top
        for folder in folders:
            at = held.enter_context(closing(at.below(folder, make=make)))
        yield at, name


def _content(top: Directory, path: str) -> tuple[bytes, int]:
    """Return the content of a file and its mode."""
    with _inside(top, path) as (at, name):
        return at.read(name)


def _prove_unchanged(top: Directory, path: str, known: bytes | None) -> None:
    try:
        there = _content(top, path)[0]
    except FileNotFoundError:
        there = None
    if there != known:
        raise OSError(errno.EBUSY, "it was changed while this was at work; call again")


def _stage(top: Directory, path: str, content: bytes) -> str:
    """Write a new file beside the path, with the rights of the existing file there. Return its
    name."""
    with _inside(top, path, make=True) as (at, name):
        new = f".{name}.{secrets.token_hex(4)}"
        mode = None
        with suppress(FileNotFoundError):
            mode = at.read(name)[1]
        at.write_new(new, content, mode)
    return new


def _beside(path: str, name: str) -> str:
    return "/".join((*path.split("/")[:-1], name))


def _do(top: Directory, path: str, staged: str | None) -> None:
    with _inside(top, path) as (at, name):
        if staged is None:
            at.remove(name)
        else:
            at.replace(staged, name)


def _undo(top: Directory, done: Sequence[FileStep], known: Mapping[str, bytes]) -> None:
    """Undo the steps, the last first, as far as the disk allows."""
    for path in reversed(dict.fromkeys(step.path for step in done)):
        with suppress(OSError):
            if path in known:
                _do(top, path, _stage(top, path, known[path]))
            else:
                _remove(top, path)


def _remove(top: Directory, path: str) -> None:
    _do(top, path, None)
