"""The model of rights that the matrix compares both processes with. It shares no code and no table with
the product: the roles, scopes and rules stand here as people were promised them.
"""

import re
from pathlib import Path
from typing import Final, Literal, NamedTuple, get_args

Role = Literal["viewer", "editor", "operator", "owner"]
Permission = Literal[
    *("see", "stop", "scrape", "edit", "simulate", "operate", "register", "share", "restore"),
]
#: Each kind of revocation, and two changes that take nothing away (`role_raised`, `groups_same`).
Kind = Literal[
    *("session_ended", "device_ended", "person_ended", "link_revoked", "token_revoked", "last_day"),
    *("role_lowered", "role_raised", "group_left", "group_ended", "groups_same"),
    *(
        "robot_locked",
        "right_removed",
        "right_ended",
        "rule_narrowed",
        "rule_to_read",
        "graph_moved",
    ),
]

RANKS: Final[tuple[Role, ...]] = get_args(Role)
#: The permission of each route, by its process, method and path: the rows of `rights_of_routes.txt`.
NEEDED: Final[dict[str, str]] = {}
for _line in Path(__file__).with_name("rights_of_routes.txt").read_text("utf-8").splitlines():
    if _line.startswith("["):
        _process, _needed = _line.strip("[]").split()
    elif _line and not _line.startswith("#"):
        NEEDED[f"{_process} {' '.join(_line.split())}"] = _needed
#: The least role for a permission, and the scopes of programs that include it.
LEAST: Final[dict[Permission, tuple[Role, str]]] = {
    "see": ("viewer", "read edit simulate operate"),
    "stop": ("viewer", "read edit simulate operate"),
    "scrape": ("viewer", "scrape read"),
    "edit": ("editor", "edit"),
    "simulate": ("editor", "simulate operate"),
    "operate": ("operator", "operate"),
    "register": ("operator", ""),
    "share": ("owner", ""),
    "restore": ("owner", ""),
}
#: Routes for people alone, whatever the scopes of a program.
PERSON_ONLY: Final = re.compile(
    r"(get|post) /api/tokens$|/api/logins/(look|confirm|refuse)|/api/devices|post /api/approvals"
    r"|post /api/robots/.*/drills|/api/runs/[^/]+/(at_rest|go_on|step|outcome|breakpoints|questions/)"
    r"|/api/tokens/.*/revoke$|/api/repeats/[^/]+/(start|open)$"
    r"|/api/queue/[^/]+/start$|/api/queue/robots/[^/]+/open$"
    r"|/api/confirmations|/api/passkeys|/api/mentions"
)
#: What a robot was sent, of which nobody knows whose graph it is: for those who may see every graph.
OF_UNKNOWN_GRAPHS: Final = re.compile(
    r"get /api/robots/\{name\}/(events/\{seq\}/umrf|recordings/\{file\})$"
)
#: What is inside a graph: for those who may see all of that.
OF_INSIDES: Final = re.compile(
    r"\{graph_id\}/(subgraphs(\.zip)?|flat)$|/\{version_id\}(/sight|/breakpoints)?$"
)
#: Graphs: without a rule; which the group may read, or edit; for owners; in a folder of the group; a draft
#: of what the group may edit; without a rule, around a graph for owners.
GRAPHS: Final = ("open", "read", "edited", "hidden", "filed", "draft", "around")
#: Robots: with a list that names the group, without one, and for a group in which nobody is.
ROBOTS: Final = ("Rover", "Free", "Closed")
HIDDEN_RUN: Final = "a run of a graph that you may not see"


class Client(NamedTuple):
    """A person's browser or program: `headers` let it in; `scopes` of a program, None for a browser."""

    headers: dict[str, str]
    person: str
    session: str
    role: Role
    scopes: frozenset[str] | None
    in_group: bool


class State(NamedTuple):
    """The facts about a client, and about things, after a revocation, or before."""

    role: Role
    in_group: bool
    is_ended: bool = False
    is_expired: bool = False
    is_locked: bool = False
    is_removed: bool = False  # the group from Rover's list
    rule: Literal["", "narrowed", "to_read", "moved"] = ""


def has(client: Client, state: State, needed: Permission) -> bool:
    """Return whether role and scopes include a permission."""
    least, scopes = LEAST[needed]
    has_scope = client.scopes is None or not client.scopes.isdisjoint(scopes.split())
    return has_scope and RANKS.index(state.role) >= RANKS.index(least)


def refusal(client: Client, state: State, needed: Permission | None, route: str = "") -> int | None:
    """Return the status with which a request is refused; None where it must not be."""
    if state.is_ended or (state.is_expired and needed != "stop"):
        return 401
    if client.scopes is not None and PERSON_ONLY.search(route):
        return 403
    if OF_UNKNOWN_GRAPHS.search(route) and state.role != "owner":
        return 403
    return None if needed is None or has(client, state, needed) else 403


def sees(state: State, graph: str, *, edits: bool = False, run: bool = False) -> bool:
    """Return whether the rule of a graph lets a client see it, or edit it, or see a `run` of it."""
    if state.role == "owner":
        return True
    if graph == "around":
        return not run
    if graph in {"open", "hidden"}:
        return graph == "open"
    if state.rule == "narrowed" or (state.rule == "moved" and graph == "filed"):
        return False
    return state.in_group and not (edits and (graph == "read" or state.rule == "to_read"))


def may_start(client: Client, state: State, robot: str) -> bool:
    """Return whether the rights of a robot let a client start there."""
    named = state.in_group and not state.is_removed and not state.is_locked
    return has(client, state, "operate") and {"Rover": named, "Free": True, "Closed": False}[robot]


def after(kind: Kind, state: State) -> State:
    """Return the facts after a revocation."""
    match kind:
        case "session_ended" | "device_ended" | "person_ended" | "link_revoked" | "token_revoked":
            return state._replace(is_ended=True)
        case "last_day":
            return state._replace(is_expired=True)
        case "role_lowered":
            return state._replace(role="viewer")
        case "role_raised":
            return state._replace(role="owner")
        case "group_left" | "group_ended":
            return state._replace(in_group=False)
        case "robot_locked":
            return state._replace(is_locked=True)
        case "right_removed" | "right_ended":
            return state._replace(is_removed=True)
        case "rule_narrowed":
            return state._replace(rule="narrowed")
        case "rule_to_read":
            return state._replace(rule="to_read")
        case "graph_moved":
            return state._replace(rule="moved")
        case "groups_same":
            return state
