"""The folder that packages are written to: planned by what is there, checked, and written all together.

No link is followed. In the source folder of a colcon workspace nothing is written that colcon would not take.
"""

import errno
import os
import secrets
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

import msgspec

from action_assistant.commands.directories import Directory, opened, why
from action_assistant.errors import CannotStart
from action_assistant.umrf.packages.bases import (
    BASE_NAME,
    GenerationBase,
    UnreadableBase,
    read_base,
)
from action_assistant.umrf.packages.regenerating import (
    Regeneration,
    readable_paths,
    regenerated,
)

#: Below a folder that has one of them, colcon looks for no packages.
_IGNORED: Final = frozenset({"COLCON_IGNORE", "AMENT_IGNORE"})
_MANIFEST: Final = "package.xml"


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
    """Read the files at the relative paths `paths` (with `/`) below `root`. Raise CannotStart if
    the folder cannot be read."""
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
    """Carry out all steps in their order below `root`, or none of them; create missing folders.
    `known`: the expected present content of each file. Raise CannotStart if a file has another
    content by now or cannot be written.

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
    """Return the content and the mode of the file at the relative path `path` below `top`."""
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
    """Write a new file with this content beside `path`, with the permissions of the existing file
    there. Return its name."""
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
    """Undo the steps in `done`, the last first, as far as the disk allows. `known`: the contents
    before."""
    for path in reversed(dict.fromkeys(step.path for step in done)):
        with suppress(OSError):
            if path in known:
                _do(top, path, _stage(top, path, known[path]))
            else:
                _remove(top, path)


def _remove(top: Directory, path: str) -> None:
    _do(top, path, None)


class PackagesPlan(msgspec.Struct, frozen=True):
    """The changes of packages in a folder. `regenerations`: by folder of the package; `there`:
    present contents by path; `barred`: why a path cannot be read, by path."""

    regenerations: dict[str, Regeneration]
    there: dict[str, bytes] = {}
    barred: dict[str, str] = {}

    @property
    def refused(self) -> bool:
        """Return whether anything, such as a conflict, prevents writing."""
        return bool(self.barred) or any(
            each.conflicts or each.differing or each.broken for each in self.regenerations.values()
        )

    @property
    def writes(self) -> dict[str, bytes]:
        """Return the new content of each file that changes or is missing, base files included."""
        found: dict[str, bytes] = {}
        for folder, each in self.regenerations.items():
            found |= {f"{folder}/{path}": content for path, content in each.writes.items()}
            if each.base is not None:
                found[f"{folder}/{BASE_NAME}"] = each.base
        return found

    @property
    def removals(self) -> tuple[str, ...]:
        """Return the paths of the files to be removed."""
        return tuple(
            f"{folder}/{path}"
            for folder, each in self.regenerations.items()
            for path in each.removals
        )

    @property
    def steps(self) -> tuple[FileStep, ...]:
        """Return the steps of writing, in an order that may be interrupted anywhere. The base files
        come last. If they came first, a killed call would leave files that seem to be reverted by
        people. Before all files, each base announces which files will follow, so that the next call
        recognises the written ones."""
        announced = [
            FileStep(f"{folder}/{BASE_NAME}", each.announced)
            for folder, each in self.regenerations.items()
            if each.writes
        ]
        writes = self.writes
        files = [path for path in writes if not path.endswith(f"/{BASE_NAME}")]
        bases = [path for path in writes if path.endswith(f"/{BASE_NAME}")]
        return (
            *announced,
            *(FileStep(path, writes[path]) for path in files),
            *(FileStep(path, None) for path in self.removals),
            *(FileStep(path, writes[path]) for path in bases),
        )


def plan(root: Path, packages: Mapping[str, Mapping[str, bytes]]) -> PackagesPlan:
    """Return the changes by which generated packages go into the folder `root`; nothing is written.
    `packages`: contents by package folder and path. Raise CannotStart if a folder cannot be read.
    """
    regenerations: dict[str, Regeneration] = {}
    there: dict[str, bytes] = {}
    barred: dict[str, str] = {}
    found = contents(root, [f"{folder}/{BASE_NAME}" for folder in packages])
    for folder, now in packages.items():
        base, at = None, f"{folder}/{BASE_NAME}"
        if at in found.barred:
            barred[at] = found.barred[at]
        elif at in found.present:
            there[at] = found.present[at]
            try:
                base = read_base(found.present[at])
            except UnreadableBase as error:
                barred[at] = str(error)
        below = contents(root, [f"{folder}/{path}" for path in readable_paths(folder, now, base)])
        there |= below.present
        barred |= below.barred
        if not barred:
            regenerations[folder] = _regenerated(folder, now, below.present, base)
    return PackagesPlan(regenerations, there, barred)


def _regenerated(
    folder: str,
    now: Mapping[str, bytes],
    there: Mapping[str, bytes],
    base: GenerationBase | None,
) -> Regeneration:
    inside = {path.removeprefix(f"{folder}/"): content for path, content in there.items()}
    return regenerated(folder, now, inside, base)


def prevented_in(source: Path, packages: Iterable[str]) -> tuple[str, ...]:
    """Return a sentence for each package, of these names, that is below the source folder but not
    in its folder NAME: colcon accepts each name once. Raise CannotStart if there is no such source
    folder, or if colcon ignores it."""
    if not source.is_dir():
        raise CannotStart(
            f"{source} is no folder. --into wants the source folder of a workspace that is there, as "
            "~/ws/src; --output makes folders."
        )
    for name in sorted(_IGNORED | {_MANIFEST}):
        if (source / name).exists():
            raise CannotStart(f"{source} has a {name}: colcon looks for no packages in it.")
    wanted = frozenset(packages)
    return tuple(
        f"{folder}: is a package “{name}” already, and colcon takes no two of one name."
        for folder, name in _packages(source)
        if name in wanted and os.path.realpath(folder) != os.path.realpath(source / name)
    )


def _packages(source: Path) -> Iterator[tuple[Path, str]]:
    """Yield the folder and name of every package below `source`. As colcon does, follow links to
    folders, and skip hidden folders and folders inside packages."""
    seen: set[str] = set()
    for at, folders, files in os.walk(source, followlinks=True):
        real = os.path.realpath(at)
        if real in seen or not _IGNORED.isdisjoint((*files, *folders)):
            folders.clear()
            continue
        seen.add(real)
        if _MANIFEST in files:
            folders.clear()
            name = _name(Path(at, _MANIFEST))
            if name is not None:
                yield Path(at), name
        folders[:] = sorted(folder for folder in folders if not folder.startswith("."))


def _name(manifest: Path) -> str | None:
    """Return the package name in a manifest; None if it cannot be read, as colcon skips it then,
    too."""
    try:
        name = ElementTree.fromstring(manifest.read_bytes()).findtext("name")
    except (OSError, ElementTree.ParseError):
        return None
    return None if name is None else name.strip()
