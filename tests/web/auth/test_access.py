"""The door, knocked at over real sockets: who is let in, and what the others are told."""

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from socket import create_connection
from threading import Thread
from typing import Any

import httpx
import pytest
import uvicorn
from litestar import Request, WebSocket, get, post, websocket
from litestar.params import JSONBody
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from action_assistant.errors import Unauthenticated
from action_assistant.web.auth.access import Needs, SignedIn, person_of
from action_assistant.web.auth.desk import Held
from action_assistant.web.auth.device_codes import DeviceCodes
from action_assistant.web.auth.keys import Keys, Person, PersonRef, Session
from action_assistant.web.auth.people_files import PeopleFiles, PersonFile
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.roles import Role
from action_assistant.web.auth.session_files import SessionFiles
from action_assistant.web.auth.sessions import Invited, Sessions, session_routes
from action_assistant.web.auth.standing import Standings
from action_assistant.web.network.addresses import Addresses
from action_assistant.web.server.application import application
from action_assistant.web.server.sockets import bound

KEYS = Keys("k" * 43)
BEARER = {"authorization": f"Bearer {KEYS.token}"}


@get("/api/me", guards=[SignedIn()])
async def me(request: Request[Any, Any, Any]) -> str:
    """Say who asks."""
    return person_of(request).name


@post("/api/stop", status_code=200, guards=[Needs("stop")])
async def stop() -> str:
    """Serve a route that an expired session may use."""
    return "stopping"


@post("/api/runs", status_code=200, guards=[Needs("simulate")])
async def start(data: JSONBody[dict[str, int]]) -> str:
    """Serve a route that an expired session may not use."""
    return f"starting {data['n']}"


@get("/api/broken", guards=[Needs("see")])
async def broken() -> str:
    """Fail in a way that nobody foresaw."""
    raise ZeroDivisionError("secret detail")


@websocket("/api/live", guards=[Needs("see")])
async def live(socket: WebSocket[Any, Any, Any]) -> None:
    """Say who connected."""
    await socket.accept()
    await socket.send_text(person_of(socket).name)
    await socket.close()


class Nobody:
    """A reception that knows no invitations."""

    async def look(self, proof: str) -> Invited:
        raise Unauthenticated(f"{proof} is not known.")

    async def come_in(self, link: str, session: str, browser: str, address: str) -> PersonFile:
        raise AssertionError(f"{browser} at {address} came by {link}")

    async def welcome(self, invitation: str, person: PersonRef) -> None:
        raise AssertionError(f"{person} came by {invitation}")


@contextmanager
def served(folder: Path) -> Iterator[int]:
    """The application on a free port of the loopback interface."""
    listener, *others = bound("127.0.0.1", 0)
    for other in others:  # on another free port of the other family
        other.close()
    port: int = listener.getsockname()[1]
    revoked = Revocations(folder)
    browsers = SessionFiles(folder, revoked)
    standings = Standings(PeopleFiles(folder), browsers)
    sessions = session_routes(
        Sessions(KEYS, port, Nobody, revoked, standings),
        revoked=revoked,
        standings=standings,
        codes=Held(DeviceCodes()),
    )
    app = application(
        [me, stop, start, broken, live, *sessions],
        title="test",
        keys=KEYS,
        revoked=revoked,
        addresses=Addresses(host="127.0.0.1", page_port=port),
        page_port=port,
        page=folder,
        runner_port=port + 1,
    )
    server = uvicorn.Server(
        uvicorn.Config(app, log_config=None, ws="websockets-sansio", server_header=False)
    )
    thread = Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    while not server.started:
        time.sleep(0.01)
    try:
        yield port
    finally:
        server.should_exit = True
        thread.join()


@pytest.fixture(scope="module")
def port(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """A running server with a tiny built page."""
    folder = tmp_path_factory.mktemp("page")
    (folder / "index.html").write_text("<!doctype html><title>page</title>")
    (folder / "assets").mkdir()
    (folder / "assets" / "app.js").write_text("'use strict';" * 200)
    with served(folder) as number:
        yield number


@pytest.fixture
def client(port: int) -> Iterator[httpx.Client]:
    """A program without credentials."""
    with httpx.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False) as http:
        yield http


def cookie(port: int, *, expires: float, role: Role = "owner") -> dict[str, str]:
    """The header of a browser that signed in."""
    session = Session("s", Person("p", "Ada", role), expires)
    return {"cookie": f"aa_{port}={KEYS.sealed(session)}"}


