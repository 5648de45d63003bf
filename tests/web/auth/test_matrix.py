"""The matrix of rights at real processes: each role and scope at each route and socket of both OpenAPI
documents, before and after each kind of revocation, and a robot's own rights. One model says each cell.

`TEST_MATRIX=1` asks every route in each cell (`make soak ARGS=matrix`); otherwise some, another
choice each day.
"""

import contextlib
import os
import random
import re
import time
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import Any, Final, Literal, NamedTuple, get_args

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from action_assistant.web.auth.identity import Scope
from action_assistant.web.auth.rights import SCOPES_FOR
from action_assistant.web.auth.roles import Permission, Role, allowed
from action_assistant.web.auth.tokens import completed
from support.product import Product
from web.auth.test_ending import sharing
from web.auth.test_roles import PROCESSES, url_of

EVERY: Final = "TEST_MATRIX" in os.environ
ROLES: Final[tuple[Role, ...]] = get_args(Role) if EVERY else ("viewer", "operator", "owner")
ROUTES: Final = None if EVERY else 6  # of each process, in each cell
#: Each kind of revocation; `robot_locked` and `group_left` concern one robot alone.
Kind = Literal[
    *("session_ended", "person_ended", "link_revoked", "token_revoked", "last_day"),
    *("role_lowered", "role_raised", "group_left", "robot_locked", "groups_same"),
]
#: Routes for people alone, whatever the scopes of a program.
PERSON_ONLY: Final = re.compile(
    r"(get|post) /api/tokens$|/api/logins/(look|confirm|refuse)|/api/devices|post /api/approvals"
    r"|post /api/robots/.*/drills|/api/runs/[^/]+/(at_rest|go_on|step|outcome|breakpoints)|/api/tokens/.*/revoke$"
    r"|/api/confirmations|/api/passkeys|/api/mentions|/api/approvals/asked"
)
#: Scopes that no token gets, and the one that is asked anyway.
RESERVED: Final = {"hooks", "operate"}
#: Routes for links that show one thing; tests/web/auth/test_view_links.py asks them.
OF_LINKS: Final = "/api/view/"


class Client(NamedTuple):
    """A person's browser or program: `headers` let it in; `scopes` of a program, None for a browser."""

    headers: dict[str, str]
    person: str
    session: str
    role: Role
    scopes: frozenset[Scope] | None
    in_group: bool


class State(NamedTuple):
    """The facts about a client after its revocation, or before."""

    role: Role
    in_group: bool
    is_ended: bool = False
    is_expired: bool = False
    is_locked: bool = False


def refusal(client: Client, state: State, needed: Permission | None, route: str = "") -> int | None:
    """Return the status with which a request is refused; None where it must not be."""
    if state.is_ended or (state.is_expired and needed != "stop"):
        return 401
    if client.scopes is not None and PERSON_ONLY.search(route):
        return 403
    if needed is None:
        return None
    has_scope = client.scopes is None or bool(client.scopes & SCOPES_FOR[needed])
    return None if allowed(state.role, needed) and has_scope else 403


def may_start(client: Client, state: State) -> bool | None:
    """Return whether the rights of the robot let a client start there; None for one who is refused."""
    if state.is_ended or state.is_expired:
        return None
    has_scope = client.scopes is None or "operate" in client.scopes
    return has_scope and allowed(state.role, "operate") and state.in_group and not state.is_locked


def after(kind: Kind, state: State) -> State:
    """Return what is true after a revocation."""
    match kind:
        case "session_ended" | "person_ended" | "link_revoked" | "token_revoked":
            return state._replace(is_ended=True)
        case "last_day":
            return state._replace(is_expired=True)
        case "role_lowered":
            return state._replace(role="viewer")
        case "role_raised":
            return state._replace(role="owner")
        case "group_left":
            return state._replace(in_group=False)
        case "robot_locked":
            return state._replace(is_locked=True)
        case "groups_same":
            return state


