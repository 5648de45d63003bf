"""The audit of a real server: a random week of 20 people, and all that they did, and nothing else."""

import contextlib
import json
import os
import random
import sqlite3
import subprocess
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import httpx
import pytest

from action_assistant.cli import main
from action_assistant.editor.people.provided import provided_id
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from editor.api.test_provider import told
from support.product import TOKEN, Product, running
from support.provider import Provider, provided
from support.waiting import until
from web.auth.test_passkeys import Authenticator
from web.notifications.receiving import SECRET, http_receiver

SEED: Final = int(os.environ.get("TEST_SEED", "1"))
PEOPLE: Final = 20
DEEDS: Final = int(os.environ.get("TEST_DEEDS", "160"))
ROBOT: Final = "Rover"
ROLES: Final = ("viewer", "editor", "operator")
GRAPH: Final[dict[str, Any]] = {
    "graph_name": "patrol",
    "graph_entry": [{"name": "Go", "instance_id": 0}],
    "graph_exit": [{"name": "Go", "instance_id": 0}],
    "actions": [{"name": "Go", "instance_id": 0, "type": "sync"}],
}
#: A robot for drills, where the dose is large and rclpy is there.
DRILLED: Final = "David"
PYTHON: Final = Path(__file__).parents[1] / ".venv-ros" / "bin" / "python"
HAS_ROBOT: Final = "TEST_DEEDS" in os.environ and PYTHON.exists()
DOMAIN: Final = 60 + os.getpid() % 40
#: Who is let in by no group of the provider has no session there, and so ends theirs without one.
WITHOUT_A_SESSION: Final = {"member.refused.v1", "audit.session_ended.v1"}
#: A fact as the test knows it: who, which event, of what.
Fact = tuple[str, str, str]


@pytest.fixture(scope="module")
def provider() -> Iterator[Provider]:
    """An identity provider."""
    with provided() as found:
        yield found


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory, provider: Provider) -> Iterator[Product]:
    """A server for the module, with an identity provider and a receiver of messages."""
    folder = tmp_path_factory.mktemp("audit")
    with (
        http_receiver() as receiver,
        pytest.MonkeyPatch.context() as environ,
        emulated_robot(folder),
    ):
        (folder / "secret").write_text(SECRET)
        settings = folder / "notifications.toml"
        settings.write_text(
            f'[webhooks.chat]\nurl = "http://127.0.0.1:{receiver.port}/"\n'
            f'secret_file = "{folder / "secret"}"\nallow = ["127.0.0.1/32"]\n'
        )
        environ.setenv("ACTION_ASSISTANT_NOTIFICATIONS", str(settings))
        environ.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        if HAS_ROBOT:
            environ.setenv("ACTION_ASSISTANT_RUNNER_PYTHON", str(PYTHON))
        told(environ, provider, limits=True)
        with running(folder / "data") as found:
            yield found