def test_health_answers_strangers(client: httpx.Client) -> None:
    assert client.get("/healthz").json()["status"] == "ok"
    assert client.get("/readyz").json() == {"ready": True, "problems": []}


@pytest.mark.parametrize(
    "path", ["/api/me", "/api/nothing", "/api/graphs/%00", "/metrics", "/schema/openapi.json", "/x"]
)
def test_a_stranger_is_told_to_sign_in_whatever_else_is_wrong(
    client: httpx.Client, path: str
) -> None:
    answer = client.get(path)
    assert answer.status_code == 401
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["type"] == "unauthenticated"


def test_the_token_opens_the_door_to_programs(client: httpx.Client) -> None:
    assert client.get("/api/me", headers=BEARER).status_code == 200
    assert client.get("/api/me", headers={"authorization": "Bearer " + "x" * 43}).status_code == 401
    assert client.get(f"/api/me?token={KEYS.token}").status_code == 401


@pytest.mark.parametrize(
    ("headers", "kind"),
    [
        ({"host": "evil.example"}, "wrong-host"),
        ({"origin": "http://evil.example"}, "wrong-origin"),
        ({"origin": "null"}, "wrong-origin"),
    ],
)
def test_a_wrong_host_or_origin_is_refused_whatever_token_comes_with_it(
    client: httpx.Client, headers: dict[str, str], kind: str
) -> None:
    answer = client.get("/api/me", headers={**BEARER, **headers})
    assert (answer.status_code, answer.json()["type"]) == (403, kind)


def test_a_browser_trades_the_token_for_a_cookie_and_gives_a_name(
    client: httpx.Client, port: int
) -> None:
    assert client.get("/api/session").status_code == 401
    assert client.post("/api/session", json={"token": "wrong"}).status_code == 401
    answer = client.post("/api/session", json={"token": KEYS.token})
    assert answer.json()["named"] is False
    flags = answer.headers["set-cookie"].lower()
    assert f"aa_{port}=" in flags
    assert "httponly" in flags
    assert "samesite=strict" in flags
    first = client.get("/api/session").json()["person"]
    client.post(
        "/api/session", json={"name": " Ada  K "}, headers={"origin": f"http://127.0.0.1:{port}"}
    )
    ada = {"id": first["id"], "name": "Ada K", "role": "owner"}
    assert client.get("/api/session").json()["person"] == ada
    assert client.get("/api/me").text == "Ada K"


def test_the_link_again_in_the_same_browser_is_the_same_person(
    client: httpx.Client, port: int
) -> None:
    client.headers["origin"] = f"http://127.0.0.1:{port}"
    client.post("/api/session", json={"token": KEYS.token, "name": "Ada"})
    first = client.get("/api/session").json()
    assert client.post("/api/session", json={"token": KEYS.token}).json() == first
    client.delete("/api/session")
    other = client.post("/api/session", json={"token": KEYS.token}).json()
    assert other["person"]["id"] != first["person"]["id"]
    assert other["named"] is False


def test_a_cookie_without_an_origin_changes_nothing(client: httpx.Client, port: int) -> None:
    headers = cookie(port, expires=1e12)
    assert client.post("/api/runs", json={"n": 1}, headers=headers).status_code == 403
    own = {**headers, "origin": f"http://127.0.0.1:{port}"}
    assert client.post("/api/runs", json={"n": 1}, headers=own).text == "starting 1"


def test_an_expired_session_may_still_stop_and_nothing_else(
    client: httpx.Client, port: int
) -> None:
    headers = {**cookie(port, expires=time.time() - 60), "origin": f"http://localhost:{port}"}
    assert client.post("/api/stop", headers=headers).status_code == 200
    assert client.post("/api/runs", json={"n": 1}, headers=headers).status_code == 401
    assert client.get("/api/me", headers=headers).status_code == 401
    assert client.get("/api/stop", headers=headers).status_code == 401


def test_a_page_of_ours_may_ask_before_it_calls(client: httpx.Client, port: int) -> None:
    ask = {"access-control-request-method": "POST", "origin": f"http://localhost:{port}"}
    answer = client.options("/api/runs", headers=ask)
    assert answer.status_code == 204
    assert answer.headers["access-control-allow-origin"] == f"http://localhost:{port}"
    assert answer.headers["access-control-allow-credentials"] == "true"
    evil = client.options("/api/runs", headers={**ask, "origin": "http://evil.example"})
    assert evil.status_code == 403
    assert "access-control-allow-origin" not in evil.headers


