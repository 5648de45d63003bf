"""A folder that is held open while files in it are read and replaced; no link is followed.

POSIX systems hold the folder itself, whatever becomes of its path. Elsewhere there are only paths: a
link is refused when it is seen, and somebody who puts one there at that moment is not noticed.
"""

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final, Protocol, Self

#: Whether files can be named relative to an open folder.
HOLDS: Final = os.open in os.supports_dir_fd and hasattr(os, "O_DIRECTORY")


class Directory(Protocol):
    """One folder. Everything raises OSError."""

    def below(self, name: str, *, make: bool) -> "Directory":
        """A folder in it, made if need be; to be closed."""

    def read(self, name: str) -> tuple[bytes, int]:
        """What a file holds, and who may do what with it."""

    def write_new(self, name: str, content: bytes, mode: int | None) -> None:
        """Write a file that is not there yet, to the disk; all of it or nothing."""

    def replace(self, new: str, name: str) -> None:
        """Give a file the name of another, on the disk when this returns."""

    def remove(self, name: str) -> None:
        """Delete a file, on the disk when this returns."""

    def close(self) -> None:
        """Let go."""


def opened(root: Path) -> Directory:
    """A folder that is there; that one may be behind a link. Raises OSError."""
    return HeldDirectory.opened(root) if HOLDS else NamedDirectory.opened(root)


class HeldDirectory:
    """By its descriptor."""

    def __init__(self, descriptor: int) -> None:
        self._at = descriptor

    @classmethod
    def opened(cls, root: Path) -> Self:
        """The folder at a path. Raises OSError."""
        return cls(os.open(root, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC))

    def below(self, name: str, *, make: bool) -> Self:
        """A folder in it."""
        if make:
            with suppress(FileExistsError):
                os.mkdir(name, dir_fd=self._at)
        flags = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC | os.O_NOFOLLOW
        return type(self)(os.open(name, flags, dir_fd=self._at))

    def read(self, name: str) -> tuple[bytes, int]:
        """What a file holds."""
        flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
        with os.fdopen(os.open(name, flags, dir_fd=self._at), "rb") as file:
            return _whole(file.fileno()), _mode(file.fileno())

    def write_new(self, name: str, content: bytes, mode: int | None) -> None:
        """Write a file."""
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        file = os.open(name, flags, 0o666, dir_fd=self._at)
        try:
            with os.fdopen(file, "wb") as out:
                if mode is not None:
                    os.fchmod(file, mode)
                out.write(content)
                out.flush()
                os.fsync(file)
        except BaseException:
            os.unlink(name, dir_fd=self._at)
            raise

    def replace(self, new: str, name: str) -> None:
        """Rename a file."""
        os.replace(new, name, src_dir_fd=self._at, dst_dir_fd=self._at)
        os.fsync(self._at)  # the steps reach the disk in their order, too

    def remove(self, name: str) -> None:
        """Delete a file."""
        os.unlink(name, dir_fd=self._at)
        os.fsync(self._at)

    def close(self) -> None:
        """Let go."""
        os.close(self._at)


class NamedDirectory:
    """By its path."""

    def __init__(self, path: Path) -> None:
        self._path = path

    @classmethod
    def opened(cls, root: Path) -> Self:
        """The folder at a path. Raises OSError."""
        os.scandir(root).close()
        return cls(root)

    def below(self, name: str, *, make: bool) -> Self:
        """A folder in it."""
        path = self._path / name
        if make:
            path.mkdir(exist_ok=True)
        _refuse_link(path)
        if not path.is_dir():
            missing = errno.ENOTDIR if path.exists() else errno.ENOENT
            raise OSError(missing, os.strerror(missing))
        return type(self)(path)

    def read(self, name: str) -> tuple[bytes, int]:
        """What a file holds."""
        path = self._path / name
        _refuse_link(path)
        if path.exists() and not path.is_file():
            raise OSError(errno.EINVAL, _NO_FILE)
        with path.open("rb") as file:
            return _whole(file.fileno()), _mode(file.fileno())

    def write_new(self, name: str, content: bytes, mode: int | None) -> None:
        """Write a file."""
        path = self._path / name
        try:
            with path.open("xb") as out:
                if mode is not None:
                    path.chmod(mode)
                out.write(content)
                out.flush()
                os.fsync(out.fileno())
        except FileExistsError:
            raise
        except BaseException:
            path.unlink()
            raise

    def replace(self, new: str, name: str) -> None:
        """Rename a file."""
        _refuse_link(self._path / name)
        (self._path / new).replace(self._path / name)

    def remove(self, name: str) -> None:
        """Delete a file."""
        (self._path / name).unlink()

    def close(self) -> None:
        """Nothing is held."""


@contextmanager
def closing(directory: Directory) -> Iterator[Directory]:
    """It is let go of after the block."""
    try:
        yield directory
    finally:
        directory.close()


_NO_FILE: Final = "it is no file"


def _refuse_link(path: Path) -> None:
    if path.is_symlink() or (hasattr(path, "is_junction") and path.is_junction()):
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))


def _mode(file: int) -> int:
    return stat.S_IMODE(os.fstat(file).st_mode)


def _whole(file: int) -> bytes:
    if not stat.S_ISREG(os.fstat(file).st_mode):
        raise OSError(errno.EINVAL, _NO_FILE)
    with os.fdopen(file, "rb", closefd=False) as opened_file:
        return opened_file.read()
