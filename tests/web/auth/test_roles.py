"""Each role calls every route of both processes, and only permitted calls succeed."""

import contextlib
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import httpx
import pytest
from pycrdt import Doc, Map
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from action_assistant.editor.crdt import messages
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.roles import Permission, Role, allowed, role_words
from action_assistant.web.network.connection_limits import OF_A_PERSON, OF_AN_ADDRESS
from support.product import TOKEN, Product, running

KEYS = Keys(TOKEN)
ROLES: tuple[Role, ...] = get_args(Role)
PROCESSES = ("editor", "runner")
#: The least role for each permission: an editor at least for changes, an operator for robots.
LEAST: dict[Permission, Role] = {
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


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A running editor and runner."""
    with running(tmp_path_factory.mktemp("roles") / "data") as product:
        yield product


@pytest.fixture(scope="module")
def graph(product: Product) -> str:
    """The id of a graph."""
    with product.editor() as editor:
        made: str = editor.post("/api/graphs", json={"name": "task"}).json()["id"]
        return made


def browser(product: Product, role: Role) -> dict[str, str]:
    """The headers of a browser that is signed in."""
    session = KEYS.new_session(role.title(), role=role)
    return {"cookie": f"aa_{product.port}={KEYS.sealed(session)}", "origin": product.url}


def url_of(product: Product, process: str) -> str:
    """Return the URL of a process."""
    return product.url if process == "editor" else product.runner_url


def operations(product: Product, process: str) -> list[tuple[str, str, Permission | None]]:
    """Method, path and permission of everything that a process describes."""
    headers = {"authorization": f"Bearer {TOKEN}"}
    schema = httpx.get(
        f"{url_of(product, process)}/schema/openapi.json", headers=headers, trust_env=False
    ).json()
    return [
        (method, path, operation.get("x-needs"))
        for path, item in schema["paths"].items()
        for method, operation in item.items()
    ]


def test_the_table_is_cumulative_and_says_what_was_agreed() -> None:
    assert set(LEAST) == set(get_args(Permission))
    for permission, least in LEAST.items():
        may = [role for role in ROLES if allowed(role, permission)]
        assert may == list(ROLES[ROLES.index(least) :])


def test_the_page_has_the_same_table() -> None:
    text = (Path(__file__).parents[3] / "frontend/src/api/session.ts").read_text()
    assert re.search(r"ROLES = \[([^\]]*)\]", text)[1] == ", ".join(f'"{role}"' for role in ROLES)  # type: ignore[index]
    table = text[text.index("FROM = {") : text.index("} as const satisfies")]
    assert dict(re.findall(r'(\w+): "(\w+)"', table)) == LEAST
    words = text[text.index("export const ROLE_WORDS") :]
    assert dict(re.findall(r'(\w+): "([^"]+)"', words)) == {
        role: role_words(role) for role in ROLES
    }


@pytest.mark.parametrize("process", PROCESSES)
def test_every_route_says_who_may_call_it_and_means_it(product: Product, process: str) -> None:
    found = operations(product, process)
    assert len(found) > 10
    # `doctor` runs at a low priority, and may take 90 s beside other tests.
    with httpx.Client(base_url=url_of(product, process), trust_env=False, timeout=100) as client:
        for method, path, permission in found:
            if permission is None:
                open_to_strangers = "/healthz|/readyz|/api/server|/api/session"
                by_programs = (
                    "/api/logins(/claim|/cancel)?$|/api/(tokens|confirmations)/records$"
                    "|/api/sessions/ended$"
                )
                of_all_signed_in = "/api/tokens/{token}/revoke$"
                of_links = "/api/view$|/api/view/(graph|run)(/events)?$"
                known = f"{open_to_strangers}|{by_programs}|{of_all_signed_in}|{of_links}"
                assert re.match(known, path), f"who may {method} {path}?"
                continue
            for role in ROLES:
                answer = ask(client, method, path, browser(product, role))
                refused = (answer == 403) is not allowed(role, permission)
                assert refused, f"{role}: {method} {path} needs {permission}, answered {answer}"


def ask(client: httpx.Client, method: str, path: str, headers: dict[str, str]) -> int:
    """The status of a request for a thing that is not there, with a body that means nothing."""
    url = re.sub(r"\{[^}]*\}", "nothing", path)
    content = b"" if method in {"get", "delete"} else b"[]"
    with client.stream(method, url, headers=headers, content=content) as answer:
        return answer.status_code


@pytest.mark.parametrize(
    ("method", "path", "permission"),
    [
        ("post", "/api/graphs", "edit"),
        ("delete", "/api/graphs/{graph_id}", "edit"),
        ("post", "/api/graphs/{graph_id}/versions", "edit"),
        ("post", "/api/runs", "simulate"),
        ("post", "/api/runs/{run}/stop", "stop"),
        ("post", "/api/stop", "stop"),
        ("post", "/api/robots", "register"),
        ("get", "/api/graphs", "see"),
    ],
)
def test_routes_need_the_decided_rights(
    product: Product, method: str, path: str, permission: Permission
) -> None:
    found = [each for process in PROCESSES for each in operations(product, process)]
    assert (method, path, permission) in found


def test_starting_on_a_robot_takes_an_operator(product: Product) -> None:
    start = {"version": "v", "digest": "0" * 64, "umrf": {}, "engine": "rover", "request_id": "r"}
    with httpx.Client(base_url=product.runner_url, trust_env=False) as client:
        for role in ROLES:
            answer = client.post("/api/runs", json=start, headers=browser(product, role))
            assert (answer.status_code == 403) is not allowed(role, "operate")
            simulated = {**start, "engine": "simulator"}
            answer = client.post("/api/runs", json=simulated, headers=browser(product, role))
            assert (answer.status_code == 403) is not allowed(role, "simulate")
            needs: dict[str, Permission] = {"simulator": "simulate", "rover": "operate"}
            for carrier, needed in needs.items():
                robots = {"Scout": "simulator", "Carrier": carrier}
                led = {**start, "engine": "conducted", "robots": robots}
                answer = client.post("/api/runs", json=led, headers=browser(product, role))
                assert (answer.status_code == 403) is not allowed(role, needed)


@pytest.mark.parametrize("role", ROLES)
def test_everybody_may_stop_over_the_live_socket(product: Product, role: Role) -> None:
    with socket_to(f"{product.runner_url}/api/live", browser(product, role)) as socket:
        assert json.loads(socket.recv(5))["type"] == "hello"
        socket.send(json.dumps({"type": "stop", "run": "all", "stop_id": "s"}))
        while (said := json.loads(socket.recv(5)))["type"] == "beat":
            pass
        assert (said["type"], said["stop_id"], said["runs"]) == ("stopping", "s", [])


def test_a_viewer_hears_everything_and_changes_nothing(product: Product, graph: str) -> None:
    room = f"{product.url}/api/graphs/{graph}/room"
    ours: Doc[Any] = Doc()
    ours.get("meta", type=Map)["name"] = "mine now"
    with (
        socket_to(room, browser(product, "viewer")) as viewer,
        socket_to(room, browser(product, "owner")) as owner,
    ):
        assert heard(owner, messages.Question)  # step 1: what do you have?
        viewer.send(messages.question(Doc().get_state()))
        first = messages.parse(bytes(viewer.recv(5)))
        assert isinstance(first, messages.Edit)  # its own answer, and no step 1 before it
        viewer.send(messages.answer(messages.NOTHING_NEW))
        viewer.send(
            messages.presence([messages.PresenceEntry(77, 1, b'{"user":{"name":"Somebody else"}}')])
        )
        said = heard(owner, messages.Presence)
        assert json.loads(said.entries[0].state)["user"]["name"] == "Viewer"
        viewer.send(messages.change(ours.get_update()))
        assert closed(viewer) == messages.FORBIDDEN
    with product.editor() as editor:
        assert editor.get(f"/api/graphs/{graph}").json()["name"] == "task"


def test_sockets_to_the_runner_are_counted_and_one_is_kept_for_everybody(product: Product) -> None:
    live = f"{product.runner_url}/api/live"
    with contextlib.ExitStack() as open_:
        for _ in range(OF_AN_ADDRESS // OF_A_PERSON):
            greedy = browser(product, "operator")
            for _ in range(OF_A_PERSON):
                open_.enter_context(socket_to(live, greedy))
            with pytest.raises(InvalidStatus) as refused, socket_to(live, greedy):
                pass
            assert refused.value.response.status_code == 429
            assert refused.value.response.headers["retry-after"] == "5"
        viewer = browser(product, "viewer")
        socket = open_.enter_context(socket_to(live, viewer))
        socket.send(json.dumps({"type": "stop", "run": "all", "stop_id": "mine"}))
        while (said := json.loads(socket.recv(5)))["type"] != "stopping":
            pass
        assert said["stop_id"] == "mine"
        with pytest.raises(InvalidStatus), socket_to(live, viewer):  # the address has too many
            pass


@contextlib.contextmanager
def socket_to(url: str, headers: dict[str, str]) -> Iterator[ClientConnection]:
    """A WebSocket of a browser."""
    with connect(
        url.replace("http", "ws", 1),
        additional_headers={"cookie": headers["cookie"]},
        origin=headers["origin"],  # type: ignore[arg-type]
        proxy=None,
        open_timeout=5,
    ) as socket:
        yield socket


def heard(socket: ClientConnection, kind: type[Any]) -> Any:
    """The next message of a kind that says something."""
    while True:
        message = messages.parse(bytes(socket.recv(5)))
        if isinstance(message, kind) and message != messages.Presence(()):
            return message


def closed(socket: ClientConnection) -> int | None:
    """The code with which the server closes."""
    with contextlib.suppress(ConnectionClosed):
        while True:
            socket.recv(5)
    return socket.close_code
