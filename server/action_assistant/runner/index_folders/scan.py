"""Finds the files in an index folder that define given names. It only reads; for workers.

Files are found as an engine finds them: each file with `graph.json` or `umrf.json` in its name,
links followed, down to two folders below the first (docs/umrf-and-the-engine.md 1.5, 4).
"""

import os
import stat
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.safe_text import printable
from action_assistant.umrf.files.writing import ACTION_MARK, GRAPH_MARK

DEEP: Final = 2  # levels of folders below the first one
_LARGEST: Final = 8 << 20  # bytes of a file
_MOST: Final = 50_000  # files and folders
_BOM: Final = b"\xef\xbb\xbf"


class DefiningFile(msgspec.Struct, frozen=True):
    """A file that defines the name of a graph or action. `path`: relative to the folder; `linked`:
    the path leads through a symbolic link."""

    path: str
    linked: bool
    text: bytes

    @property
    def display_path(self) -> str:
        """The path as people read it, in one line."""
        return shown_path(self.path)


class IndexedFiles(msgspec.Struct, frozen=True):
    """The files that define names, by name. `unread`: files and folders that cannot be read, with
    the reason, so that their definitions are not known."""

    graphs: dict[str, tuple[DefiningFile, ...]] = {}
    actions: dict[str, tuple[DefiningFile, ...]] = {}
    unread: tuple[str, ...] = ()


class _NamedText(msgspec.Struct):
    graph_name: object = None
    name: object = None


def shown_path(path: str) -> str:
    """Return a path of a file system, which is bytes, as text of one line."""
    return printable(os.fsencode(path).decode(errors="replace")).replace("\n", "\\n")


def scanned(folder: Path, names: Collection[str]) -> IndexedFiles:
    """Return the files in the folder that define one of `names`. No error is raised: unreadable
    files are listed in the result."""
    graphs: dict[str, tuple[DefiningFile, ...]] = {}
    actions: dict[str, tuple[DefiningFile, ...]] = {}
    unread: list[str] = []
    for path, linked in _marked(folder, unread):
        try:
            text = _text(folder / path)
        except OSError as error:
            unread.append(f"{shown_path(path)} ({error.strerror or error})")
            continue
        found = _names(text)
        file = DefiningFile(path, linked, text)
        base = path.rpartition("/")[2]
        for mark, name, files in (
            (GRAPH_MARK, found.graph_name, graphs),
            (ACTION_MARK, found.name, actions),
        ):
            if mark in base and isinstance(name, str) and name in names:
                files[name] = (*files.get(name, ()), file)
    return IndexedFiles(graphs, actions, tuple(unread))


def _marked(folder: Path, unread: list[str]) -> Iterator[tuple[str, bool]]:
    """Yield the paths of the files that an engine would read, relative to the folder, and whether a
    symbolic link leads to them. What cannot be read is added to `unread`, with the reason."""
    left, seen = [("", False, 0)], 0
    while left:
        below, linked, depth = left.pop()
        try:
            entries = sorted(os.scandir(folder / below), key=lambda each: each.name)
        except OSError as error:
            unread.append(f"{shown_path(below) or 'the folder'} ({error.strerror or error})")
            continue
        for entry in entries:
            seen += 1
            if seen > _MOST:
                unread.append(f"what comes after {_MOST:,} files and folders")
                return
            path = f"{below}{entry.name}"
            by_link = linked or entry.is_symlink()
            if _is_folder(entry):
                if depth < DEEP:
                    left.append((f"{path}/", by_link, depth + 1))
            elif _is_marked(entry.name) and not _is_dangling(entry):
                yield path, by_link


def _is_marked(name: str) -> bool:
    return GRAPH_MARK in name or ACTION_MARK in name


def _is_folder(entry: "os.DirEntry[str]") -> bool:
    try:
        return entry.is_dir()
    except OSError:  # a circle of links
        return False


def _is_dangling(entry: "os.DirEntry[str]") -> bool:
    """Return whether an entry is a link that leads nowhere: it defines nothing."""
    try:
        entry.stat()
    except OSError:
        return entry.is_symlink()
    return False


def _text(path: Path) -> bytes:
    """Return the contents of the regular file `path`; b"" for a folder, a pipe or a device. Links
    are followed. Raise OSError if the file cannot be read or is too large."""
    with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as opened:
        if not stat.S_ISREG(os.fstat(opened.fileno()).st_mode):
            return b""  # an engine cannot read it either
        text = opened.read(_LARGEST + 1)
    if len(text) > _LARGEST:
        raise OSError(f"larger than {_LARGEST >> 20} MB")
    return text


def _names(text: bytes) -> _NamedText:
    """Return the names in a JSON text; no names for any other text, which engines skip, too."""
    try:
        return msgspec.json.decode(text.removeprefix(_BOM), type=_NamedText)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return _NamedText()
