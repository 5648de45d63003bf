"""A folder that is held open while files in it are read and replaced; no link is followed.

POSIX systems hold the folder itself, whatever becomes of its path. Elsewhere there are only paths: a
link is refused when it is seen, and somebody who puts one there at that moment is not noticed.
"""

import errno
import os
import stat
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, Final, NamedTuple, Protocol, Self

#: Larger files are not read: no server accepts them, and they could fill the memory.
_LARGEST: Final = 256 << 20

#: True if the system can name files relative to an open folder.
HOLDS: Final = os.open in os.supports_dir_fd and hasattr(os, "O_DIRECTORY")


class Owner(NamedTuple):
    """The user and the group that a file belongs to."""

    user: int
    group: int


class Directory(Protocol):
    """One open folder. All methods that take a `name` raise OSError if it is not exactly one
    component of a path."""

    def names(self) -> list[str]:
        """Return the names of all entries of the folder."""

    def status(self, name: str) -> os.stat_result:
        """Return the status of the entry `name`; of a link the status of the link itself."""

    def below(self, name: str, *, make: bool) -> "Directory":
        """Open the folder `name` inside this one and return it; with `make` create it if it is
        missing. The caller closes it."""

    def read(self, name: str) -> tuple[bytes, int]:
        """Return the content and the mode (permissions) of the file `name`."""

    def write_new(
        self, name: str, content: bytes, mode: int | None, owner: Owner | None = None
    ) -> None:
        """Write a new file durably, all of it or nothing. `mode`: its permissions, None for the
        default; `owner`: None for this user. If this user may not give it to `owner`, the rights of
        the group are removed instead."""

    def complete(
        self, name: str, content: bytes, mode: int | None, owner: Owner | None = None
    ) -> None:
        """Append to the file `name`, which has the beginning of this content, the part that it
        lacks, durably; set mode and owner as `write_new` does."""

    def link(self, old: str, new: str) -> None:
        """Give the file `old` a second name, `new`, which must be unused; durably."""

    def replace(self, new: str, name: str) -> None:
        """Rename the file `new` to `name`, replacing an existing file, durably."""

    def remove(self, name: str) -> None:
        """Delete the file `name` durably."""

    def close(self) -> None:
        """Release the directory and its descriptor, if it holds one."""


def opened(root: Path) -> Directory:
    """Open the existing folder `root`, and return it. Its own path may lead through a symbolic
    link. Raise OSError if it cannot be opened."""
    return HeldDirectory.opened(root) if HOLDS else NamedDirectory.opened(root)


class HeldDirectory:
    """A directory that is held open by its descriptor, so that no link can redirect it."""

    def __init__(self, descriptor: int) -> None:
        self._at = descriptor

    @classmethod
    def opened(cls, root: Path) -> Self:
        """Open the folder at the path `root`, and return it. Raise OSError if it cannot be opened."""
        return cls(os.open(root, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC))

    def names(self) -> list[str]:
        with os.scandir(self._at) as entries:
            return [each.name for each in entries]

    def status(self, name: str) -> os.stat_result:
        """Return the status of an entry, not following a link."""
        return os.stat(_component(name), dir_fd=self._at, follow_symlinks=False)

    def below(self, name: str, *, make: bool) -> Self:
        """Open the subdirectory `name` and return it; with `make` create it if it is missing. Raise
        OSError for a link."""
        _component(name)
        if make:
            with suppress(FileExistsError):
                os.mkdir(name, dir_fd=self._at)
        flags = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC | os.O_NOFOLLOW
        return type(self)(os.open(name, flags, dir_fd=self._at))

    def read(self, name: str) -> tuple[bytes, int]:
        """Return the content and the mode of a regular file. Raise OSError for any other entry."""
        flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
        _refuse_special(self.status(name))  # opening a device may have effects
        with os.fdopen(os.open(name, flags, dir_fd=self._at), "rb") as file:
            return _whole(file.fileno()), _mode(file.fileno())

    def write_new(
        self, name: str, content: bytes, mode: int | None, owner: Owner | None = None
    ) -> None:
        """Write a new file as `Directory.write_new` says, and flush it to disk. Raise
        FileExistsError if the name is taken."""
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        at_first = 0o666 if mode is None else 0o600
        file = os.open(_component(name), flags, at_first, dir_fd=self._at)
        try:
            with os.fdopen(file, "wb") as out:
                if mode is not None:
                    os.fchmod(file, mode if _given(file, owner) else mode & ~stat.S_IRWXG)
                out.write(content)
                out.flush()
                os.fsync(file)
            os.fsync(self._at)
        except BaseException:
            os.unlink(name, dir_fd=self._at)
            raise

    def complete(
        self, name: str, content: bytes, mode: int | None, owner: Owner | None = None
    ) -> None:
        flags = os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
        _refuse_special(self.status(name))
        file = os.open(name, flags, dir_fd=self._at)
        with os.fdopen(file, "r+b") as half:
            _write_rest(half, content)
            if mode is not None:
                os.fchmod(file, mode if _given(file, owner) else mode & ~stat.S_IRWXG)

    def link(self, old: str, new: str) -> None:
        """Give the file `old` a second name, `new`."""
        names = _component(old), _component(new)
        os.link(*names, src_dir_fd=self._at, dst_dir_fd=self._at, follow_symlinks=False)
        os.fsync(self._at)

    def replace(self, new: str, name: str) -> None:
        """Rename `new` to `name`, replacing an existing file."""
        names = _component(new), _component(name)
        os.replace(*names, src_dir_fd=self._at, dst_dir_fd=self._at)
        os.fsync(self._at)  # the steps reach the disk in their order, too

    def remove(self, name: str) -> None:
        """Delete the file `name` from this directory."""
        os.unlink(_component(name), dir_fd=self._at)
        os.fsync(self._at)

    def close(self) -> None:
        """Close the descriptor of this directory."""
        os.close(self._at)


