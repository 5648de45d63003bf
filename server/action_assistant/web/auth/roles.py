"""The permissions of each role: the one table that both processes and the page follow."""

from collections.abc import Mapping
from typing import Final, Literal, TypeAlias, get_args

#: The roles in order of rights; each may do all that the roles before it may.
Role: TypeAlias = Literal["viewer", "editor", "operator", "owner"]

#: Kinds of things to do. `see` and `stop` are everybody's who is signed in.
Permission: TypeAlias = Literal[
    "see",  # graphs, runs, robots, and who is there
    "stop",  # any run
    "edit",  # graphs: make, change, delete, go back to an earlier change, publish a version
    "simulate",  # start, pause, resume and modify a run in the simulator
    "operate",  # the same on a robot
    "register",  # robots
    "share",  # invite and revoke
    "restore",  # a backup
    "scrape",  # the metrics of a process
]

#: Whoever holds the token of the server is an owner.
OWNER: Final[Role] = "owner"

_FROM: Final[Mapping[Permission, Role]] = {
    "see": "viewer",
    "stop": "viewer",
    "edit": "editor",
    "simulate": "editor",
    "operate": "operator",
    "register": "operator",
    "share": "owner",
    "restore": "owner",
    "scrape": "viewer",
}
_RANK: Final[Mapping[Role, int]] = {role: rank for rank, role in enumerate(get_args(Role))}
_MAY: Final[Mapping[Role, str]] = {
    "viewer": "look at everything and stop runs",
    "editor": "edit graphs, run them in the simulator, and stop runs",
    "operator": "edit graphs, run them on robots, and stop runs",
    "owner": "do everything",
}


def allowed(role: Role, permission: Permission) -> bool:
    """Return whether a role has a permission."""
    return rank(role) >= rank(_FROM[permission])


def rank(role: Role) -> int:
    """Return the rank of a role, for comparisons."""
    return _RANK[role]


def role_words(role: Role) -> str:
    """Return what a role may do, in words that follow "you may"."""
    return _MAY[role]
