"""Persons who came by personal links, as files by which either process verifies them.

`people/ID.json` in the data folder holds the present name, role and groups of one person, and
`people/groups.json` the names of groups. The editor writes both after its log. They are read
without a database or the other process. A person without a file has what their cookie says, so that
a full disk signs nobody out. What could not be written holds in this process, which tries again.
"""

import contextlib
import logging
import re
import threading
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.errors import Unavailable
from action_assistant.kit.retrying_thread import RetryingThread
from action_assistant.private_files import decoded, make_folder, replace_file
from action_assistant.random_ids import random_id
from action_assistant.web.auth.roles import Role

log: Final = logging.getLogger(__name__)

FOLDER: Final = "people"
_GROUPS: Final = "groups"
_ID: Final = re.compile(r"[A-Za-z0-9_-]{1,40}")
_State = tuple[int, int, int]


class PersonFile(msgspec.Struct, frozen=True, omit_defaults=True):
    """A person as the file says. `groups`: ids of groups. `until`: seconds since 1970 after which
    the person may do nothing but Stop; None for no such end."""

    id: str
    name: str
    role: Role
    groups: tuple[str, ...] = ()
    until: float | None = None


class PeopleFiles:
    """Reads and writes the files of persons and groups."""

    def __init__(self, data: Path) -> None:
        self._folder = data / FOLDER
        self._read: dict[str, tuple[_State, PersonFile | None]] = {}
        self._unwritten: dict[str, PersonFile] = {}
        self._writing = threading.Lock()
        self._later: Final = RetryingThread(self._write_now, "persons")

    def get(self, person: str) -> PersonFile | None:
        """Return what is known of a person; None if there was never a file that could be read. While
        a file cannot be read, the person is what it said last: an old cookie may say more."""
        if person in self._unwritten:
            return self._unwritten[person]
        if _ID.fullmatch(person) is None or person == _GROUPS:
            return None
        path = self._path(person)
        known = self._read.get(person)
        try:
            found = path.stat()
            state = (found.st_mtime_ns, found.st_ino, found.st_size)
            if known is None or known[0] != state:
                known = (state, _decoded(path, person) or (known[1] if known else None))
                self._read[person] = known
        except OSError:  # not there, or the disk is gone, for which nobody is put out
            pass
        return None if known is None else known[1]

    def write(self, person: PersonFile) -> None:
        """Store a person durably. Raise Unavailable if that fails; it then holds in this process
        only, until a later attempt succeeds. Raise ValueError for a malformed id."""
        if _ID.fullmatch(person.id) is None or person.id == _GROUPS:
            raise ValueError(f"{person.id!r} is no id of a person")
        with self._writing:
            self._unwritten[person.id] = person
            try:
                self._replace(person.id, msgspec.json.encode(person))
            except Unavailable:
                self._later.start()
                raise
            del self._unwritten[person.id]

    def write_groups(self, names: dict[str, str]) -> None:
        """Store the names of all groups by id. Raise Unavailable if that fails."""
        with self._writing:
            self._replace(_GROUPS, msgspec.json.encode(names))

    def groups(self) -> dict[str, str]:
        """Return the names of all groups by id; an empty dict if the file of groups is missing or
        cannot be read."""
        try:
            return decoded(self._path(_GROUPS).read_bytes(), dict[str, str])
        except (OSError, msgspec.DecodeError):
            return {}

    def _write_now(self) -> bool:
        """Return whether all persons are written after another attempt."""
        with self._writing, contextlib.suppress(Unavailable):
            for person in tuple(self._unwritten.values()):
                self._replace(person.id, msgspec.json.encode(person))
                del self._unwritten[person.id]
        return not self._unwritten

    def _path(self, name: str) -> Path:
        return self._folder / f"{name}.json"

    def _replace(self, name: str, content: bytes) -> None:
        try:
            make_folder(self._folder)
            part = self._folder / f"{name}.{random_id()}.part"  # the other process may write, too
            replace_file(self._path(name), content, part=part)
        except OSError as error:
            raise Unavailable(
                f"It holds here and now, but could not be written to {self._folder}: "
                f"{error.strerror}."
            ) from error


def _decoded(path: Path, person: str) -> PersonFile | None:
    """Return the person in a file; None for another one or none. Raise OSError."""
    content = path.read_bytes()
    try:
        found = decoded(content, PersonFile)
    except msgspec.DecodeError as error:
        log.error("%s cannot be read: %s", path, error)
        return None
    return found if found.id == person else None
