"""Personal links that the command line makes without a server, as files in `people/links`."""

import time
from pathlib import Path
from typing import Final

import msgspec
from msgspec.structs import replace

from action_assistant import private_files
from action_assistant.private_files import make_folder, replace_file
from action_assistant.random_ids import random_id
from action_assistant.web.auth import people_files
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.people_files import NAME_LIMIT, PeopleFiles, PersonFile
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.roles import Role

LINKS: Final = "links"
MOST_HOURS: Final = 30 * 24.0
_LATEST: Final = 250_000_000_000.0  # seconds since 1970: before the year 10000


class OfflineLink(msgspec.Struct, frozen=True):
    """A personal link that the command line made while no server answered. `expires`: seconds
    since 1970."""

    id: str
    person: PersonFile
    expires: float


def offline_in(path: Path) -> OfflineLink:
    """Return the link that the command line has stored in a file. Raise OSError or private_files.DamagedFile."""
    found = private_files.read_json(path, OfflineLink)
    if not all(0 <= each < _LATEST for each in (found.expires, found.person.until or 0.0)):
        raise private_files.DamagedFile("it has a time that no calendar has")
    return found


def known_offline(data: Path, text: str) -> list[PersonFile]:
    """Return the persons in a data folder with this name or id who were not ended."""
    files, revoked = PeopleFiles(data), Revocations(data)
    paths = (data / people_files.FOLDER).glob("*.json")
    found = [each for path in paths if (each := files.get(path.stem)) is not None]
    return [
        each
        for each in found
        if text.casefold() in {each.name.casefold(), each.id.casefold()}
        and not revoked.person_ended(each.id)
    ]


def make_offline(data: Path, keys: Keys, name: str, role: Role | None, hours: float) -> str:
    """Make a personal link in a data folder without a server, and return its path. The person is
    the one of this name who is there, or a new one. Raise OSError if it cannot be written."""
    name = " ".join(name.split())[:NAME_LIMIT] or "Owner"
    same = known_offline(data, name)
    person = same[0] if same else PersonFile(random_id(), name, "operator")
    person = person if role is None else replace(person, role=role)
    link = OfflineLink(random_id(), person, time.time() + min(hours, MOST_HOURS) * 3600)
    folder = data / people_files.FOLDER / LINKS
    make_folder(folder)
    replace_file(folder / f"{link.id}.json", msgspec.json.encode(link))
    return f"/#i={link.id}.{keys.secret_of(link.id)}"
