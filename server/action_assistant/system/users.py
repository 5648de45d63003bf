"""Users of this computer, as far as the system has such: POSIX does, Windows in another way."""

import os

from action_assistant.system.posix import pwd


def me() -> int | None:
    """Return the id of the effective user; None on systems without user ids."""
    return os.geteuid() if hasattr(os, "geteuid") else None


def name_of(uid: int) -> str:
    """Return the name of a user for messages. Users of containers mostly have no name outside."""
    if pwd is not None:
        try:
            return str(pwd.getpwuid(uid).pw_name)
        except KeyError:
            pass
    return f"user {uid}"


def mine() -> str:
    """Return the name of this process's user, for messages."""
    uid = me()
    return name_of(uid) if uid is not None else os.environ.get("USERNAME", "this user")


def exists(name: str) -> bool:
    """Return whether this computer has a user of this name."""
    if pwd is None:
        return False
    try:
        pwd.getpwnam(name)
    except KeyError:
        return False
    return True
