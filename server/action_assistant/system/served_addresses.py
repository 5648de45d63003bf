"""The address of the process that serves a data folder, in that folder while the process lives.

A process holds the lock of its file until it ends, however it ends, so an address that was left
behind by `kill -9` is never taken for the one of a server that runs. The file holds no secret.
"""

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.errors import CannotStart
from action_assistant.private_files import opener
from action_assistant.system import posix

Process: TypeAlias = Literal["editor", "runner"]

_LONGEST: Final = 10_000  # bytes of such a file
_BOOT: Final = Path("/proc/sys/kernel/random/boot_id")
_NETWORK: Final = Path("/proc/self/ns/net")


class ServedAddress(msgspec.Struct, frozen=True, omit_defaults=True):
    """The address of a process. `url`: without a path. `place`: the computer, or container with a
    network of its own, in which the URL is valid. `lives`: the process still holds the file; it is
    not stored."""

    url: str
    place: str
    lives: bool = False

    @property
    def is_here(self) -> bool:
        """Return whether the URL is valid where this program runs."""
        return self.place == _place()


@contextmanager
def published(data: Path, process: Process, url: str) -> Iterator[None]:
    """Keep the address of this process in its data folder inside the block. Only the process that
    has the journal of the folder may call this. Raise OSError if the file cannot be written."""
    path = _file(data, process)
    part = path.with_name(f"{path.name}.part")
    part.unlink(missing_ok=True)
    held = opener(str(part), os.O_RDWR | os.O_CREAT | os.O_EXCL)
    try:
        posix.lock_file(held)  # before others can find it
        os.write(held, msgspec.json.encode(ServedAddress(url, _place())))
        part.replace(path)
        yield
    finally:
        if _is_same(held, path):
            path.unlink(missing_ok=True)
        os.close(held)


def served_address(data: Path, process: Process) -> ServedAddress | None:
    """Return the address that a process has kept in a data folder, of one that lives or of one that
    was killed; None if there is none. Raise CannotStart if it cannot be read."""
    path = _file(data, process)
    try:
        with path.open("rb") as file:
            found = msgspec.json.decode(file.read(_LONGEST), type=ServedAddress)
            lives = posix.fcntl is not None and not posix.lock_file(file.fileno(), shared=True)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, msgspec.DecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it has another form"
        raise CannotStart(f"The address of the server in {path} cannot be read: {why}.") from error
    return ServedAddress(found.url, found.place, lives)


def _file(data: Path, process: Process) -> Path:
    return data / f"{process}.address"


def _is_same(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except OSError:
        return False


def _place() -> str:
    """Return a text that is the same in all processes of one computer, since its last boot, with
    the same network namespace (so that 127.0.0.1 means the same to them)."""
    try:
        return f"{_BOOT.read_text().strip()}/{_NETWORK.stat().st_ino}"
    except OSError:  # macOS
        return socket.gethostname()
