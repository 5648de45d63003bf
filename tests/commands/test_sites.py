"""Commands against a server with two runners, each a real process: robots, runs, Stop of all."""

import json
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from support.command_line import ran
from support.product import Product, frozen
from support.two_sites import HALL_A, HALL_B, SecondRunner, two_sites

ENDLESS = {"behaviours": {"*": [{"never": True}]}}
GRAPH = {
    "graph_name": "lonely",
    "graph_entry": [{"name": "A"}],
    "graph_exit": [{"name": "A"}],
    "actions": [{"name": "A", "type": "sync"}],
}
Halls = tuple[Product, SecondRunner]


@pytest.fixture(scope="module")
def halls(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Halls]:
    """One server with two runners for the module."""
    with two_sites(tmp_path_factory.mktemp("halls")) as found:
        yield found


@pytest.fixture
def endless(tmp_path: Path) -> str:
    """The file of a script in which no action ends."""
    path = tmp_path / "endless.json"
    path.write_text(json.dumps(ENDLESS))
    return str(path)


def started_at(client: Any, name: str) -> str:
    """The id of an endless run on the simulator of a runner."""
    text = json.dumps(GRAPH)
    order = {"version": "", "digest": digest(codec.read(text).graph), "umrf": GRAPH}
    order |= {"engine": "simulator", "request_id": name, "graph": "", "script": ENDLESS}
    answer = client.post("/api/runs", json=order)
    assert answer.is_success, answer.text
    return str(answer.json()["id"])


def state(client: Any, run: str) -> str:
    return str(client.get(f"/api/runs/{run}").json()["state"])


def test_the_page_is_told_of_both_and_may_connect_to_both(halls: Halls) -> None:
    product, second = halls
    with product.editor() as editor:
        config = editor.get("/api/config").json()
        policy = editor.get("/").headers["content-security-policy"]
    assert config["runners"] == [
        {"name": HALL_A, "url": config["runner_url"]},
        {"name": HALL_B, "url": second.url},
    ]
    for url in (product.runner_url, second.url):
        assert f" {url} " in policy
        assert f" {url.replace('http', 'ws')}" in policy
    places = httpx.get(f"{product.url}/api/view", trust_env=False).json()
    assert places["more_runners"] == [second.url]
    with second.client() as client:
        allowed = client.get("/api/robots", headers={"origin": product.url})
    assert allowed.headers["access-control-allow-origin"] == product.url


def test_a_robot_has_one_name_over_all_sites_and_is_listed_with_its_own(halls: Halls) -> None:
    product, second = halls
    added = product.cli("robots", "add", "Ada", "--domain", "181", "--site", "hall b")
    assert added.returncode == 0, added.stderr
    with second.client() as client:
        assert {each["name"] for each in client.get("/api/robots").json()} == {"simulator", "Ada"}
    again = product.cli("robots", "add", "Ada", "--domain", "182")
    assert again.returncode == 1
    assert f"Ada is registered at {HALL_B}" in again.stderr
    listed = product.cli("robots", "list").stdout.splitlines()
    (ada,) = [line for line in listed if line.startswith("Ada ")]
    assert ada.endswith(HALL_B)
    entries = json.loads(product.cli("robots", "list", "--json").stdout)
    assert [each["site"] for each in entries if each["name"] == "Ada"] == [HALL_B]
    nowhere = product.cli("robots", "add", "Eve", "--domain", "183", "--site", "Hall C")
    assert "There is no site called 'Hall C'" in nowhere.stderr
    assert product.cli("robots", "remove", "Ada").returncode == 0
    with second.client() as client:
        assert {each["name"] for each in client.get("/api/robots").json()} == {"simulator"}


def test_a_name_is_not_taken_while_another_site_does_not_say_its_robots(halls: Halls) -> None:
    product, second = halls
    second.end()
    try:
        added = product.cli("robots", "add", "Ben", "--domain", "181")
        listed = product.cli("robots", "list")
    finally:
        second.start()
    assert added.returncode == 1
    assert f"{HALL_B} does not say its robots" in added.stderr
    assert listed.returncode == 1
    assert listed.stdout.startswith("simulator ")
    assert f"{HALL_B} does not answer, and is left out" in listed.stderr


