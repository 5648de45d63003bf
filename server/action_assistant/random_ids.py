"""Random ids of what has no name of its own: runs, groups of runs, people, sessions, actions."""

import secrets
import string
from typing import Final

_CHARACTERS: Final = string.ascii_letters + string.digits


def random_id() -> str:
    """Return a random id of 12 letters and digits (71 bits). It is safe in a URL, a file name and a
    shell; it never begins with a dash, which a command would read as an option."""
    return "".join(secrets.choice(_CHARACTERS) for _ in range(12))
