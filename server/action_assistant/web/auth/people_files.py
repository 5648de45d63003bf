"""Persons who came by personal links, as files by which either process verifies them.

`people/ID.json` in the data folder holds the present name, role and groups of one person, and
`people/groups.json` the names of groups. The editor writes both after its log. They are read
without a database or the other process. A person without a file has what their cookie says, so that
a full disk signs nobody out. A person whose file cannot be read is a viewer without groups, unless this
process has read it before: the cookie may say more than the file did. What could not be written holds
in this process, which tries again.
"""

import contextlib
import re
import threading
from pathlib import Path
from typing import Final, NamedTuple

import msgspec

from action_assistant.errors import Unavailable
from action_assistant.kit.retrying_thread import RetryingThread
from action_assistant.private_files import (
    DamagedFile,
    FileState,
    log_unreadable,
    read_json,
    state_of,
    write_json,
)
from action_assistant.web.auth.roles import Role

FOLDER: Final = "people"
#: Characters of a person's name, at most.
NAME_LIMIT: Final = 60
_GROUPS: Final = "groups"
_ID: Final = re.compile(r"[A-Za-z0-9_-]{1,40}")


class PersonFile(msgspec.Struct, frozen=True, omit_defaults=True):
    """A person as the file says. `groups`: ids of groups. `until`: seconds since 1970 after which
    the person may do nothing but Stop; None for no such end."""

    id: str
    name: str
    role: Role
    groups: tuple[str, ...] = ()
    until: float | None = None


class _Read(NamedTuple):
    """A person in memory, and the state of their file as it was read."""

    state: FileState
    person: PersonFile


class PeopleFiles:
    """Reads and writes the files of persons and groups."""

    def __init__(self, data: Path) -> None:
        self._folder = data / FOLDER
        self._read: dict[str, _Read] = {}
        self._unwritten: dict[str, PersonFile] = {}
        self._writing = threading.Lock()
        self._later: Final = RetryingThread(self._write_now, "persons")

    def get(self, person: str) -> PersonFile | None:
        """Return what is known of a person; None if there was never a file. While a file cannot be read,
        the person is what it said last; one of whom this process never read is a viewer."""
        if person in self._unwritten:
            return self._unwritten[person]
        if _ID.fullmatch(person) is None or person == _GROUPS:
            return None
        path = self._path(person)
        known = self._read.get(person)
        try:
            state = state_of(path)
        except OSError:  # not there, or the disk is gone, for which nobody is put out
            return None if known is None else known.person
        if known is None or known.state != state:
            last = _unread(person) if known is None else known.person
            try:
                known = _Read(state, _person_in(path))
            except FileNotFoundError:  # it has gone meanwhile
                return None if known is None else last
            except OSError as error:
                log_unreadable(path, error)
                return last
            except DamagedFile as error:
                log_unreadable(path, error)
                known = _Read(state, last)
            self._read[person] = known
        return known.person

    def write(self, person: PersonFile) -> None:
        """Store a person durably. Raise Unavailable if that fails; it then holds in this process
        only, until a later attempt succeeds. Raise ValueError for a malformed id."""
        if _ID.fullmatch(person.id) is None or person.id == _GROUPS:
            raise ValueError(f"{person.id!r} is no id of a person")
        with self._writing:
            self._unwritten[person.id] = person
            try:
                self._replace(person.id, person)
            except Unavailable:
                self._later.start()
                raise
            del self._unwritten[person.id]

    def write_groups(self, names: dict[str, str]) -> None:
        """Store the names of all groups by id. Raise Unavailable if that fails."""
        with self._writing:
            self._replace(_GROUPS, names)

    def groups(self) -> dict[str, str]:
        """Return the names of all groups by id; an empty dict if the file of groups is missing or
        cannot be read."""
        path = self._path(_GROUPS)
        try:
            return read_json(path, dict[str, str])
        except FileNotFoundError:
            return {}
        except (OSError, DamagedFile) as error:
            log_unreadable(path, error)
            return {}

    def _write_now(self) -> bool:
        """Return whether all persons are written after another attempt."""
        with self._writing:
            for person in tuple(self._unwritten.values()):
                with contextlib.suppress(Unavailable):
                    self._replace(person.id, person)
                    del self._unwritten[person.id]
        return not self._unwritten

    def _path(self, name: str) -> Path:
        return self._folder / f"{name}.json"

    def _replace(self, name: str, content: PersonFile | dict[str, str]) -> None:
        try:
            kind = PersonFile if isinstance(content, PersonFile) else dict[str, str]
            write_json(self._path(name), content, kind)
        except OSError as error:
            raise Unavailable(
                f"It holds here and now, but could not be written to {self._folder}: "
                f"{error.strerror}."
            ) from error


def _person_in(path: Path) -> PersonFile:
    """Return the person in a file. Raise OSError or DamagedFile."""
    found = read_json(path, PersonFile)
    if found.id != path.stem:
        raise DamagedFile("it is about another person")
    return found


def _unread(person: str) -> PersonFile:
    """Return a person whose file cannot be read: they may look at what everybody may, and stop it."""
    return PersonFile(person, "", "viewer")