def test_a_start_goes_to_the_runner_of_its_robot_and_never_to_two(
    halls: Halls, tmp_path: Path
) -> None:
    product, _ = halls
    (tmp_path / "graph.json").write_text(json.dumps(GRAPH))
    graph = product.cli("import", str(tmp_path / "graph.json")).stdout.split()[0]
    for name, domain, site in (("Carl", "184", HALL_A), ("Dora", "185", HALL_B)):
        added = product.cli("robots", "add", name, "--domain", domain, "--led", "--site", site)
        assert added.returncode == 0, added.stderr
    one = product.cli("run", graph, "--engine", "Dora", "--no-wait")
    assert one.returncode == 1
    assert "Dora" in one.stderr
    assert "not registered" not in one.stderr
    unknown = product.cli("run", graph, "--engine", "Nobody", "--no-wait")
    assert unknown.returncode == 1
    two = product.cli("run", graph, "--robots", "x=Carl,y=Dora", "--no-wait")
    assert two.returncode == 1
    assert f"of several sites: Carl at {HALL_A}; Dora at {HALL_B}" in two.stderr
    for name in ("Carl", "Dora"):
        assert product.cli("robots", "remove", name).returncode == 0


def test_runs_of_both_are_one_list_by_time_and_one_is_stopped_where_it_is(halls: Halls) -> None:
    product, second = halls
    with product.runner() as first, second.client() as other:
        runs = [started_at(first, "one"), started_at(other, "two"), started_at(first, "three")]
        listed = [line.split()[0] for line in product.cli("runs").stdout.splitlines()]
        assert listed[:3] == runs[::-1]
        stopped = product.cli("stop", runs[1])
        assert (stopped.returncode, stopped.stdout) == (0, f"{HALL_B}: stopped\n"), stopped.stderr
        assert [state(first, runs[0]), state(other, runs[1])] == ["running", "stopped"]
        nowhere = product.cli("stop", "no-such-run")
        assert nowhere.returncode == 1
        assert HALL_A in nowhere.stderr
        everything = product.cli("stop", "--all")
        assert everything.returncode == 0, everything.stderr
        said = set(everything.stdout.splitlines())
        assert said == {f"{HALL_A}: stopped", f"{HALL_B}: nothing was running"}
        assert state(first, runs[2]) == "stopped"


def test_stop_all_is_kept_up_by_no_frozen_runner_which_is_named(halls: Halls) -> None:
    product, second = halls
    with product.runner() as first, second.client() as other:
        here, there = started_at(first, "quick"), started_at(other, "frozen")
        second.signal(signal.SIGSTOP)
        began = time.monotonic()
        process = product.started("stop", "--all")
        try:
            while state(first, here) != "stopped":
                assert time.monotonic() - began < 60
                time.sleep(0.05)
            assert process.poll() is None  # it still asks the frozen one
            out, err = process.communicate(timeout=60)
        finally:
            second.signal(signal.SIGCONT)
            process.kill()
        assert process.returncode == 1
        assert f"{HALL_A}: stopped" in out
        assert f"{HALL_B}: NO ANSWER TO THE STOP." in err
        assert state(other, there) == "running"  # as was said: no Stop has reached it
        assert product.cli("stop", there).returncode == 0


def test_both_are_stopped_without_the_editor(halls: Halls) -> None:
    product, second = halls
    with product.runner() as first, second.client() as other:
        runs = started_at(first, "left"), started_at(other, "right")
        with frozen(product.process("editor")):
            environ = {**product.environment, "ACTION_ASSISTANT_URL": ""}
            stopped = ran("stop", "--all", "--data", str(product.data), environ=environ)
        assert stopped.returncode == 0, stopped.stderr
        assert (state(first, runs[0]), state(other, runs[1])) == ("stopped", "stopped")


def test_a_revocation_is_brought_to_both_and_a_runner_that_is_away_is_named(halls: Halls) -> None:
    product, second = halls
    made = [product.cli("people", "invite", "viewer") for _ in range(2)]
    assert all(each.returncode == 0 for each in made), made[0].stderr
    ids = [line.split()[0] for line in product.cli("people", "list").stdout.splitlines()[-2:]]
    assert product.cli("people", "revoke", ids[0]).returncode == 0
    assert len(list((second.data / "revoked").iterdir())) == 1
    second.end()
    try:
        away = product.cli("people", "revoke", ids[1])
    finally:
        second.start()
    assert away.returncode == 1
    assert f"has not been told: {HALL_B}: No answer" in away.stderr
