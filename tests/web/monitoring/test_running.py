"""A running product reports its state to Prometheus, to balancers, to owners and to its log."""

import json
import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
import yaml
from prometheus_client.parser import text_string_to_metric_families

from action_assistant.journal.copies import backup_state
from action_assistant.web.auth.keys import Keys
from editor.process import Editor
from editor.process import running as editor_running
from journal.servers import Server, binaries, server
from support.product import TOKEN, Product, running

MONITORING = Path(__file__).parents[3] / "docs/monitoring"
SCRAPE = "scrape-" * 6
#: Series that Prometheus itself makes.
OF_PROMETHEUS = {"up", "ALERTS"}
OWNER = {"authorization": f"Bearer {TOKEN}"}


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """One with a token for scraping, a log of JSON, and backups."""
    data = tmp_path_factory.mktemp("watched") / "data"
    data.mkdir(mode=0o700)
    made = backup_state.BackupMade(
        at=time.time(), file="x.zip", bytes=7, seconds=1.0, version="0.1.0", events={}
    )
    backup_state.made(data, made)
    backup_state.rehearsed(
        data, backup_state.BackupRehearsed(at=time.time(), file="x.zip", bytes=7, seconds=1.0)
    )
    backup_state.scheduled(
        data, backup_state.BackupSchedule(into="b", every=60, keep="3", next=time.time())
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ACTION_ASSISTANT_METRICS_TOKEN", SCRAPE)
        with running(data, "--log-format", "json", "--log-level", "debug") as product:
            yield product


def get(url: str, **headers: str) -> httpx.Response:
    """Ask."""
    return httpx.get(url, headers=headers, trust_env=False, timeout=20)


def told(product: Product) -> dict[str, Any]:
    """Return all metrics of both processes by the names of their families' samples."""
    found = {}
    for url in (product.url, product.runner_url):
        answer = get(f"{url}/metrics", authorization=f"Bearer {SCRAPE}")
        assert answer.headers["content-type"] == "text/plain; version=0.0.4; charset=utf-8"
        for family in text_string_to_metric_families(answer.text):
            assert family.documentation, f"{family.name} has no HELP"
            assert family.type != "unknown", f"{family.name} has no TYPE"
            found[family.name + ("_total" if family.type == "counter" else "")] = family
    return found


def asked_for(text: str) -> set[str]:
    """The metrics that queries name."""
    found = re.findall(r"\b(?:action_assistant|process)_\w+|\bup\b", text)
    return {re.sub(r"_(bucket|count|sum)$", "", name) for name in found}


def test_the_token_for_scraping_opens_metrics_and_nothing_else(product: Product) -> None:
    scrape = {"authorization": f"Bearer {SCRAPE}"}
    for url in (product.url, product.runner_url):
        assert get(f"{url}/metrics", **scrape).status_code == 200
        for path in ("/api/status", "/api/me", "/schema/openapi.json", "/metrics/", "/api/graphs"):
            assert get(url + path, **scrape).status_code == 401, path
        assert httpx.post(f"{url}/metrics", headers=scrape, trust_env=False).status_code == 401
        assert get(f"{url}/metrics", authorization=f"Bearer {SCRAPE[:-1]}").status_code == 401
        assert get(f"{url}/metrics").status_code == 401
        assert get(f"{url}/metrics", **OWNER).status_code == 200


def test_the_list_of_metrics_names_each_and_no_other(product: Product) -> None:
    listed = (MONITORING / "metrics.txt").read_text()
    named = set(re.findall(r"^  (action_assistant_\w+)", listed, re.MULTILINE))
    ours = {name for name in told(product) if name.startswith("action_assistant_")}
    assert named == ours


def test_each_metric_of_the_alerts_and_of_the_dashboard_is_there(product: Product) -> None:
    there = set(told(product)) | OF_PROMETHEUS
    rules = yaml.safe_load((MONITORING / "alerts.yml").read_text())
    expressions = [rule["expr"] for group in rules["groups"] for rule in group["rules"]]
    dashboard = json.loads((MONITORING / "dashboard.json").read_text())
    queries = [
        target["expr"] for panel in dashboard["panels"] for target in panel.get("targets", [])
    ]
    assert len(expressions) > 8
    assert len(queries) > 12
    assert asked_for(" ".join(expressions)) - there == set()
    assert asked_for(" ".join(queries)) - there == set()


def test_panels_of_the_dashboard_do_not_overlap_and_all_have_a_title() -> None:
    dashboard = json.loads((MONITORING / "dashboard.json").read_text())
    taken: set[tuple[int, int]] = set()
    ids = [panel["id"] for panel in dashboard["panels"]]
    assert len(ids) == len(set(ids))
    for panel in dashboard["panels"]:
        place = panel["gridPos"]
        cells = {
            (place["x"] + dx, place["y"] + dy)
            for dx in range(place["w"])
            for dy in range(place["h"])
        }
        assert not cells & taken, panel["title"]
        assert max(x for x, _ in cells) < 24
        taken |= cells
        assert panel["title"]


def started(product: Product) -> str:
    """The id of a run in the simulator that goes on for a minute."""
    umrf = {
        "graph_name": "long",
        "entry": [{"name": "Wait", "instance_id": 0}],
        "exit": [{"name": "Wait", "instance_id": 0}],
        "actions": [{"name": "Wait", "instance_id": 0, "type": "sync"}],
    }
    with product.editor() as editor, product.runner() as runner:
        graph = editor.post("/api/graphs", json=umrf).json()["id"]
        version = editor.post(f"/api/graphs/{graph}/versions", json={}).json()
        asked = {name: version[name] for name in ("digest", "umrf")} | {
            "version": version["id"],
            "engine": "simulator",
            "request_id": "watched",
            "script": {"behaviours": {"*": [{"after_s": 60}]}},
        }
        answer = runner.post("/api/runs", json=asked)
        assert answer.status_code == 201, answer.text
        run: str = answer.json()["id"]
        return run


def test_runs_and_stops_are_counted(product: Product) -> None:
    run = started(product)
    runs = told(product)["action_assistant_runs"].samples
    assert sum(each.value for each in runs if each.labels["engine"] == "simulator") == 1
    with product.runner() as runner:
        runner.post(f"/api/runs/{run}/stop").raise_for_status()
        while runner.get(f"/api/runs/{run}").json()["ended_at"] is None:
            time.sleep(0.05)
    found = told(product)
    for name in ("send", "proof"):
        samples = found[f"action_assistant_stop_{name}_seconds"].samples
        assert [each.value for each in samples if each.name.endswith("_count")] == [1]
    ends = {
        each.labels["end"]: each.value
        for each in found["action_assistant_runs_ended_total"].samples
    }
    assert ends == {"stopped": 1}
    assert all(each.value == 0 for each in found["action_assistant_stops_pending"].samples)
    assert all(each.value == 0 for each in found["action_assistant_stops_unconfirmed"].samples)


def test_a_status_is_for_owners(product: Product) -> None:
    for url, process in ((product.url, "editor"), (product.runner_url, "runner")):
        status = get(f"{url}/api/status", **OWNER).json()
        assert status["process"] == process
        assert status["readiness"]["ready"] is True
        assert status["journal"]["failing"] is None
        session = Keys(TOKEN).sealed(Keys(TOKEN).new_session("Eve", role="operator"))
        cookie = {"cookie": f"aa_{product.port}={session}", "origin": product.url}
        assert get(f"{url}/api/status", **cookie).status_code == 403
        assert get(f"{url}/metrics", **cookie).status_code == 200


def test_doctor_answers_as_the_command_does(product: Product) -> None:
    answer = httpx.get(f"{product.url}/api/doctor", headers=OWNER, trust_env=False, timeout=100)
    assert answer.status_code == 200, answer.text
    assert all(each["code"] and each["remedy"] for each in answer.json())


def test_answers_problems_and_lines_of_the_log_share_an_id(product: Product) -> None:
    for url in (product.url, product.runner_url):
        answer = get(f"{url}/api/runs/nothing", **OWNER, **{"x-request-id": "from-a-stranger"})
        name = answer.headers["x-request-id"]
        assert name != "from-a-stranger"
        assert answer.json()["request_id"] == name
        mine: list[dict[str, Any]] = []
        deadline = time.monotonic() + 30
        while not mine:  # a line is written when the answer has left
            assert time.monotonic() < deadline
            time.sleep(0.02)
            lines = [json.loads(line) for line in product.log.read_text().splitlines()]
            mine = [line for line in lines if line.get("request") == name]
        assert all(line["run"] == "nothing" for line in mine)


def test_every_line_of_every_process_is_json_and_none_has_a_secret(product: Product) -> None:
    bad = {"authorization": f"Bearer {TOKEN}x", "cookie": f"aa_{product.port}={'s' * 50}"}
    for url in (product.url, product.runner_url):
        get(f"{url}/i=abcdefghijkl.{'s' * 43}", **bad)
        get(f"{url}/api/graphs?token={TOKEN}", **bad)
        get(f"{url}/api/%0aforged line/{SCRAPE}", **bad)
    text = product.log.read_text()
    lines = [json.loads(line) for line in text.splitlines()]
    assert {"editor", "runner", "serve"} <= {line["process"] for line in lines}
    for secret in (TOKEN, SCRAPE, "s" * 43):
        assert secret not in text


@pytest.fixture
def mortal() -> Iterator[Server]:
    """A Postgres that a test may freeze."""
    if binaries() is None:
        pytest.skip("Postgres is not installed (Debian: postgresql)")
    with server() as one:
        yield one


def parts(editor: Editor) -> dict[str, str | None]:
    """Return the parts that `/readyz` reports; it has to answer soon."""
    answer = httpx.get(f"{editor.url}/readyz", trust_env=False, timeout=8)
    found: dict[str, str | None] = answer.json()["parts"]
    assert answer.status_code == (503 if any(found.values()) else 200)
    return found


def test_a_frozen_database_is_no_ready_one_and_a_live_process_all_the_same(
    mortal: Server, tmp_path: Path
) -> None:
    with editor_running(tmp_path / "data", mortal.new_database()) as editor:
        assert not any(parts(editor).values())
        for process in mortal.processes():
            process.send_signal(signal.SIGSTOP)
        try:
            time.sleep(1.1)
            frozen = parts(editor)
            assert frozen["database"]
            assert httpx.get(f"{editor.url}/healthz", trust_env=False).status_code == 200
            metrics = get(f"{editor.url}/metrics", **OWNER).text
            assert 'action_assistant_part_ready{part="database"} 0\n' in metrics
        finally:
            for process in mortal.processes():
                process.send_signal(signal.SIGCONT)
        deadline = time.monotonic() + 60
        while any(parts(editor).values()):
            assert time.monotonic() < deadline
            time.sleep(0.2)
