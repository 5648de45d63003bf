"""The time after which sessions expire, by role: unused (idle), and in any case (longest)."""

import re
from collections.abc import Mapping
from typing import Final, NamedTuple, get_args

from action_assistant.errors import CannotStart
from action_assistant.web.auth.roles import Role

_DAY: Final = 24 * 3600.0
_UNITS: Final[Mapping[str, float]] = {"m": 60.0, "h": 3600.0, "d": _DAY}
_RULE: Final = re.compile(r"(\w+)=(\d{1,4})([mhd])/(\d{1,4})([mhd])")


class Limit(NamedTuple):
    """The limits of a session, in seconds. `idle`: since its last use; `longest`: since sign-in."""

    idle: float
    longest: float


#: Whoever may do more is asked sooner to come in by a link again.
DEFAULTS: Final[Mapping[Role, Limit]] = {
    "viewer": Limit(30 * _DAY, 30 * _DAY),
    "editor": Limit(30 * _DAY, 30 * _DAY),
    "operator": Limit(14 * _DAY, 30 * _DAY),
    "owner": Limit(7 * _DAY, 30 * _DAY),
}


def limits_of(text: str) -> Mapping[Role, Limit]:
    """Return the limits of all roles from a text such as `owner=12h/7d,operator=3d/30d`; roles that
    it does not name keep their defaults. Raise CannotStart if it is malformed."""
    limits = dict(DEFAULTS)
    for each in filter(None, (part.strip() for part in text.split(","))):
        found = _RULE.fullmatch(each)
        role = None if found is None else found[1]
        known = [each for each in get_args(Role) if each == role]
        if found is None or not known:
            raise CannotStart(
                "ACTION_ASSISTANT_SESSIONS is a list of ROLE=IDLE/LONGEST, such as "
                f"`owner=12h/7d`, not {each!r}."
            )
        idle, longest = int(found[2]) * _UNITS[found[3]], int(found[4]) * _UNITS[found[5]]
        if not 0 < idle <= longest:
            raise CannotStart(
                f"ACTION_ASSISTANT_SESSIONS: {each!r} expires unused later than in any case."
            )
        limits[known[0]] = Limit(idle, longest)
    return limits