class NamedDirectory:
    """A directory that is named by its path, where descriptors of directories do not exist."""

    def __init__(self, path: Path) -> None:
        self._path = path

    @classmethod
    def opened(cls, root: Path) -> Self:
        """Return the folder at the path `root`. Raise OSError if it cannot be listed."""
        os.scandir(root).close()
        return cls(root)

    def names(self) -> list[str]:
        return [path.name for path in self._path.iterdir()]

    def status(self, name: str) -> os.stat_result:
        """Return the status of an entry, not following a link."""
        return (self._path / _component(name)).lstat()

    def below(self, name: str, *, make: bool) -> Self:
        """Open the subdirectory `name` and return it; with `make` create it if it is missing. Raise
        OSError for a link."""
        path = self._path / _component(name)
        if make:
            path.mkdir(exist_ok=True)
        _refuse_link(path)
        if not path.is_dir():
            missing = errno.ENOTDIR if path.exists() else errno.ENOENT
            raise OSError(missing, os.strerror(missing))
        return type(self)(path)

    def read(self, name: str) -> tuple[bytes, int]:
        """Return the content and the mode of a regular file. Raise OSError for any other entry."""
        path = self._path / _component(name)
        _refuse_link(path)
        if path.exists() and not path.is_file():
            raise OSError(errno.EINVAL, _NO_FILE)
        with path.open("rb") as file:
            return _whole(file.fileno()), _mode(file.fileno())

    def write_new(
        self, name: str, content: bytes, mode: int | None, owner: Owner | None = None
    ) -> None:
        """Write a new file as `Directory.write_new` says. `owner` is ignored, since this system has
        no such owners."""
        path = self._path / _component(name)
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

    def complete(
        self, name: str, content: bytes, mode: int | None, owner: Owner | None = None
    ) -> None:
        path = self._path / _component(name)
        _refuse_link(path)
        with path.open("r+b") as half:
            _write_rest(half, content)

    def link(self, old: str, new: str) -> None:
        """Give the file `old` a second name, `new`."""
        os.link(self._path / _component(old), self._path / _component(new))

    def replace(self, new: str, name: str) -> None:
        """Rename `new` to `name`, replacing an existing file."""
        _refuse_link(self._path / _component(name))
        (self._path / _component(new)).replace(self._path / name)

    def remove(self, name: str) -> None:
        """Delete the file `name` from this directory."""
        (self._path / _component(name)).unlink()

    def close(self) -> None:
        """Do nothing: this kind has no open descriptor."""


_NO_FILE: Final = "it is no file"


def _refuse_link(path: Path) -> None:
    if path.is_symlink() or (hasattr(path, "is_junction") and path.is_junction()):
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))


def why(error: OSError) -> str:
    """Return the reason of an error in words. With `O_NOFOLLOW`, a link gives the errors of too
    many links or of a path through no folder."""
    match error.errno:
        case errno.ELOOP:
            return "it is a link, which is not followed"
        case errno.ENOTDIR:
            return "what should be a folder above it is a file or a link"
        case _:
            return error.strerror or str(error)


def is_component(name: str) -> bool:
    """Return whether a name is exactly one component of a path, on this system."""
    separators = {"/", "\0", os.sep} | ({"\\", ":"} if os.name == "nt" else set())
    return name not in {"", ".", ".."} and separators.isdisjoint(name)


def _component(name: str) -> str:
    if not is_component(name):
        raise OSError(errno.EINVAL, "the name leads out of the folder")
    return name


def _given(file: int, owner: Owner | None) -> bool:
    """Make `owner` the owner of an open file (a descriptor); return False if this user may not do
    so."""
    found = os.fstat(file)
    if owner is None or owner == (found.st_uid, found.st_gid):
        return True
    try:
        os.fchown(file, *owner)
    except OSError:
        return False
    return True


def _write_rest(half: BinaryIO, content: bytes) -> None:
    """Append to the open file `half` the part of `content` that it lacks, and flush it. Raise
    OSError if the file has anything but the beginning of `content` or cannot be written."""
    _refuse_special(os.fstat(half.fileno()))
    there = half.read(len(content) + 1)
    if not content.startswith(there):
        raise OSError(errno.EBUSY, "somebody else has written into it")
    half.write(content[len(there) :])
    half.flush()
    os.fsync(half.fileno())


def _refuse_special(found: os.stat_result) -> None:
    if not stat.S_ISREG(found.st_mode):
        number = errno.ELOOP if stat.S_ISLNK(found.st_mode) else errno.EINVAL
        raise OSError(number, _NO_FILE)


def _mode(file: int) -> int:
    return stat.S_IMODE(os.fstat(file).st_mode)


def _whole(file: int) -> bytes:
    found = os.fstat(file)
    _refuse_special(found)
    if found.st_size > _LARGEST:
        raise OSError(errno.EFBIG, f"it is larger than {_LARGEST >> 20} MB")
    with os.fdopen(file, "rb", closefd=False) as opened_file:
        return opened_file.read()
