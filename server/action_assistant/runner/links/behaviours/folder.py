"""The folder of behaviours: finds and reads the Python file of an action. No other file is ever read."""

import errno
import os
import re
import stat
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.errors import CannotStart
from action_assistant.umrf.packages.naming import check_name, snake_case

_LARGEST: Final = 1 << 20  # bytes of a file
_FILE: Final = re.compile(r"([a-z][a-z0-9]*(?:_[a-z0-9]+)*)\.py", re.ASCII)
_MOST: Final = 1_000  # names of a list


class Unusable(Exception):
    """The behaviour of an action cannot be run; the message is a sentence for people."""


class BehaviourList(msgspec.Struct, frozen=True):
    """The behaviours in a folder. `names`: in snake case, as the files without `.py`; `refused`:
    those that cannot be run, with the reason; `problem`: why the folder cannot be read, "" if it
    can."""

    names: tuple[str, ...] = ()
    refused: dict[str, str] = {}
    problem: str = ""


class BehaviourFolder(msgspec.Struct, frozen=True):
    """A folder that the administrator keeps: one Python file for each action that code plays in
    simulations."""

    path: Path

    @classmethod
    def opened(cls, path: Path) -> "BehaviourFolder":
        """Return the folder at `path`. Raise CannotStart if it does not exist, or the system is not
        Linux."""
        if sys.platform != "linux":
            raise CannotStart("Behaviours need Linux, which ends their processes for certain.")
        found = cls(path.absolute())
        try:
            with found._entered():
                pass
        except OSError as error:
            why = error.strerror or str(error)
            raise CannotStart(f"There is no folder of behaviours {path}: {why}.") from error
        return found

    def has(self, name: str) -> bool:
        """Return whether a file for actions of this name exists, even if it could not be run."""
        if (file := file_of(name)) is None:
            return False
        try:
            with self._entered() as folder:
                os.stat(file, dir_fd=folder, follow_symlinks=False)
        except FileNotFoundError:
            return False
        except OSError:
            return True  # why it cannot be run is told when it is read
        return True

    def source(self, name: str) -> str:
        """Return the Python text of an action's behaviour. Raise Unusable if no behaviour can have
        this name, or if its file cannot be read or is no regular file."""
        file = file_of(name)
        if file is None:
            raise Unusable(f"“{name}” is no name that a behaviour can have.")
        try:
            with self._entered() as folder:
                return _text(file, folder)
        except OSError as error:
            why = error.strerror or str(error)
            if error.errno == errno.ELOOP:
                why = "it is a link, and no link is followed"
            if error.errno == errno.EISDIR:
                why = "it is no regular file"
            raise Unusable(f"The behaviour {file} cannot be read: {why}.") from error

    def listed(self, names: Iterable[str] | None = None) -> BehaviourList:
        """Return the behaviours in the folder, or only those for the actions in `names`; the first
        ones if there are very many. A folder or file that cannot be used is reported in the result,
        not raised."""
        try:
            with self._entered() as folder, os.scandir(folder) as entries:
                found = [_FILE.fullmatch(each.name) for each in entries]
        except OSError as error:
            why = error.strerror or str(error)
            return BehaviourList(problem=f"The folder of behaviours cannot be read: {why}.")
        there = {each[1] for each in found if each is not None}
        wanted = there if names is None else there & {snake_case(n) for n in names if file_of(n)}
        good: list[str] = []
        refused: dict[str, str] = {}
        for name in sorted(wanted)[:_MOST]:
            try:
                self.source(name)
                good.append(name)
            except Unusable as error:
                refused[name] = str(error)
        return BehaviourList(tuple(good), refused)

    @contextmanager
    def _entered(self) -> Iterator[int]:
        """Open the folder and yield its descriptor, so that all reads go to this folder even if its
        path is changed meanwhile. Raise OSError if it cannot be opened."""
        folder = os.open(self.path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            yield folder
        finally:
            os.close(folder)


def file_of(name: str) -> str | None:
    """Return the name of the Python file with the behaviour of an action. Return None if no action
    of an action package can have this name."""
    return None if check_name(name) else f"{snake_case(name)}.py"


def _text(file: str, folder: int) -> str:
    """Return the text of the regular file `file` in the folder with the descriptor `folder`. Raise
    OSError if it cannot be opened or read, and Unusable if it is no regular file, is too large
    or is not UTF-8."""
    flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
    with os.fdopen(os.open(file, flags, dir_fd=folder), "rb") as opened:
        if not stat.S_ISREG(os.fstat(opened.fileno()).st_mode):
            raise Unusable(f"The behaviour {file} cannot be read: it is no regular file.")
        raw = opened.read(_LARGEST + 1)
    if len(raw) > _LARGEST:
        raise Unusable(
            f"The behaviour {file} cannot be read: it is larger than {_LARGEST >> 20} MB."
        )
    try:
        return raw.decode()
    except UnicodeDecodeError as error:
        raise Unusable(f"The behaviour {file} cannot be read: it is not UTF-8.") from error