@contextlib.contextmanager
def emulated_robot(folder: Path) -> Iterator[None]:
    """A context with a robot over rclpy that moves until it is stopped, if there may be one."""
    if not HAS_ROBOT:
        yield
        return
    script = folder / "script.json"
    script.write_text(json.dumps({"behaviours": {"*": [{"never": True}]}}))
    command = [PYTHON, "-m", "action_assistant", "simulate-robot", DRILLED]
    environ = {**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    robot = subprocess.Popen(
        [*command, "--domain", str(DOMAIN), "--script", str(script)], env=environ
    )
    try:
        yield
    finally:
        robot.terminate()
        robot.wait(20)


def start_of(request: str, engine: str) -> dict[str, Any]:
    """The body of a start of the graph."""
    return {
        "version": "v",
        "digest": digest(codec.read(json.dumps(GRAPH).encode()).graph),
        "umrf": GRAPH,
        "engine": engine,
        "request_id": request,
        "script": {"behaviours": {"*": [{"never": True, "stop_s": 0}]}},
    }


def admitted(ask: Callable[[], httpx.Response]) -> httpx.Response:
    """Ask until the address, from which all of these people come, may try again."""

    def answered() -> httpx.Response | None:
        answer = ask()
        return None if answer.status_code == 429 else answer

    answer = until("the address may try again", answered)
    assert answer is not None
    return answer


class Guest:
    """A browser of a person, who came in by a link."""

    def __init__(self, product: Product, name: str, link: Mapping[str, Any]) -> None:
        self.product = product
        self.name = name
        self.role: str = link["role"]
        self.http = httpx.Client(
            base_url=product.url, headers={"origin": product.url}, trust_env=False, timeout=30
        )
        proof = link["path"].removeprefix("/#i=")
        body = {"invitation": proof, "name": name}
        answer = admitted(lambda: self.http.post("/api/session", json=body))
        assert answer.status_code == 200, answer.text
        self.id: str = answer.json()["person"]["id"]

    def editor(self, method: str, path: str, **body: Any) -> httpx.Response:
        return self.http.request(method, path, **body)

    def runner(self, method: str, path: str, **body: Any) -> httpx.Response:
        return self.http.request(method, self.product.runner_url + path, **body)


class Week:
    """People who do things, and the facts that this makes."""

    def __init__(
        self, product: Product, provider: Provider, seed: int, browsers: contextlib.ExitStack
    ) -> None:
        self._browsers = browsers
        self.random = random.Random(seed)
        self.product = product
        self.owner = httpx.Client(
            headers={"authorization": f"Bearer {TOKEN}"}, trust_env=False, timeout=30
        )
        browsers.callback(self.owner.close)
        self.facts: Counter[Fact] = Counter()
        self.graphs: list[str] = []
        self.edits: Counter[tuple[str, str]] = Counter()  # by whom, of what
        self.runs: list[str] = []
        self.number = 0
        self.guests = [self._came(number) for number in range(PEOPLE)]
        assert self.own("POST", f"{product.runner_url}/api/robots", json={"name": ROBOT}).is_success
        self.fact("local", "robot.registered.v1")
        self._set_rights()
        self.holder = ""  # of the baton
        self.invited = self.provided = self.confirmed = 0
        self.provider = provider
        self.sessions: Counter[str] = Counter()  # of people of the provider, by their names there
        self.lets_in: dict[str, bool] = {}  # the last word of the provider, by the same
        self.desk, self.phone = self._on_two_browsers()
        if HAS_ROBOT:
            self._reach_robot()

    def fact(self, who: str, event: str, of: str = "") -> None:
        self.facts[who, event, of] += 1

    def own(self, method: str, path: str, **body: Any) -> httpx.Response:
        url = path if path.startswith("http") else self.product.url + path
        return self.owner.request(method, url, **body)

    def _set_rights(self) -> None:
        rights = {"operators": "all", "baton": True}
        path = f"{self.product.runner_url}/api/robots/{ROBOT}/rights"
        assert self.own("PUT", path, json=rights).is_success
        self.fact("local", "robot.rights_set.v1")

    def _came(self, number: int) -> Guest:
        role = ROLES[number % 3]
        link = self.own("POST", "/api/invitations", json={"role": role, "label": f"for {number}"})
        self.fact("local", "invitation.made.v1")
        guest = Guest(self.product, f"Person {number}", link.json())
        self._browsers.callback(guest.http.close)
        self.fact(guest.id, "audit.signed_in.v1")
        self.fact(guest.id, "invitation.accepted.v1")
        return guest

    def live(self, deeds: int) -> None:
        choices: list[Callable[[Guest], None]] = [
            *(self._make, self._rename, self._publish, self._delete, self._start, self._stop),
            *(self._idle, self._leave, self._approve, self._look),
            *(self._file, self._rule, self._release, self._show_by_link, self._baton, self._lock),
            *(self._token, self._invite, self._provide, self._confirm, self._passkey),
            self._test_receiver,
            *((self._drill,) if HAS_ROBOT else ()),
        ]
        for _ in range(deeds):
            self.random.choice(choices)(self.random.choice(self.guests))

    def _edits(self, guest: Guest) -> bool:
        return guest.role != "viewer"

    def _make(self, guest: Guest) -> None:
        self.number += 1
        made = guest.editor("POST", "/api/graphs", json={**GRAPH, "graph_name": f"g{self.number}"})
        assert (made.status_code == 201) is self._edits(guest)
        if made.status_code == 201:
            self.graphs.append(made.json()["id"])
            self.fact(guest.id, "graph.created.v1", self.graphs[-1])

    def _rename(self, guest: Guest) -> None:
        if not self.graphs:
            return
        graph, self.number = self.random.choice(self.graphs), self.number + 1
        done = guest.editor("PATCH", f"/api/graphs/{graph}", json={"name": f"g{self.number}"})
        assert done.is_success is self._edits(guest), done.text
        if done.is_success:
            self.edits[guest.id, graph] += 1

    def _publish(self, guest: Guest) -> None:
        if not self.graphs:
            return
        graph, self.number = self.random.choice(self.graphs), self.number + 1
        label = {"label": f"v{self.number}"}
        done = guest.editor("POST", f"/api/graphs/{graph}/versions", json=label)
        assert done.is_success is self._edits(guest), done.text
        if done.is_success:
            self.fact(guest.id, "version.published.v1", graph)

    def _delete(self, guest: Guest) -> None:
        if len(self.graphs) < 3 or not self._edits(guest):
            return
        graph = self.graphs.pop(self.random.randrange(len(self.graphs)))
        assert guest.editor("DELETE", f"/api/graphs/{graph}").is_success
        self.fact(guest.id, "graph.deleted.v1", graph)

    def _start(self, guest: Guest) -> None:
        self.number += 1
        start = start_of(f"r{self.number}", self.random.choice(("simulator", "Nobody")))
        done = guest.runner("POST", "/api/runs", json=start)
        if done.status_code == 201:
            self.runs.append(done.json()["id"])
            self.fact(guest.id, "run.requested.v1", self.runs[-1])
        else:
            assert guest.role == "viewer" or start["engine"] == "Nobody", done.text
            self.fact(guest.id, "audit.start_refused.v1")

    def _stop(self, guest: Guest) -> None:
        if not self.runs:
            return
        run = self.runs.pop()
        assert guest.runner("POST", f"/api/runs/{run}/stop").status_code == 202
        self.fact(guest.id, "run.stop_requested.v1", run)
        self._until_over(guest, run)

    def _idle(self, guest: Guest) -> None:
        """Press Stop of everything."""
        assert guest.runner("POST", "/api/stop").status_code == 202
        for run in self.runs:
            self.fact(guest.id, "run.stop_requested.v1", run)
        if not self.runs:
            self.fact(guest.id, "audit.stop_pressed.v1")
        for run in self.runs:
            self._until_over(guest, run)
        self.runs.clear()

    def _until_over(self, guest: Guest, run: str) -> None:
        path = f"/api/runs/{run}"
        until("the run is over", lambda: guest.runner("GET", path).json()["ended_at"])

    def _leave(self, guest: Guest) -> None:
        assert guest.editor("DELETE", "/api/session").status_code == 204
        self.fact(guest.id, "audit.session_ended.v1")
        self.guests.remove(guest)
        self.guests.append(self._came(self.number))
        self.number += 1

    def _approve(self, guest: Guest) -> None:
        self.number += 1
        body = {"digest": f"{self.number:064x}"}
        done = guest.runner("POST", "/api/approvals", json=body)
        if done.is_success:
            self.fact(guest.id, "approval.given.v1")
        else:
            assert done.status_code == 403

    def _file(self, guest: Guest) -> None:
        """Make a folder and put a graph there."""
        self.number += 1
        made = guest.editor("POST", "/api/folders", json={"name": f"f{self.number}"})
        assert made.is_success is self._edits(guest), made.text
        if not made.is_success:
            return
        self.fact(guest.id, "folder.made.v1")
        if self.graphs:
            graph, folder = self.random.choice(self.graphs), {"folder": made.json()["id"]}
            assert guest.editor("PUT", f"/api/graphs/{graph}/folder", json=folder).is_success
            self.fact(guest.id, "graph.filed.v1", graph)

    def _rule(self, guest: Guest) -> None:
        """An owner narrows who may edit a graph and takes that back; the guest may set no rule."""
        if not self.graphs:
            return
        graph = self.random.choice(self.graphs)
        path = f"/api/graphs/{graph}/rule"
        for rule in ({"readers": "all", "editors": []}, None):
            assert guest.editor("PUT", path, json={"rule": rule}).status_code == 403
            assert self.own("PUT", path, json={"rule": rule}).is_success
            self.fact("local", "graph.ruled.v1", graph)

    def _release(self, guest: Guest) -> None:
        """An owner releases a version and takes that back."""
        if not self.graphs:
            return
        graph, self.number = self.random.choice(self.graphs), self.number + 1
        label = {"label": f"v{self.number}"}  # without one, a version that is there is the answer
        version = self.own("POST", f"/api/graphs/{graph}/versions", json=label).json()["id"]
        self.fact("local", "version.published.v1", graph)
        path = f"/api/versions/{version}/release"
        assert guest.editor("PUT", path).status_code == 403
        for method, event in (("PUT", "released"), ("DELETE", "release_withdrawn")):
            assert self.own(method, path).is_success
            self.fact("local", f"version.{event}.v1", graph)

    def _show_by_link(self, guest: Guest) -> None:
        """An owner shows one graph by a link, and revokes it."""
        if not self.graphs:
            return
        graph = self.random.choice(self.graphs)
        wanted = {"thing": graph, "label": "for the wall", "days": 1}
        assert guest.editor("POST", "/api/view-links", json=wanted).status_code == 403
        link = self.own("POST", "/api/view-links", json=wanted).json()
        self.fact("local", "audit.view_link_made.v1", graph)
        assert self.own("POST", f"/api/view-links/{link['id']}/revoke").is_success
        self.fact("local", "audit.view_link_revoked.v1", graph)

    def _baton(self, guest: Guest) -> None:
        """Take the baton of the robot over, or drop it."""
        path, is_holder = f"/api/robots/{ROBOT}/baton", self.holder == guest.id
        which, body = ("drop", {}) if is_holder else ("take", {"json": {"reason": "my turn"}})
        done = guest.runner("POST", f"{path}/{which}", **body)
        assert done.is_success is (guest.role == "operator"), done.text
        if done.is_success:
            self.holder = "" if is_holder else guest.id
            self.fact(guest.id, "robot.baton_passed.v1")

    def _lock(self, guest: Guest) -> None:
        """Put the robot out of service, and into service again."""
        for which, body in (("lock", {"reason": "repair"}), ("unlock", {})):
            done = guest.runner("POST", f"/api/robots/{ROBOT}/{which}", json=body)
            assert done.is_success is (guest.role == "operator"), done.text
            if done.is_success:
                self.fact(guest.id, f"robot.{which}ed.v1")

    def _token(self, guest: Guest) -> None:
        """Make a token for a program, which looks around, and revoke it."""
        made = guest.editor("POST", "/api/tokens", json={"name": "nightly", "scopes": ["read"]})
        assert made.is_success, made.text
        self.fact(guest.id, "token.made.v1")
        bearer = {"authorization": f"Bearer {made.json()['token']}"}
        graphs = f"{self.product.url}/api/graphs"
        assert httpx.get(graphs, headers=bearer, trust_env=False).is_success
        path = f"/api/tokens/{made.json()['record']['id']}/revoke"
        assert guest.editor("POST", path).is_success
        self.fact(guest.id, "token.revoked.v1")

    def _invite(self, guest: Guest) -> None:
        """A person comes by a link of their own, adds a device, and is ended by an owner. A few do:
        who comes in too often from one address waits for a minute."""
        self.invited += 1
        if self.invited > 3:
            return
        self.number += 1
        name = {"name": f"Member {self.number}", "role": "viewer"}
        assert guest.editor("POST", "/api/members", json=name).status_code == 403
        member = self.own("POST", "/api/members", json=name).json()
        self.fact("local", "member.added.v1")
        self.fact("local", "link.made.v1")
        link = member["links"][0] | {"role": "viewer"}
        person = Guest(self.product, name["name"], link)
        self._browsers.callback(person.http.close)
        assert person.id == member["id"]
        self.fact(person.id, "audit.signed_in.v1")
        self.fact(person.id, "link.used.v1")
        code = person.editor("POST", "/api/devices/codes").json()
        url, origin = self.product.url, {"origin": self.product.url}

        def send(path: str, **body: str) -> httpx.Response:
            to = f"{url}/api/{path}"
            return admitted(lambda: httpx.post(to, json=body, headers=origin, trust_env=False))

        claim = send("session/device", code=code["code"]).json()["claim"]
        path = f"/api/devices/codes/{code['id']}/answer"
        assert person.editor("POST", path, json={"yes": True}).is_success
        assert send("session/device/answer", claim=claim).is_success
        self.fact(person.id, "device.added.v1")
        self.fact(person.id, "audit.signed_in.v1")
        assert self.own("POST", f"/api/members/{person.id}/end").is_success
        self.fact("local", "member.ended.v1")

    def _on_two_browsers(self) -> tuple[Guest, Guest]:
        """Let a person come in by two personal links, on two browsers."""
        body = {"name": "Nora", "role": "operator"}
        member = self.own("POST", "/api/members", json=body).json()
        self.fact("local", "member.added.v1")
        found = []
        for _ in range(2):
            self.fact("local", "link.made.v1")
            link = next(each for each in member["links"] if each.get("path"))
            guest = Guest(self.product, "Nora", {**link, "role": "operator"})
            self._browsers.callback(guest.http.close)
            self.fact(guest.id, "link.used.v1")
            self.fact(guest.id, "audit.signed_in.v1")
            found.append(guest)
            if len(found) == 1:
                path = f"/api/members/{guest.id}/link"
                member = self.own("POST", path, json={"hours": 1}).json()
        return found[0], found[1]

    def _confirm(self, guest: Guest) -> None:
        """Have a person confirm on their other browser that it is they, or say that it is not. At most
        four times: whoever asks more often has to wait for a minute."""
        self.confirmed += 1
        if self.confirmed > 4:
            return
        asked = self.desk.runner("POST", "/api/confirmations", json={})
        assert asked.is_success, asked.text
        path = f"/api/confirmations/{asked.json()['id']}/answer"
        yes = {"yes": self.random.random() < 0.5}
        assert guest.runner("POST", path, json=yes).status_code == 404
        assert self.phone.runner("POST", path, json=yes).status_code == 204
        self.fact(self.phone.id, "audit.confirmed.v1")

    def _passkey(self, guest: Guest) -> None:
        """Register a passkey, and confirm by it where it counts at once; then remove it."""
        host = f"localhost:{self.product.port}"
        own = {"host": host, "origin": f"http://{host}"}
        key = Authenticator()

        def send(path: str, **body: Any) -> httpx.Response:
            return self.phone.editor("POST", f"/api/passkeys{path}", headers=own, **body)

        options = send("/challenge").json()["options"]
        credential = key.create(options, own["origin"])
        body = {"name": "key", "credential": credential}
        assert guest.editor("POST", "/api/passkeys", json=body, headers=own).is_client_error
        made = send("", json=body)
        assert made.is_success, made.text
        self.fact(self.phone.id, "audit.passkey_changed.v1")
        challenge = send("/confirm/challenge")
        if challenge.is_success:
            answer = key.get(challenge.json()["options"], own["origin"])
            assert send("/confirm", json={"credential": answer}).is_success
            self.fact(self.phone.id, "audit.confirmed.v1")
        path = f"/api/passkeys/{made.json()['id']}"
        assert self.phone.editor("DELETE", path, headers=own).status_code == 204
        self.fact(self.phone.id, "audit.passkey_changed.v1")

    def _provide(self, guest: Guest) -> None:
        """Have a guest sign in by the identity provider, which lets them in or not. Only a few times."""
        assert guest.editor("GET", "/api/session/provider").is_success
        self.provided += 1
        if self.provided > 10:
            return
        name, comes_in = self.random.choice(("mari", "jan")), self.random.random() < 0.7
        self.provider.subject = name
        self.provider.claims = {"name": name, "groups": ["lab" if comes_in else "guests"]}
        came = until("the provider has spoken", self._visit_provider)
        assert came.status_code == (200 if comes_in else 403), came.text
        person, knew = provided_id(self.provider.issuer, name), name in self.lets_in
        if comes_in:
            if not knew or not self.lets_in[name]:  # else nothing about them is new
                self.fact(person, "member.renewed.v1" if knew else "member.came.v1")
            self.fact(person, "audit.signed_in.v1")
            self.sessions[name] += 1
        else:
            if self.lets_in.get(name):
                self.fact(person, "member.refused.v1")
            for _ in range(self.sessions.pop(name, 0)):
                self.fact(person, "audit.session_ended.v1")
        if comes_in or knew:
            self.lets_in[name] = comes_in

    def _visit_provider(self) -> httpx.Response | None:
        """Return the answer to a sign-in by the provider; None where one has to try again."""
        url, origin = self.product.url, {"origin": self.product.url}
        with httpx.Client(base_url=url, headers=origin, trust_env=False, timeout=30) as browser:
            asked = browser.post("/api/session/provider", json={"goal": "/", "again": False})
            if not asked.is_success:
                assert asked.status_code in {429, 503}, asked.text
                return None
            answer = self.provider.authorize(asked.json()["url"])
            came = browser.post("/api/session/provider/answer", json=answer)
        return None if came.status_code in {429, 503} else came

    def _test_receiver(self, guest: Guest) -> None:
        """An owner sends a test to the receiver of messages, by one of the processes."""
        path, base = "/api/notifications/chat/test", self.random.choice(("editor", "runner"))
        assert getattr(guest, base)("POST", path).status_code == 403
        url = self.product.url if base == "editor" else self.product.runner_url
        tested = self.own("POST", f"{url}{path}")
        assert (tested.status_code, tested.json()["error"]) == (200, "")
        self.fact("local", "audit.owner_did.v1")

    def _reach_robot(self) -> None:
        robots = f"{self.product.runner_url}/api/robots"
        body = {"name": DRILLED, "domain": DOMAIN}
        assert self.own("POST", robots, json=body).is_success
        self.fact("local", "robot.registered.v1")

        def is_there() -> bool:
            known = {each["name"]: each for each in self.own("GET", robots).json()}
            return bool(known[DRILLED]["state"] == "answering")

        until("the robot answers", is_there)

    def _drill(self, guest: Guest) -> None:
        """Make a Stop drill: start, Stop, and the word of who saw it."""
        if guest.role != "operator":
            return
        begun = until("a drill begins", lambda: self._drill_begun(guest))
        run = begun["id"]
        self.fact(guest.id, "run.requested.v1", run)
        path = f"/api/runs/{run}"

        def moves() -> bool:
            actions = guest.runner("GET", path).json()["actions"].values()
            return any(each["state"] == "RUNNING" for each in actions)

        until("it moves", moves)
        assert guest.runner("POST", f"{path}/stop").status_code == 202
        self.fact(guest.id, "run.stop_requested.v1", run)
        until("its rest is proven", lambda: guest.runner("GET", path).json()["proof_at"])
        self._until_over(guest, run)
        saw = {"run": run, "saw_it_stop": True, "hardware_stop": self.random.random() < 0.5}
        done = guest.runner("POST", f"/api/robots/{DRILLED}/drills", json=saw)
        assert done.is_success, done.text
        self.fact(guest.id, "robot.drilled.v1")

    def _drill_begun(self, guest: Guest) -> dict[str, Any] | None:
        """Start a run for a drill; None if the robot was too slow to answer, which refuses the start
        and no other one."""
        self.number += 1
        start = start_of(f"r{self.number}", DRILLED)
        start.pop("script")
        begun = guest.runner("POST", "/api/runs", json=start)
        if begun.status_code == 201:
            return dict(begun.json())
        where = {"path": "/engine", "item": "answers"}
        assert (begun.status_code, begun.json()["where"]) == (503, where), begun.text
        self.fact(guest.id, "audit.start_refused.v1")
        return None

    def _look(self, guest: Guest) -> None:
        """Only look: that is no fact of the audit."""
        assert guest.editor("GET", "/api/graphs").is_success
        assert guest.runner("GET", "/api/runs").is_success


def audit(product: Product, *words: str, capfd: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    assert main(["audit", "--json", *words]) == 0
    return [json.loads(line) for line in capfd.readouterr().out.splitlines()]


def test_all_that_20_people_did_is_in_the_audit_and_nothing_else(
    product: Product,
    provider: Provider,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("ACTION_ASSISTANT_URL", product.url)
    monkeypatch.setenv("ACTION_ASSISTANT_TOKEN", TOKEN)
    with contextlib.ExitStack() as browsers:
        week = Week(product, provider, SEED, browsers)
        week.live(DEEDS)

    assert product.end() == 0  # which stores what is counted
    product.start()
    told: Counter[Fact] = Counter()
    for row in audit(product, capfd=capfd):
        assert "cannot be read" not in row["text"], row
        who = row.get("person")
        if who is None:
            assert row["kind"] in {"strangers", "other"}
            continue
        whence = row.get("from", {})
        if row["event"] in WITHOUT_A_SESSION:
            assert whence, row
        else:
            assert whence.get("session") or whence.get("token") == "server", row
        if row["event"] != "person.named.v1":  # with the first change that a person makes
            of = row.get("run") or row.get("graph", "")
            told[who["id"], row["event"], of] += row.get("times", 1)
    for (person, graph), count in week.edits.items():  # one row for each sitting
        assert 1 <= told.pop((person, "audit.edited.v1", graph), 0) <= count
    assert (told - week.facts, week.facts - told) == (Counter(), Counter())


def test_a_flood_of_strangers_grows_no_log_and_holds_up_no_stop(product: Product) -> None:
    over = threading.Event()
    refused: Counter[int] = Counter()
    begun = time.monotonic()

    def flood() -> None:
        with httpx.Client(base_url=product.runner_url, trust_env=False, timeout=30) as stranger:
            while not over.is_set():
                refused[stranger.get("/api/runs/unknown").status_code] += 1

    kept = stored_strangers(product)
    threads = [threading.Thread(target=flood) for _ in range(4)]
    with httpx.Client(
        base_url=product.runner_url,
        headers={"authorization": f"Bearer {TOKEN}"},
        trust_env=False,
        timeout=30,
    ) as owner:
        for thread in threads:
            thread.start()
        try:
            for number in range(3):
                made = owner.post("/api/runs", json=start_of(f"flood{number}", "simulator"))
                path = f"/api/runs/{made.json()['id']}"
                assert owner.post(f"{path}/stop").status_code == 202
                until("the Stop is proven", lambda path=path: owner.get(path).json()["proof_at"])
            until("many were refused", lambda: refused[401] > 1_000)
        finally:
            over.set()
            for thread in threads:
                thread.join()
    assert product.end() == 0  # which stores what is counted
    rows = stored_strangers(product)[len(kept) :]
    assert sum(row["count"] for row in rows) >= refused[401]
    assert len(rows) <= (time.monotonic() - begun) // 60 + 2
    assert {row["address"] for row in rows} == {""}


def stored_strangers(product: Product) -> list[dict[str, Any]]:
    """Return what the log of the runner has of refused strangers."""
    file = product.data / "runner.db"
    with contextlib.closing(sqlite3.connect(f"file:{file}?mode=ro", uri=True)) as log:
        found = log.execute(
            "SELECT body FROM event WHERE kind = 'audit.strangers_refused.v1' ORDER BY position"
        )
        return [json.loads(body) for (body,) in found]
