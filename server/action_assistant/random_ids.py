"""Random ids of what has no name of its own: runs, groups of runs, people, sessions, actions."""

import secrets
import string
from typing import Final

_CHARACTERS: Final = string.ascii_letters + string.digits


def random_id() -> str:
    """12 letters and digits, 71 bits: safe in an address, a file name and a shell, where one that
    began with a dash would be an option, and a Stop refused for it."""
    return "".join(secrets.choice(_CHARACTERS) for _ in range(12))