def test_every_refusal_has_one_shape(client: httpx.Client) -> None:
    answers = [
        client.get("/api/nothing", headers=BEARER),
        client.delete("/api/me", headers=BEARER),
        client.post("/api/runs", content=b"{", headers=BEARER),
        client.post("/api/runs", json=["n"], headers=BEARER),
        client.post("/api/runs", content=b"[" * 100_000, headers=BEARER),
        client.post("/api/runs", content=b" " * 10_000_001, headers=BEARER),
        client.get("/api/broken", headers=BEARER),
    ]
    assert [answer.status_code for answer in answers] == [404, 405, 400, 400, 400, 413, 500]
    for answer in answers:
        assert answer.headers["content-type"] == "application/problem+json"
        body = answer.json()
        assert body["status"] == answer.status_code
        assert {"type", "title", "status", "detail"} <= set(body)
        assert "secret" not in answer.text
        assert "Traceback" not in answer.text


def test_the_page_answers_strangers_and_names_the_runner_in_its_policy(
    client: httpx.Client, port: int
) -> None:
    for path in ("/", "/graphs/abc", "/runs"):
        answer = client.get(path, headers={"accept": "text/html"})
        assert answer.text.startswith("<!doctype html>")
        policy = answer.headers["content-security-policy"]
        assert f"http://127.0.0.1:{port + 1} ws://127.0.0.1:{port + 1}" in policy
        assert "'unsafe-eval'" not in policy
    script = client.get("/assets/app.js")
    assert script.headers["content-encoding"] == "gzip"
    assert "immutable" in script.headers["cache-control"]
    again = client.get("/assets/app.js", headers={"if-none-match": script.headers["etag"]})
    assert again.status_code == 304


@pytest.mark.parametrize("path", ["/../secret", "/assets/../../secret", "/assets/%2e%2e/x"])
def test_no_path_leads_out_of_the_page(client: httpx.Client, path: str) -> None:
    assert client.get(path).status_code == 401


def test_openapi_says_which_routes_are_open(client: httpx.Client) -> None:
    schema = client.get("/schema/openapi.json", headers=BEARER).json()
    assert schema["security"] == [{"token": []}]
    for path in ("/healthz", "/readyz", "/api/session", "/api/session/invitation"):
        assert all(operation["security"] == [] for operation in schema["paths"][path].values())
    assert "security" not in schema["paths"]["/api/me"]["get"]


@pytest.mark.parametrize(
    ("extra", "status"),
    [
        ({}, 401),
        ({"origin": "http://evil.example", **BEARER}, 403),
        ({"host": "evil.example", **BEARER}, 403),
        ({"authorization": "Bearer no"}, 401),
    ],
)
def test_a_socket_is_refused_before_the_upgrade(
    port: int, extra: dict[str, str], status: int
) -> None:
    with pytest.raises(InvalidStatus) as refused, socket_to(port, extra):
        pass
    assert refused.value.response.status_code == status
    assert json.loads(refused.value.response.body)["status"] == status


def test_a_socket_with_a_cookie_needs_the_pages_origin(port: int) -> None:
    with pytest.raises(InvalidStatus), socket_to(port, cookie(port, expires=1e12)):
        pass
    own = {**cookie(port, expires=1e12), "origin": f"http://localhost:{port}"}
    with socket_to(port, own) as socket:
        assert socket.recv() == "Ada"


def socket_to(port: int, headers: dict[str, str]) -> Any:
    """A WebSocket connection with these headers."""
    host = headers.get("host")
    rest = {name: value for name, value in headers.items() if name not in {"host", "origin"}}
    return connect(
        f"ws://{host or '127.0.0.1'}:{port}/api/live",
        sock=None if host is None else create_connection(("127.0.0.1", port)),
        additional_headers=rest,
        origin=headers.get("origin"),  # type: ignore[arg-type]
        proxy=None,
        open_timeout=5,
    )


def test_a_person_who_signs_in_after_the_session_expired_is_the_same_person(
    client: httpx.Client, port: int
) -> None:
    headers = {**cookie(port, expires=time.time() - 60), "origin": f"http://localhost:{port}"}
    answer = client.post("/api/session", json={"token": KEYS.token}, headers=headers)
    assert answer.json()["person"] == {"id": "p", "name": "Ada", "role": "owner"}
    forged = {**headers, "cookie": headers["cookie"][:-2] + "xx"}
    stranger = client.post("/api/session", json={"token": KEYS.token}, headers=forged)
    assert stranger.json()["person"]["id"] != "p"
