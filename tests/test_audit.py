"""The audit of a real server: a random week of 20 people, and all that they did, and nothing else."""

import contextlib
import json
import random
import sqlite3
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any, Final

import httpx
import pytest

from action_assistant.cli import main
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from support.product import TOKEN, Product, running
from support.waiting import until

SEED: Final = 1
PEOPLE: Final = 20
DEEDS: Final = 120
ROLES: Final = ("viewer", "editor", "operator")
GRAPH: Final[dict[str, Any]] = {
    "graph_name": "patrol",
    "graph_entry": [{"name": "Go", "instance_id": 0}],
    "graph_exit": [{"name": "Go", "instance_id": 0}],
    "actions": [{"name": "Go", "instance_id": 0, "type": "sync"}],
}
#: A fact as the test knows it: who, which event, of what.
Fact = tuple[str, str, str]


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A server for the module."""
    with running(tmp_path_factory.mktemp("audit") / "data") as found:
        yield found


def start_of(request: str, engine: str) -> dict[str, Any]:
    """The body of a start of the graph."""
    return {
        "version": "v",
        "digest": digest(codec.read(json.dumps(GRAPH).encode()).graph),
        "umrf": GRAPH,
        "engine": engine,
        "request_id": request,
        "script": {"behaviours": {"*": [{"after_s": 60, "stop_s": 0}]}},
    }


class Guest:
    """A browser of a person, who came in by a link."""

    def __init__(self, product: Product, name: str, link: dict[str, Any]) -> None:
        self.product = product
        self.name = name
        self.role: str = link["role"]
        self.http = httpx.Client(
            base_url=product.url, headers={"origin": product.url}, trust_env=False, timeout=30
        )
        proof = link["path"].removeprefix("/#i=")
        answer = self.http.post("/api/session", json={"invitation": proof, "name": name})
        assert answer.status_code == 200, answer.text
        self.id: str = answer.json()["person"]["id"]

    def editor(self, method: str, path: str, **body: Any) -> httpx.Response:
        return self.http.request(method, path, **body)

    def runner(self, method: str, path: str, **body: Any) -> httpx.Response:
        return self.http.request(method, self.product.runner_url + path, **body)


class Week:
    """People who do things, and the facts that this makes."""

    def __init__(self, product: Product, seed: int, browsers: contextlib.ExitStack) -> None:
        self._browsers = browsers
        self.random = random.Random(seed)
        self.product = product
        self.owner = httpx.Client(
            headers={"authorization": f"Bearer {TOKEN}"}, trust_env=False, timeout=30
        )
        browsers.callback(self.owner.close)
        self.facts: Counter[Fact] = Counter()
        self.graphs: list[str] = []
        self.edited: set[tuple[str, str]] = set()  # by whom and what, in this sitting
        self.runs: list[str] = []
        self.number = 0
        self.guests = [self._came(number) for number in range(PEOPLE)]

    def fact(self, who: str, event: str, of: str = "") -> None:
        self.facts[who, event, of] += 1

    def own(self, method: str, path: str, **body: Any) -> httpx.Response:
        return self.owner.request(method, self.product.url + path, **body)

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
        if done.is_success and (guest.id, graph) not in self.edited:
            self.edited.add((guest.id, graph))
            self.fact(guest.id, "audit.edited.v1", graph)

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

    def _look(self, guest: Guest) -> None:
        """Only look: that is no fact of the audit."""
        assert guest.editor("GET", "/api/graphs").is_success
        assert guest.runner("GET", "/api/runs").is_success


def audit(product: Product, *words: str, capfd: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    assert main(["audit", "--json", *words]) == 0
    return [json.loads(line) for line in capfd.readouterr().out.splitlines()]


def test_all_that_20_people_did_is_in_the_audit_and_nothing_else(
    product: Product, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ACTION_ASSISTANT_URL", product.url)
    monkeypatch.setenv("ACTION_ASSISTANT_TOKEN", TOKEN)
    with contextlib.ExitStack() as browsers:
        week = Week(product, SEED, browsers)
        week.live(DEEDS)

    assert product.end() == 0  # which stores what is counted
    product.start()
    told: Counter[Fact] = Counter()
    for row in audit(product, capfd=capfd):
        who = row.get("person")
        if who is None:
            assert row["kind"] in {"strangers", "other"}
            continue
        whence = row.get("from", {})
        assert whence.get("session") or whence.get("token") == "server", row
        if row["event"] != "person.named.v1":  # with the first change that a person makes
            of = row.get("run") or row.get("graph", "")
            told[who["id"], row["event"], of] += row.get("times", 1)
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
