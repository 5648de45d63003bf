"""Coming in by a link, and being put out when it is revoked: the real processes, real sockets."""

import contextlib
import json
import os
import re
import shutil
import sqlite3
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from action_assistant.kit.token_bucket import TokenBuckets
from action_assistant.share_links import invitations_as_text
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.revocations import Revocations
from editor.process import Editor
from editor.process import running as editor_running
from support.product import COMMAND, TOKEN, Product, running

LAB = "lab.test"  # a name on the network; what it leads to stays on this computer


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A shared server that the network knows as `lab.test`."""
    data = tmp_path_factory.mktemp("share") / "data"
    with running(data, "--share", "--host", "127.0.0.1", hosts=LAB) as product:
        yield product


@pytest.fixture(scope="module")
def graph(product: Product) -> str:
    """The id of a graph."""
    with product.editor() as editor:
        made: str = editor.post("/api/graphs", json={"name": "task"}).json()["id"]
        return made


Arrive = Callable[..., "Guest"]


@pytest.fixture
def arrive() -> Iterator[Arrive]:
    """Makes browsers, which are closed when the test is over."""
    with contextlib.ExitStack() as browsers:

        def one(product: Product, name: str = "Mari") -> Guest:
            guest = Guest(product, name)
            browsers.callback(guest.http.close)
            return guest

        yield one


class Guest:
    """A browser of its own that reaches the server as `lab.test`."""

    def __init__(self, product: Product, name: str) -> None:
        self.product = product
        self.name = name
        self.origin = f"http://{LAB}:{product.port}"
        self.http = httpx.Client(
            base_url=product.url,
            headers={"host": f"{LAB}:{product.port}", "origin": self.origin},
            trust_env=False,
            timeout=20,
        )

    def come(self, invitation: dict[str, Any]) -> httpx.Response:
        """Open a link."""
        body = {"invitation": proof(invitation), "name": self.name}
        answer = self.http.post("/api/session", json=body)
        if answer.is_success:
            self.http.headers["cookie"] = answer.headers["set-cookie"].partition(";")[0]
        return answer

    @property
    def role(self) -> str:
        """Return the role that the server reports."""
        found: str = self.http.get("/api/session").json()["person"]["role"]
        return found

    def runner(self, method: str, path: str, body: Any = None) -> httpx.Response:
        """Ask the runner with the same cookie."""
        headers = {**self.http.headers, "host": f"{LAB}:{self.product.port + 1}"}
        return httpx.request(
            method,
            self.product.runner_url + path,
            headers=headers,
            json=body,
            trust_env=False,
            timeout=20,
        )

    @contextlib.contextmanager
    def socket(self, url: str) -> Iterator[ClientConnection]:
        """A WebSocket to either process."""
        with connect(
            url.replace("http", "ws", 1),
            additional_headers={"cookie": self.http.headers["cookie"]},
            origin=self.product.url,  # type: ignore[arg-type]
            proxy=None,
            open_timeout=5,
        ) as socket:
            yield socket


def proof(invitation: dict[str, Any]) -> str:
    """Return the proof in the fragment of a link."""
    text: str = invitation["path"].removeprefix("/#i=")
    return text


def invite(product: Product, role: str, label: str = "") -> dict[str, Any]:
    """A new link."""
    with product.editor() as editor:
        answer = editor.post("/api/invitations", json={"role": role, "label": label})
        assert answer.status_code == 201
        made: dict[str, Any] = answer.json()
        return made


def revoke(product: Product, invitation: dict[str, Any]) -> None:
    """End a link."""
    with product.editor() as editor:
        answer = editor.post(f"/api/invitations/{invitation['id']}/revoke")
        assert answer.status_code == 200
        assert "path" not in answer.json()


def eventually(holds: Callable[[], bool], seconds: float = 20) -> None:
    """Wait until something holds."""
    deadline = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < deadline, "it never came to pass"
        time.sleep(0.02)


def closed(socket: ClientConnection) -> int | None:
    """The code with which the server closes."""
    with contextlib.suppress(ConnectionClosed):
        while True:
            socket.recv(10)
    return socket.close_code


@pytest.mark.long
def test_serve_makes_a_link_for_each_role_and_says_where_they_are(product: Product) -> None:
    """The links are printed at a terminal only, because other output is kept and read by others."""
    eventually(lambda: "people list" in product.log.read_text())
    with product.editor() as editor:
        sharing = editor.get("/api/invitations").json()
    assert sharing["origins"] == [f"http://{LAB}:{product.port}"]
    assert sharing["secure"] is False
    made = {each["role"]: each for each in sharing["invitations"]}
    listed = product.cli("people", "list").stdout
    for role in ("viewer", "editor", "operator"):
        assert f"http://{LAB}:{product.port}{made[role]['path']}" in listed
    assert "#i=" not in product.log.read_text()


def test_links_are_shown_with_a_code_for_each_role(product: Product) -> None:
    eventually(lambda: "people list" in product.log.read_text())  # the links are made by then
    text = invitations_as_text(product.url, Keys(TOKEN))
    with product.editor() as editor:
        sharing = editor.get("/api/invitations").json()
    printed = {each["role"]: each for each in reversed(sharing["invitations"])}
    for role in ("viewer", "editor", "operator"):
        assert f"{role}: may " in text
        assert f"http://{LAB}:{product.port}{printed[role]['path']}" in text
    assert text.count("▄▄▄▄▄ █") >= 6  # the corners of codes
    assert "not encrypted" in text


@pytest.mark.parametrize("role", ["viewer", "editor", "operator"])
def test_a_link_lets_in_with_its_role_and_the_owner_sees_who_came(
    product: Product, role: str, arrive: Arrive
) -> None:
    invitation = invite(product, role, label=f"for {role}s")
    guest = arrive(product)
    looked = guest.http.post("/api/session/invitation", json={"invitation": proof(invitation)})
    assert looked.json()["role"] == role
    assert looked.json()["by"] == ""  # the server's token made it: nobody has chosen that name
    answer = guest.come(invitation)
    assert answer.json()["person"]["role"] == role
    assert guest.role == role
    assert guest.runner("GET", "/api/runs").status_code == 200
    guest.come(invitation)  # once more changes nothing
    with product.editor() as editor:
        found = editor.get("/api/invitations").json()["invitations"]
    (mine,) = [each for each in found if each["id"] == invitation["id"]]
    assert mine["label"] == f"for {role}s"
    assert [each["person"]["name"] for each in mine["guests"]] == ["Mari"]


def test_only_owners_see_links_make_and_revoke_them(product: Product, arrive: Arrive) -> None:
    invitation = invite(product, "operator")
    guest = arrive(product)
    guest.come(invitation)
    assert guest.http.get("/api/invitations").status_code == 403
    assert guest.http.post("/api/invitations", json={"role": "viewer"}).status_code == 403
    assert guest.http.post(f"/api/invitations/{invitation['id']}/revoke").status_code == 403
    assert guest.runner("POST", "/api/revocations").status_code == 403
    with product.editor() as editor:
        assert editor.post("/api/invitations", json={"role": "owner"}).status_code == 400


def test_a_secret_that_does_not_fit_lets_nobody_in(product: Product, arrive: Arrive) -> None:
    one, other = invite(product, "viewer"), invite(product, "operator")
    secret = proof(other).partition(".")[2]
    for wrong in (f"{one['id']}.{secret}", one["id"], f"{one['id']}.", ".", "x" * 150, "", "a.ü"):
        answer = arrive(product, "Eve").come({"path": f"/#i={wrong}"})
        assert answer.status_code == 401
        assert "set-cookie" not in answer.headers


def test_the_secret_follows_from_the_token_and_is_in_no_log(product: Product) -> None:
    invitation = invite(product, "editor")
    secret = proof(invitation).partition(".")[2]
    assert secret == Keys(TOKEN).secret_of(invitation["id"])
    assert secret != Keys("o" * 43).secret_of(invitation["id"])
    assert len(secret) == 43  # 256 bit
    with contextlib.closing(sqlite3.connect(product.data / "editor.db")) as database:
        made = "SELECT body FROM event WHERE stream = 'invitations'"
        stored = b"".join(bytes(body) for (body,) in database.execute(made))
    assert invitation["id"].encode() in stored
    assert secret.encode() not in stored


def test_a_link_takes_nothing_away_and_the_person_stays_the_same(
    product: Product, arrive: Arrive
) -> None:
    viewer, editor = invite(product, "viewer"), invite(product, "editor")
    guest = arrive(product)
    first = guest.come(viewer).json()["person"]
    second = guest.come(editor).json()["person"]
    assert (second["id"], second["role"]) == (first["id"], "editor")
    assert guest.come(viewer).json()["person"] == second


def test_revoking_puts_out_at_once_everywhere_and_nobody_else(
    product: Product, graph: str, arrive: Arrive
) -> None:
    invitation, other = invite(product, "operator"), invite(product, "operator")
    guest, friend = arrive(product), arrive(product, "Ada")
    guest.come(invitation)
    friend.come(other)
    room, live = f"{product.url}/api/graphs/{graph}/room", f"{product.runner_url}/api/live"
    with (
        guest.socket(room) as in_room,
        guest.socket(live) as at_runner,
        friend.socket(live) as staying,
        followed(guest, f"{product.url}/api/events") as over,
    ):
        revoke(product, invitation)
        began = time.monotonic()
        assert (closed(in_room), closed(at_runner)) == (4401, 4401)
        assert over.wait(10)
        assert time.monotonic() - began < 10  # the promise is a second; machines of tests are slow
        staying.send(json.dumps({"type": "stop", "run": "all", "stop_id": "s"}))
        while (said := json.loads(staying.recv(5)))["type"] != "stopping":
            pass
        assert said["stop_id"] == "s"
    for path in ("/api/stop", "/api/runs/x/stop"):
        answer = guest.runner("POST", path)
        assert (answer.status_code, answer.json()["type"]) == (401, "withdrawn")
    for path in ("/api/graphs", "/api/session"):  # the one that is open says so, too
        assert guest.http.get(path).json()["type"] == "withdrawn"
    for url in (room, live):
        with pytest.raises(InvalidStatus), guest.socket(url):
            pass
    assert guest.come(invitation).json()["type"] == "withdrawn"
    assert guest.come(other).json()["person"]["name"] == "Mari"  # another link, the same person


@contextlib.contextmanager
def followed(guest: Guest, url: str) -> Iterator[threading.Event]:
    """Follow a stream of events; set once it has ended."""
    over, begun = threading.Event(), threading.Event()

    def follow() -> None:
        headers = {**guest.http.headers, "accept": "text/event-stream"}
        with httpx.stream("GET", url, headers=headers, trust_env=False, timeout=30) as answer:
            begun.set()
            for _ in answer.iter_raw():
                pass
        over.set()

    thread = threading.Thread(target=follow, daemon=True)
    thread.start()
    assert begun.wait(10)
    yield over
    thread.join(10)


@pytest.mark.long
def test_the_runner_needs_no_editor_to_put_somebody_out(tmp_path: Path, arrive: Arrive) -> None:
    with running(tmp_path / "data", "--share", "--host", "127.0.0.1", hosts=LAB) as product:
        invitation = invite(product, "operator")
        guest = arrive(product)
        guest.come(invitation)
        with guest.socket(f"{product.runner_url}/api/live") as live:
            product.process("editor").suspend()
            try:
                Revocations(product.data).add(invitation["id"])
                assert closed(live) == 4401
                assert guest.runner("POST", "/api/stop").status_code == 401
            finally:
                product.process("editor").resume()


@pytest.mark.long
def test_log_and_folder_agree_again_whatever_was_lost(tmp_path: Path) -> None:
    editor = Editor(tmp_path / "data")
    editor.start()
    with editor.client() as http:
        said, marked = (
            http.post("/api/invitations", json={"role": role}).json()["id"]
            for role in ("editor", "viewer")
        )
        http.post(f"/api/invitations/{said}/revoke")
    editor.kill()
    shutil.rmtree(editor.data / "revoked")  # a folder that was lost
    environment = {
        **os.environ,
        "ACTION_ASSISTANT_URL": editor.url,
        "ACTION_ASSISTANT_TOKEN": TOKEN,
    }
    revoke = [*COMMAND, "people", "revoke", marked, "--data", str(editor.data)]
    answer = subprocess.run(revoke, env=environment, capture_output=True, text=True, check=True)
    assert "No server answers" in answer.stdout
    editor.start()
    assert Revocations(editor.data).every() == {said, marked}
    with editor.client() as http:
        found = http.get("/api/invitations").json()["invitations"]
    assert {each["id"] for each in found if each["revoked_at"]} == {said, marked}
    editor.end()


@pytest.mark.long
def test_links_from_the_command_line(product: Product, arrive: Arrive) -> None:
    made = product.cli("people", "invite", "editor", "--label", "lab tablet")
    assert made.returncode == 0, made.stderr
    first, link = made.stdout.splitlines()
    invitation = first.split()[0]
    assert first == f"{invitation}  editor  lab tablet"
    assert re.fullmatch(rf"    http://{LAB}:\d+/#i={invitation}\.[\w-]{{43}}", link)
    arrive(product).come({"path": link.partition(str(product.port))[2]})
    assert "    Mari, since " in product.cli("people", "list").stdout
    gone = product.cli("people", "revoke", invitation)
    assert gone.stdout == f"{invitation}  editor is revoked; 1 came in by it.\n"
    assert f"{invitation}  editor  lab tablet  (revoked)" in product.cli("people", "list").stdout
    assert product.cli("people", "revoke", "nobody").returncode == 1


def test_a_link_is_drawn_for_the_places_of_this_server_only(product: Product) -> None:
    invitation = invite(product, "viewer")
    path = f"/api/invitations/{invitation['id']}/qr"
    with product.editor() as editor:
        drawn = editor.get(path, params={"origin": f"http://{LAB}:{product.port}"})
        assert drawn.headers["content-type"] == "image/svg+xml"
        assert drawn.text.startswith("<svg")
        assert editor.get(path, params={"origin": "http://evil.example"}).status_code == 400
        revoke(product, invitation)
        assert editor.get(path, params={"origin": product.url}).status_code == 409


def test_guessing_is_slowed_down_for_the_one_who_guesses(tmp_path: Path) -> None:
    with (
        editor_running(tmp_path / "data") as editor,
        httpx.Client(base_url=editor.url, trust_env=False) as stranger,
    ):
        tries = [
            stranger.post("/api/session", json={"invitation": f"x.{n}"}).status_code
            for n in range(80)
        ]
        assert tries[:60] == [401] * 60
        assert 429 in tries[60:]
        # The token itself is no guess.
        assert stranger.post("/api/session", json={"token": TOKEN}).status_code == 200


def test_an_address_is_forgiven_with_time_and_others_do_not_pay() -> None:
    now = 0.0
    pace = TokenBuckets(3, 1, lambda: now)
    assert [pace.of("a").take() for _ in range(4)] == [True, True, True, False]
    assert pace.of("b").take()
    now = 1.0
    assert [pace.of("a").take() for _ in range(2)] == [True, False]


@pytest.mark.parametrize("name", ["../token", "a/b", "", "x" * 41, "ü", "."])
def test_a_text_that_is_no_id_marks_nothing(tmp_path: Path, name: str) -> None:
    with pytest.raises(ValueError, match="no id"):
        Revocations(tmp_path).add(name)
    assert Revocations(tmp_path).holds(name)
    assert [path.name for path in tmp_path.rglob("*")] == ["revoked"]
