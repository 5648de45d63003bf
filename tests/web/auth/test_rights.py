"""Rights: the one decision about them, routes that declare none, and tokens of programs."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st
from litestar import Request, WebSocket, get, post, websocket
from litestar.exceptions import WebSocketDisconnect
from litestar.testing import TestClient
from litestar.types import ControllerRouterHandler

from action_assistant.editor import app as editor
from action_assistant.errors import CannotStart
from action_assistant.runner import app as runner
from action_assistant.settings import EditorSettings, RunnerSettings
from action_assistant.web.auth.access import Needs, Open, SignedIn, identity_of, is_expired
from action_assistant.web.auth.identity import Identity, NoTokens, Scope, Token
from action_assistant.web.auth.keys import Keys, Person
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.rights import SCOPES_FOR, Allowed, Denied, may
from action_assistant.web.auth.roles import Permission, Role, allowed
from action_assistant.web.network.addresses import Addresses
from action_assistant.web.server.application import application

KEYS = Keys("k" * 43)
PORT = 8000
ORIGIN = f"http://127.0.0.1:{PORT}"
ROLES = st.sampled_from(get_args(Role))
PERMISSIONS = st.sampled_from(get_args(Permission))
TOKENS = st.builds(
    lambda role, scopes: Token("t", "ci", Person("p", "Ada", role), scopes),
    ROLES,
    st.frozensets(st.sampled_from(get_args(Scope))),
)


class Locked:
    """A thing that refuses everything that it is asked."""

    def refusal(self, identity: Identity, permission: Permission, now: float) -> str | None:
        return f"{identity.person.name} may not {permission} at {now:.0f}."


@given(role=ROLES, permission=PERMISSIONS)
def test_a_person_may_what_the_role_allows(role: Role, permission: Permission) -> None:
    person = Identity(Person("p", "Ada", role))
    assert (may(person, permission, now=0) == Allowed()) is allowed(role, permission)


@given(token=TOKENS, permission=PERMISSIONS)
def test_a_token_may_no_more_than_its_person_and_its_scopes(
    token: Token, permission: Permission
) -> None:
    decision = may(Identity(token.person, token=token), permission, now=0)
    in_scope = bool(token.scopes & SCOPES_FOR[permission])
    assert (decision == Allowed()) is (in_scope and allowed(token.person.role, permission))
    if permission in {"register", "share", "restore"}:
        assert isinstance(decision, Denied)


@given(role=ROLES, permission=PERMISSIONS)
def test_a_thing_refuses_everything_but_stop(role: Role, permission: Permission) -> None:
    decision = may(Identity(Person("p", "Ada", role)), permission, Locked(), now=7)
    if permission == "stop":
        assert decision == Allowed()
    elif allowed(role, permission):
        assert decision == Denied(f"Ada may not {permission} at 7.")


def test_a_refusal_names_token_scopes_and_what_is_needed() -> None:
    token = Token("t", "ci", Person("p", "Ada", "owner"), frozenset({"read", "edit"}))
    identity = Identity(token.person, token=token)
    said = [may(identity, permission, now=0) for permission in ("simulate", "share")]
    assert said == [
        Denied("The token 'ci' has the scopes edit, read; this needs operate or simulate."),
        Denied("The token 'ci' may not do this: it takes a person who is signed in."),
    ]


@websocket("/api/novelty")
async def forgotten_socket(socket: WebSocket[Any, Any, Any]) -> None:
    """Serve a socket that does not say who may open it."""
    await socket.accept()


@get("/api/novelty")
async def forgotten_route() -> str:
    """Serve a route that does not say who may call it."""
    return ""


@get("/api/half", guards=[Needs("see")])
async def half_open() -> str:
    """Serve a route at a path."""
    return ""


@post("/api/half", guards=[Open()])
async def other_half() -> str:
    """Serve another method of that path, for strangers."""
    return ""


# Elsewhere the applications are made in processes of their own, where this is no error.
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize(
    ("routes", "why"),
    [
        ([forgotten_route], "GET /api/novelty does not declare who may call it"),
        ([forgotten_socket], "WEBSOCKET /api/novelty does not declare who may call it"),
        ([half_open, other_half], "/api/half is open to strangers by some of its methods only"),
    ],
)
def test_a_route_without_a_declared_right_stops_both_processes(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    routes: list[ControllerRouterHandler],
    why: str,
) -> None:
    database = f"sqlite:///{tmp_path / 'editor.db'}"
    made = editor.application
    for module in (editor, runner):
        monkeypatch.setattr(
            module,
            "application",
            lambda handlers, **more: made([*handlers, *routes], **more),
        )
    starts: list[Callable[[], object]] = [
        lambda: editor.create_app(EditorSettings(data=tmp_path, database=database)),
        lambda: runner.create_app(RunnerSettings(data=tmp_path)),
    ]
    for start in starts:
        with pytest.raises(CannotStart, match=why):
            start()


class Programs(NoTokens):
    """The tokens of two programs: one that reads, and one that expired."""

    def opens(self, text: str) -> Token | None:
        person = Person("p", "Ada", "editor")
        return {
            "reads": Token("r", "dashboard", person, frozenset({"read"})),
            "starts": Token("s", "nightly", person, frozenset({"simulate"})),
            "short": Token("t", "short", person, frozenset({"simulate"}), time.time() + 0.5),
            "old": Token("o", "old", person, frozenset({"simulate"}), expires=1.0),
        }.get(text)


@get("/api/me", guards=[SignedIn()])
async def me(request: Request[Any, Any, Any]) -> list[str]:
    """Say who asks."""
    identity = identity_of(request)
    return [identity.person.name, identity.token.name if identity.token else ""]


@post("/api/runs", status_code=200, guards=[Needs("simulate")])
async def start() -> str:
    """Serve a route that needs a scope."""
    return ""


@post("/api/stop", status_code=200, guards=[Needs("stop")])
async def stop() -> str:
    """Serve Stop."""
    return ""


@websocket("/api/live", guards=[Needs("simulate")])
async def live(socket: WebSocket[Any, Any, Any]) -> None:
    """Say to each message whether the client has expired, until it goes or is put out."""
    await socket.accept()
    async for _ in socket.iter_data():
        await socket.send_json(is_expired(socket))


@pytest.fixture
def revoked(tmp_path: Path) -> Revocations:
    return Revocations(tmp_path)


@pytest.fixture
def client(revoked: Revocations) -> TestClient[Any]:
    app = application(
        [me, start, stop, live],
        title="test",
        keys=KEYS,
        revoked=revoked,
        addresses=Addresses(host="127.0.0.1", page_port=PORT),
        page_port=PORT,
        tokens=Programs(),
    )
    return TestClient(app, base_url=ORIGIN)


def bearer(token: str) -> dict[str, str]:
    return {"authorization": f"Bearer {token}"}


def test_a_token_opens_the_routes_of_its_scopes(client: TestClient[Any]) -> None:
    assert client.get("/api/me", headers=bearer("reads")).json() == ["Ada", "dashboard"]
    assert client.get("/api/me", headers=bearer("unknown")).status_code == 401
    assert client.post("/api/runs", headers=bearer("reads")).status_code == 403
    assert client.post("/api/runs", headers=bearer("starts")).status_code == 200
    for token in ("reads", "starts"):  # Stop is open to each token that sees runs
        assert client.post("/api/stop", headers=bearer(token)).status_code == 200


def test_an_expired_token_may_still_stop_and_nothing_else(client: TestClient[Any]) -> None:
    assert client.post("/api/stop", headers=bearer("old")).status_code == 200
    refused = client.post("/api/runs", headers=bearer("old"))
    assert (refused.status_code, refused.json()["detail"]) == (401, "The token 'old' has expired.")


def test_an_ended_token_or_person_is_out_at_once(
    client: TestClient[Any], revoked: Revocations, tmp_path: Path
) -> None:
    session = KEYS.new_session("Ada", role="editor", person_id="p")
    browser = {"cookie": f"aa_{PORT}={KEYS.sealed(session)}", "origin": ORIGIN}
    assert client.get("/api/me", headers=browser).json() == ["Ada", ""]
    Revocations(tmp_path).end_token("r")  # as another process does
    assert client.get("/api/me", headers=bearer("reads")).json()["type"] == "withdrawn"
    assert client.get("/api/me", headers=bearer("starts")).status_code == 200
    Revocations(tmp_path).end_person("p")
    for headers in (browser, bearer("starts"), bearer("old")):
        for answer in (
            client.get("/api/me", headers=headers),
            client.post("/api/stop", headers=headers),
        ):
            assert (answer.status_code, answer.json()["type"]) == (401, "withdrawn")
            assert "ended by an owner" in answer.json()["detail"]


def test_open_sockets_of_a_token_close_when_it_is_revoked(
    client: TestClient[Any], revoked: Revocations
) -> None:
    with (
        pytest.raises(WebSocketDisconnect),
        client.websocket_connect("/api/live", headers=bearer("reads")),
    ):
        pass
    with client.websocket_connect("/api/live", headers=bearer("starts")) as socket:
        revoked.end_token("s")
        with pytest.raises(WebSocketDisconnect) as closed:
            socket.receive()
        assert closed.value.code == 4401


def test_a_live_socket_says_when_its_token_has_expired(client: TestClient[Any]) -> None:
    with client.websocket_connect("/api/live", headers=bearer("short")) as socket:
        socket.send_text("")
        assert socket.receive_json() is False
        time.sleep(0.6)
        socket.send_text("")
        assert socket.receive_json() is True


@pytest.mark.parametrize("hostile", ["", "../x", "a/b", "x" * 41, "ä", "session-\0"])
def test_malformed_ids_are_never_marked_and_open_nothing(tmp_path: Path, hostile: str) -> None:
    marks = Revocations(tmp_path)
    for end in (marks.end, marks.end_person, marks.end_token):
        with pytest.raises(ValueError, match="is no id of"):
            end(hostile)
    assert marks.person_ended(hostile)
    assert marks.token_ended(hostile)