class Lab:
    """A server with a robot for one group, and the clients that come to it."""

    def __init__(self, product: Product) -> None:
        self.product = product
        self.owner = product.editor()
        self.robots = product.runner()
        self.group = self._made("/api/groups", {"name": "night"})["id"]
        self.graph = self._made("/api/graphs", {"name": "task"})["id"]
        self.robots.post("/api/robots", json={"name": "Rover"}).raise_for_status()
        rights = {"operators": [{"id": self.group, "name": "night"}], "baton": False}
        self.robots.put("/api/robots/Rover/rights", json=rights).raise_for_status()
        self.routes = {process: list(self._declared(process)) for process in PROCESSES}
        self.random = random.Random(0 if EVERY else datetime.now(UTC).date().toordinal())
        self.number = 0

    def _made(self, path: str, body: dict[str, Any]) -> Any:
        answer = self.owner.post(path, json=body)
        assert answer.is_success, answer.text
        return answer.json()

    def _declared(self, process: str) -> Iterator[tuple[str, str, Permission | None]]:
        """Yield method, path and permission of each route that does not answer strangers."""
        client = self.owner if process == "editor" else self.robots
        for path, item in client.get("/schema/openapi.json").json()["paths"].items():
            for method, operation in item.items():
                if operation.get("security") != [] and not path.startswith(OF_LINKS):
                    yield method, path, operation.get("x-needs")

    def came(self, kind: Kind, role: Role, scopes: frozenset[Scope] | None) -> Client:
        """Return a new person in the group, or one by a group link, who is in no group."""
        self.number += 1
        name = f"Person {self.number}"
        if kind == "link_revoked":
            link = self._made("/api/invitations", {"role": role, "label": name})
        else:
            body = {"name": name, "role": role, "groups": [self.group]}
            link = self._made("/api/members", body)["links"][0]
        proof = link["path"].removeprefix("/#i=")
        origin = {"origin": self.product.url}
        answer = httpx.post(
            f"{self.product.url}/api/session",
            json={"invitation": proof, "name": name}
            if kind == "link_revoked"
            else {"invitation": proof},
            headers=origin,
            trust_env=False,
        )
        assert answer.is_success, answer.text
        headers = origin | {"cookie": answer.headers["set-cookie"].partition(";")[0]}
        person = answer.json()["person"]["id"]
        devices = self._as(headers, "get", "/api/devices").json()
        session = link["id"] if kind == "link_revoked" else devices["this"]
        in_group = kind != "link_revoked"
        if scopes is not None:
            wanted = {"name": "program", "scopes": sorted(scopes)}
            made = self._as(headers, "post", "/api/tokens", json=wanted)
            assert made.is_success, made.text
            headers = {"authorization": f"Bearer {made.json()['token']}"}
            if kind == "token_revoked":
                session = made.json()["record"]["id"]
        return Client(headers, person, session, role, scopes, in_group)

    def _as(self, headers: dict[str, str], method: str, path: str, **more: Any) -> httpx.Response:
        return httpx.request(
            method, self.product.url + path, headers=headers, trust_env=False, timeout=20, **more
        )

    def revoke(self, kind: Kind, client: Client) -> None:
        """Carry out a revocation by the owner."""
        change: dict[str, Any] | None = None
        path = f"/api/members/{client.person}"
        match kind:
            case "session_ended":
                self.owner.post(f"/api/sessions/{client.session}/end").raise_for_status()
            case "person_ended":
                self.owner.post(f"{path}/end").raise_for_status()
            case "link_revoked":
                self.owner.post(f"/api/invitations/{client.session}/revoke").raise_for_status()
            case "token_revoked":
                self.owner.post(f"/api/tokens/{client.session}/revoke").raise_for_status()
            case "last_day":
                change = {"until": (datetime.now(UTC) - timedelta(seconds=1)).isoformat()}
            case "role_lowered":
                change = {"role": "viewer"}
            case "role_raised":
                change = {"role": "owner"}
            case "group_left":
                change = {"groups": []}
            case "groups_same":
                change = {"groups": [self.group]}
            case "robot_locked":
                body = {"reason": "repair"}
                self.robots.post("/api/robots/Rover/lock", json=body).raise_for_status()
        if change is not None:
            self.owner.patch(path, json=change).raise_for_status()

    def wrong_cells(self, client: Client, state: State) -> tuple[int, list[Any]]:
        """Ask in the name of a client; return how many cells were looked at, and those that are not
        as the model says."""
        cells, wrong = 0, []
        for process in PROCESSES:
            url = url_of(self.product, process)
            routes = self.routes[process]
            chosen = routes if ROUTES is None else self.random.sample(routes, ROUTES)
            with httpx.Client(
                base_url=url, headers=client.headers, trust_env=False, timeout=20
            ) as http:
                for method, path, needed in chosen:
                    status = _status(http, method, path)
                    wanted = refusal(client, state, needed, f"{method} {path}")
                    cells += 1
                    if status != wanted if wanted else status in {401, 403}:
                        wrong.append((method, path, needed, wanted, status))
                if process == "runner":
                    cells += 1
                    meant = may_start(client, state)
                    sees = client.scopes is None or bool(client.scopes & SCOPES_FOR["see"])
                    if (found := _may_start(http)) != (meant if sees else None):
                        wrong.append(("start on Rover", meant, found))
        for socket in self._sockets():
            wanted = refusal(client, state, "see") or 101
            cells += 1
            if (status := _upgraded(socket, client.headers)) != wanted:
                wrong.append((socket, wanted, status))
        return cells, wrong

    def _sockets(self) -> tuple[str, str]:
        return (
            f"{self.product.url}/api/graphs/{self.graph}/room",
            f"{self.product.runner_url}/api/live",
        )

    def opened(self, client: Client, stack: contextlib.ExitStack) -> list[ClientConnection]:
        """Open both sockets, until the end of the stack."""
        return [stack.enter_context(_socket(url, client.headers)) for url in self._sockets()]


