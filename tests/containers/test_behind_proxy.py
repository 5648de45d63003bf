"""The whole installation runs together: editor, Postgres, runner, an emulated robot, and the proxy.

What people and programs do goes through the proxy, by https at one origin; its address is that of a
LAN on which nobody else is.
"""

import asyncio
import contextlib
import json
import random
import ssl
import time
from collections.abc import AsyncIterator, Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import httpx_ws
import pytest
from pycrdt import Doc, Map, Provider
from pycrdt.websocket.websocket import HttpxWebsocket
from websockets.sync.client import connect

from containers.engine import podman, run
from containers.images import say
from containers.stack import Stack, client, command, findings, running, state
from editor.test_kill import Writer

ORIGIN = "https://192.168.77.1"
GRAPH = {
    "graph_name": "pair",
    "graph_entry": [{"name": "A"}],
    "graph_exit": [{"name": "B"}],
    "actions": [
        {"name": "A", "type": "sync", "children": [{"name": "B"}]},
        {"name": "B", "type": "sync", "parents": [{"name": "A"}]},
    ],
}
#: Long enough for hands in a browser.
CHAIN = {
    "graph_name": "chain",
    "graph_entry": [{"name": "Wait", "instance_id": 0}],
    "graph_exit": [{"name": "Wait", "instance_id": 59}],
    "actions": [
        {
            "name": "Wait",
            "instance_id": number,
            "type": "sync",
            "parents": [{"name": "Wait", "instance_id": number - 1}] if number > 0 else [],
            "children": [{"name": "Wait", "instance_id": number + 1}] if number < 59 else [],
        }
        for number in range(60)
    ],
}
SLOW = {"behaviours": {"A": [{"after_s": 0.3}], "B": [{"after_s": 3}]}}
KILLS = 3
_ROBOT = """
services:
  robot:
    command: [simulate-robot, David, --script, /script.json]
    volumes: ["./script.json:/script.json:ro"]
"""


class Proxied:
    """The stack, as it is seen through its proxy."""

    def __init__(self, stack: Stack, folder: Path) -> None:
        self.stack = stack
        self.authority = folder / "authority.pem"
        root = "/data/caddy/pki/authorities/local/root.crt"
        self.authority.write_text(podman("exec", stack.container("proxy"), "cat", root))
        self.trust = ssl.create_default_context(cafile=str(self.authority))
        self.token = stack.token()
        self.headers = {"authorization": f"Bearer {self.token}"}

    @contextlib.contextmanager
    def asked(self, below: str = "") -> Iterator[httpx.Client]:
        """The editor; with `/runner` below it the runner."""
        with client(f"{ORIGIN}{below}", self.token, verify=self.trust) as found:
            yield found

    def cli(self, *words: str) -> str:
        """Return the output of our command line, run on this machine against the proxy."""
        answer = command([*words], ORIGIN, self.token, SSL_CERT_FILE=str(self.authority))
        assert answer.returncode == 0, answer.stdout + answer.stderr
        return answer.stdout

    @contextlib.asynccontextmanager
    async def socket(
        self, graph: str, query: str = ""
    ) -> AsyncIterator[httpx_ws.AsyncWebSocketSession]:
        """Into a room."""
        url = f"{ORIGIN}/api/graphs/{graph}/room{query}"
        async with (
            httpx.AsyncClient(trust_env=False, verify=self.trust) as http,
            httpx_ws.aconnect_ws(url, http, headers=self.headers) as session,
        ):
            yield session


@pytest.fixture(scope="module")
def proxied(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Proxied]:
    settings = {
        "ACTION_ASSISTANT_PUBLIC_URL": f"{ORIGIN}/",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ACTION_ASSISTANT_KEEP_RUNS": "90",
    }
    begun = time.monotonic()
    with running("all", "db", "editor", "runner", "proxy", settings=settings, more=_ROBOT) as stack:
        say(f"db, editor, runner and proxy are ready: {time.monotonic() - begun:.0f} s")
        script = stack.folder / "script.json"
        script.write_text(json.dumps(SLOW))
        stack.up("robot")
        time.sleep(1)  # for the authority of the proxy
        yield Proxied(stack, tmp_path_factory.mktemp("proxy"))


