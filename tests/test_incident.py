"""A run that is kept as an incident: one file of all that is known of it, and no archive."""

import contextlib
import csv
import hashlib
import io
import json
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from action_assistant.cli import main
from action_assistant.commands.audit import CSV_COLUMNS
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from support.product import TOKEN, Product, running
from support.waiting import until

SCRAPE = "scrape-canary-" + "f" * 40
#: A name that would be a line of its own in a text, a formula in a sheet, a path in a ZIP file.
#: The worst that a name may be: texts that steer are refused in names.
FORMULA = '=HYPERLINK("x") ../../<script>'
HOSTILE = '=HYPERLINK("x")\n../../etc/passwd\u202e<script>'


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A server for the module, which has each kind of secret."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ACTION_ASSISTANT_METRICS_TOKEN", SCRAPE)
        with running(tmp_path_factory.mktemp("incident") / "data") as found:
            yield found


@pytest.fixture(autouse=True)
def there(product: Product, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command line finds this server."""
    monkeypatch.setenv("ACTION_ASSISTANT_URL", product.url)
    monkeypatch.setenv("ACTION_ASSISTANT_TOKEN", TOKEN)


@contextlib.contextmanager
def owner(product: Product) -> Iterator[httpx.Client]:
    """The owner, as a browser with a cookie of their own."""
    with httpx.Client(
        base_url=product.url, headers={"origin": product.url}, trust_env=False, timeout=60
    ) as http:
        http.post("/api/session", json={"token": TOKEN, "name": FORMULA}).raise_for_status()
        yield http


def start(http: httpx.Client, product: Product, name: str, request: str) -> str:
    umrf = {
        "graph_name": name,
        "graph_description": HOSTILE,
        "graph_entry": [{"name": "Go", "instance_id": 0}],
        "graph_exit": [{"name": "Go", "instance_id": 0}],
        "actions": [{"name": "Go", "instance_id": 0, "type": "sync"}],
    }
    body = {
        "version": "v1",
        "digest": digest(codec.read(json.dumps(umrf).encode()).graph),
        "umrf": umrf,
        "engine": "simulator",
        "request_id": request,
        "script": {"behaviours": {"*": [{"after_s": 0.05}]}},
    }
    answer = http.post(f"{product.runner_url}/api/runs", json=body)
    assert answer.status_code == 201, answer.text
    run: str = answer.json()["id"]
    path = f"{product.runner_url}/api/runs/{run}"
    until("the run is over", lambda: http.get(path).json()["ended_at"])
    return run


def test_the_file_holds_everything_sound_and_no_secret(
    product: Product, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with owner(product) as http:
        link = http.post("/api/invitations", json={"role": "operator"}).json()
        run = start(http, product, "Pick and place", "r1")
        cookies = [cookie.value for cookie in http.cookies.jar]
    out = tmp_path / "incident.zip"
    words = ["incident", run, "--out", str(out)]
    assert main([*words, "--reason", FORMULA]) == 0
    assert main(words) == 2  # it is there already
    capfd.readouterr()
    with zipfile.ZipFile(out) as file:
        parts = {name: file.read(name) for name in file.namelist()}
    assert all(".." not in name and "\n" not in name for name in parts)
    sums = dict(line.split("  ")[::-1] for line in parts.pop("SHA256SUMS").decode().splitlines())
    assert sums == {name: hashlib.sha256(part).hexdigest() for name, part in parts.items()}
    title = json.loads(parts["incident.json"])
    assert (title["run"], title["reason"], title["is_over"]) == (run, FORMULA, True)
    assert title["streams"][0]["is_sound"] is True
    assert title["software"]["version"]
    events = [json.loads(line) for line in parts["events/000.jsonl"].splitlines()]
    assert [each["seq"] for each in events] == [*range(1, title["streams"][0]["events"] + 1)]
    assert events[-1]["chain"] == title["streams"][0]["stored"]
    assert json.loads(parts["graphs/000.umrf.graph.json"])["graph_description"] == HOSTILE
    rows = json.loads(parts["audit.json"])
    assert any(row["event"] == "run.requested.v1" and row["run"] == run for row in rows)
    assert any(
        row["event"] == "invitation.made.v1" for row in json.loads(parts["audit-of-editor.json"])
    )
    with owner(product) as http:  # the editor was told to keep its part
        kept = http.get("/api/audit", params={"kind": "starts"}).json()["rows"]
    assert (kept[0]["event"], kept[0]["run"]) == ("audit.kept.v1", run)
    readme = parts["README.txt"].decode()
    assert "all events are what was written" in readme
    assert not [line for line in readme.splitlines() if line.startswith((".", "=", "<"))]
    assert "\u202e" not in readme
    secrets = [TOKEN, SCRAPE, link["path"].partition(".")[2], *filter(None, cookies)]
    whole = b"".join(parts.values())
    assert len(secrets) >= 4
    assert [each for each in secrets if each.encode() in whole] == []


def test_an_incident_is_never_archived(product: Product, tmp_path: Path) -> None:
    with owner(product) as http:
        kept = start(http, product, "kept", "r2")
        other = start(http, product, "other", "r3")
        http.post(f"{product.runner_url}/api/runs/{kept}/incident", json={}).raise_for_status()

        def archived(run: str) -> Any:
            return http.get(f"{product.runner_url}/api/runs/{run}").json()["archived"]

        def swept() -> bool:
            body = {"runs": 0}
            http.post(f"{product.runner_url}/api/archive", json=body).raise_for_status()
            return archived(other) is not None

        until("the other run is archived", swept)
        assert archived(kept) is None
        answer = http.post(f"{product.runner_url}/api/runs/{other}/incident", json={})
        with zipfile.ZipFile(io.BytesIO(answer.content)) as file:  # it is read from its archive
            title = json.loads(file.read("incident.json"))
        assert title["streams"][0]["is_sound"] is True


def test_only_owners_keep_incidents(product: Product) -> None:
    with owner(product) as http:
        run = start(http, product, "mine", "r4")
        link = http.post("/api/invitations", json={"role": "operator"}).json()
    with httpx.Client(
        base_url=product.url, headers={"origin": product.url}, trust_env=False, timeout=60
    ) as guest:
        proof = link["path"].removeprefix("/#i=")
        guest.post("/api/session", json={"invitation": proof, "name": "Ben"}).raise_for_status()
        path = f"{product.runner_url}/api/runs/{run}/incident"
        assert guest.post(path, json={}).status_code == 403
        assert guest.get("/api/audit").status_code == 403
        events = guest.get(f"{product.runner_url}/api/runs/{run}/export?format=jsonl").text
        assert '"from"' not in events  # the connections of others are for owners


def test_no_cell_of_the_csv_is_a_formula(
    product: Product, capfd: pytest.CaptureFixture[str]
) -> None:
    with owner(product) as http:
        made = http.post("/api/graphs", json={"name": HOSTILE.partition("\n")[0]})
        assert made.status_code == 201, made.text
    capfd.readouterr()
    assert main(["audit", "--csv"]) == 0
    header, *rows = csv.reader(io.StringIO(capfd.readouterr().out, newline=""))
    assert tuple(header) == CSV_COLUMNS
    assert any("HYPERLINK" in cell for row in rows for cell in row)
    assert not [cell for row in rows for cell in row if cell.startswith(("=", "+", "-", "@", "\t"))]