def _status(http: httpx.Client, method: str, path: str) -> int:
    url = re.sub(r"\{[^}]*\}", "nothing", path.replace("{seq}", "1"))
    content = b"" if method in {"get", "delete"} else b"[]"
    with http.stream(method, url, content=content) as answer:
        if "event-stream" not in answer.headers.get("content-type", ""):
            answer.read()
        return answer.status_code


def _may_start(http: httpx.Client) -> bool | None:
    answer = http.get("/api/rights")
    if not answer.is_success:
        return None
    (right,) = answer.json()["robots"]
    return bool(right["why"] == "")


def _socket(url: str, headers: dict[str, str]) -> Any:
    own = {name: value for name, value in headers.items() if name != "origin"}
    return connect(
        url.replace("http", "ws", 1),
        additional_headers=own,
        origin=headers.get("origin"),
        proxy=None,
        open_timeout=10,
    )


def _upgraded(url: str, headers: dict[str, str]) -> int:
    try:
        with _socket(url, headers):
            return 101
    except InvalidStatus as refused:
        return refused.response.status_code


def _is_closed(socket: ClientConnection, seconds: float) -> bool:
    deadline = time.monotonic() + seconds
    try:
        while time.monotonic() < deadline:
            try:
                socket.recv(timeout=0.05)
            except TimeoutError:
                continue
    except ConnectionClosed:
        return True
    return False


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    """A server of its own, with a robot."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("ACTION_ASSISTANT_LIMITS", "off")
        with sharing(tmp_path_factory.mktemp("matrix") / "data") as product:
            found = Lab(product)
            with contextlib.closing(found.owner), contextlib.closing(found.robots):
                yield found


@pytest.mark.timeout(0 if EVERY else 120)
@pytest.mark.parametrize("kind", get_args(Kind))
def test_every_cell_is_as_the_model_says_before_and_after_each_revocation(
    lab: Lab, kind: Kind
) -> None:
    cells, wrong = 0, []
    programs: list[frozenset[Scope] | None] = [None, completed(["operate"])]
    if EVERY:
        programs += [completed([each]) for each in get_args(Scope) if each not in RESERVED]
    for role in ROLES:
        for scopes in programs:
            if (kind == "token_revoked") != (scopes is not None) and kind in {
                *("token_revoked", "session_ended"),
            }:
                continue  # a token does not end with a browser's session, nor the other way
            if scopes is not None and not allowed(role, "operate"):
                continue  # who may not operate gives no such token
            if kind == "link_revoked" and role == "owner":
                continue  # no group link makes owners
            client = lab.came(kind, role, scopes)
            state = State(role, client.in_group)
            stack = contextlib.ExitStack()
            sockets = lab.opened(client, stack) if scopes is None else []
            found, bad = lab.wrong_cells(client, state)
            lab.revoke(kind, client)
            now = after(kind, state)
            if kind == "role_raised" and scopes is not None:
                now = state  # a token has at most the role that it was made with
            closes = now.is_ended or (now.role, now.in_group) != (state.role, state.in_group)
            for socket in sockets:
                is_live = socket.request is not None and socket.request.path == "/api/live"
                gone = closes or (now.is_expired and not is_live)
                cells += 1
                if _is_closed(socket, 5.0 if gone else 1.2) != gone:
                    wrong.append((kind, role, "open socket", is_live, gone))
            stack.close()
            later, worse = lab.wrong_cells(client, now)
            cells += found + later
            wrong += [(kind, role, scopes, "before", each) for each in bad]
            wrong += [(kind, role, scopes, "after", each) for each in worse]
            if kind == "robot_locked":
                lab.robots.post("/api/robots/Rover/unlock", json={}).raise_for_status()
    assert cells > 100
    print(f"{kind}: {cells} cells, {len(wrong)} wrong")  # noqa: T201 - the figure that is asked for
    assert wrong[:10] == []