def sorted_by_id(things: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Sort by id, an order that no later change alters."""
    return sorted(things, key=lambda each: str(each["id"]))


def until(true: Callable[[], Any], seconds: float = 60) -> Any:
    """Wait until a condition of other processes is true, and return its value."""
    deadline = time.monotonic() + seconds
    while not (found := true()):
        assert time.monotonic() < deadline
        time.sleep(0.2)
    return found


def test_the_links_lead_to_the_one_origin(proxied: Proxied) -> None:
    lines = proxied.stack.said("editor", "link").split()
    assert [line.partition("#t=")[0] for line in lines] == [
        f"{ORIGIN}/",
        "http://127.0.0.1:8000/",
    ]
    with httpx.Client(base_url=ORIGIN, headers={"origin": ORIGIN}, verify=proxied.trust,
                      trust_env=False) as browser:  # fmt: skip
        assert '<div id="root">' in browser.get("/", headers={"accept": "text/html"}).text
        assert browser.post("/api/session", json={"token": proxied.token}).is_success
        config = browser.get("/api/config").json()
        assert config["runner_url"] == f"{ORIGIN}/runner"
        assert browser.get(f"{ORIGIN}/runner/api/runs").status_code == 200
        cookies = [each for each in browser.cookies.jar if each.name.startswith("aa_")]
        assert [each.secure for each in cookies] == [True, True]  # a session, and this device
    with connect(
        f"{ORIGIN.replace('https', 'wss')}/runner/api/live",
        ssl=proxied.trust,
        additional_headers=proxied.headers,
    ) as live:
        assert json.loads(live.recv(10))["type"] == "hello"


@pytest.mark.parametrize("service", ["editor", "runner"])
def test_every_command_works_as_it_stands_in_each_container(proxied: Proxied, service: str) -> None:
    stack = proxied.stack
    assert stack.token(service) == proxied.token
    assert stack.said(service, "people", "list") == ""
    assert stack.said(service, "stop", "--all") == "nothing was running\n"
    assert stack.said(service, "graphs")
    doctor = stack.execute(service, "action-assistant", "doctor", "--json").stdout
    # An authority of the proxy's own is trusted by nobody until somebody says so.
    assert set(findings(doctor)) == {"certificate-untrusted"}
    begun = time.monotonic()
    stack.said(service, "stop", "--all")
    say(f"`exec {service} action-assistant stop --all`: {time.monotonic() - begun:.1f} s")


def test_the_main_job_in_the_simulator_and_on_a_robot(proxied: Proxied, tmp_path: Path) -> None:
    file = tmp_path / "pair.json"
    file.write_text(json.dumps(GRAPH))
    proxied.cli("import", str(file))
    assert "finished" in proxied.cli("run", "pair")
    with proxied.asked("/runner") as runner:
        made = runner.post("/api/robots", json={"name": "David", "domain": 0})
        assert made.is_success, made.text

        def answering() -> bool:
            robots = runner.get("/api/robots").json()
            return any(
                each["name"] == "David" and "answering" in json.dumps(each) for each in robots
            )

        until(answering)
    ran = proxied.cli("run", "pair", "--engine", "David")
    assert "finished" in ran
    assert (
        findings(
            proxied.stack.execute(
                "runner", "action-assistant", "doctor", "--only", "ros", "--json"
            ).stdout
        )
        == {}
    )


@pytest.mark.parametrize("way", ["proxy", "editor", "runner"])
def test_stop_is_proven_whichever_way_it_comes(proxied: Proxied, way: str) -> None:
    run = proxied.cli("run", "pair", "--engine", "David", "--no-wait").strip()
    with proxied.asked("/runner") as runner:
        until(lambda: runner.get(f"/api/runs/{run}").json()["state"] == "running")
        begun = time.monotonic()
        if way == "proxy":
            assert proxied.cli("stop", "--all") == "stopped\n"
        else:
            assert proxied.stack.said(way, "stop", "--all") == "stopped\n"
        say(f"Stop on a robot by {way}: proven after {time.monotonic() - begun:.1f} s")
        found = runner.get(f"/api/runs/{run}").json()
        assert found["state"] == "stopped"
        assert found["proof_at"]


def test_a_browser_does_the_main_job_and_stops(proxied: Proxied) -> None:
    with proxied.asked() as editor:
        made = editor.post("/api/graphs", json=CHAIN)
        assert made.is_success, made.text
    browser = run(
        "scripts/with-node",
        *("npm", "--prefix", "frontend", "run", "--silent", "e2e", "--", "e2e/containers.spec.ts"),
        more={
            "CONTAINERS_LINK": proxied.stack.said("editor", "link").split()[0],
            "CONTAINERS_GRAPH": made.json()["id"],
        },
    )
    assert "1 passed" in browser.stdout


def test_stop_needs_neither_the_editor_nor_the_database(proxied: Proxied) -> None:
    run = proxied.cli("run", "pair", "--engine", "David", "--no-wait").strip()
    podman("pause", proxied.stack.container("editor"))
    podman("pause", proxied.stack.container("db"))
    try:
        with proxied.asked("/runner") as runner:
            until(lambda: runner.get(f"/api/runs/{run}").json()["state"] == "running")
            assert runner.post("/api/stop").is_success
            until(lambda: runner.get(f"/api/runs/{run}").json()["state"] == "stopped")
    finally:
        podman("unpause", proxied.stack.container("db"))
        podman("unpause", proxied.stack.container("editor"))
    until(lambda: proxied.stack.is_healthy("editor"))


async def test_nothing_acknowledged_or_seen_is_lost_when_the_editor_is_killed(
    proxied: Proxied,
) -> None:
    with proxied.asked() as editor:
        graph = editor.post("/api/graphs", json={"name": "load"}).json()["id"]
    writers = [Writer(name) for name in "abc"]
    for _ in range(KILLS):
        tasks = [asyncio.create_task(writer.write(proxied, graph)) for writer in writers]
        await asyncio.sleep(random.uniform(1, 3))
        proxied.stack.kill("editor")
        await asyncio.wait_for(asyncio.gather(*tasks), 30)
        await asyncio.to_thread(until, lambda: proxied.stack.is_healthy("editor"))
        doc: Doc[Any] = Doc()
        things = doc.get("things", type=Map)
        async with (
            proxied.socket(graph) as session,
            Provider(doc, HttpxWebsocket(session, graph)) as provider,
        ):
            await provider.synced.wait()
            there = set(things)
        for writer in writers:
            must = {f"{writer.name}{number}" for number in range(1, writer.acknowledged + 1)}
            assert writer.acknowledged > 0
            assert must <= there
            assert writer.seen <= there
    say(f"{KILLS} kills of the editor: {sum(each.acknowledged for each in writers)} edits "
        "acknowledged, 0 lost")  # fmt: skip


def test_backups_are_made_by_themselves_and_hold_everything(proxied: Proxied) -> None:
    stack = proxied.stack
    stack.up("backups")
    until(lambda: "proven" in stack.log("backups"))
    assert "missing" not in stack.log("backups")
    (file,) = podman("exec", stack.container("backups"), "ls", "/backups").split()
    rehearsed = stack.execute(
        "backups", "action-assistant", "restore", "--rehearse", f"/backups/{file}"
    )
    assert rehearsed.returncode == 0, rehearsed.stdout + rehearsed.stderr
    with proxied.asked() as editor:  # it looks at them again and again

        def told() -> dict[str, Any]:
            return dict(editor.get("/api/status").json()["backups"])

        until(lambda: told()["proven_at"], 120)
        found = told()
        assert found["made_at"]
        assert found["next_at"]
        assert (found["failed_at"], found["unsound"], found["is_late"]) == (None, None, False)
    say(f"{stack.log('backups').strip()}; rehearsed: {rehearsed.stdout.strip()}")


def test_a_backup_is_restored_into_empty_volumes_as_documented(
    proxied: Proxied, tmp_path: Path
) -> None:
    stack, file = proxied.stack, tmp_path / "monday.zip"
    stack.said("editor", "backup", "/data/monday.zip")
    podman("cp", f"{stack.container('editor')}:/data/monday.zip", file)
    with proxied.asked() as editor, proxied.asked("/runner") as runner:
        before = sorted_by_id(editor.get("/api/graphs").json()), runner.get("/api/runs").json()
    stack.down()
    stack.up("db")
    with file.open("rb") as backup:
        into = ("--entrypoint", "sh", "editor", "-c", "cat >/data/monday.zip")
        stack.compose("run", "--rm", "-T", *into, stdin=backup)
    stack.compose("run", "--rm", "editor", "restore", "/data/monday.zip")
    stack.up("editor", "runner", "proxy", "robot", "backups")
    again = Proxied(stack, tmp_path)
    assert again.token == proxied.token
    proxied.trust, proxied.authority = again.trust, again.authority
    with proxied.asked() as editor, proxied.asked("/runner") as runner:
        assert sorted_by_id(editor.get("/api/graphs").json()) == before[0]
        assert runner.get("/api/runs").json() == before[1]


def test_hardening_holds(proxied: Proxied) -> None:
    for service in ("editor", "runner", "db", "robot", "proxy", "backups"):
        found = state(proxied.stack.container(service))
        assert found["HostConfig"]["ReadonlyRootfs"], service
        rights = found["EffectiveCaps"] or []
        assert rights == (["CAP_NET_BIND_SERVICE"] if service == "proxy" else []), service
        assert "no-new-privileges" in str(found["HostConfig"]["SecurityOpt"]), service
        assert (found["HostConfig"]["Memory"] > 0) == (service != "runner"), service
        assert found["HostConfig"]["PidsLimit"] > 0, service
        assert "10" in found["HostConfig"]["LogConfig"]["Size"], service
    assert proxied.stack.execute("db", "sh", "-c", "ls /sys/class/net").stdout.split() == ["lo"]
    with pytest.raises(httpx.HTTPError):  # without the proxy, on this computer only
        httpx.get("http://192.168.77.1:8000/healthz", trust_env=False, timeout=5)
