"""Hostile texts at every place of both processes that takes a text: refused with the place, nothing
fails.
"""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from editor.process import running as editor_running
from journal.servers import Server
from support import hostile
from support.product import TOKEN, Product, running

BEARER = {"authorization": f"Bearer {TOKEN}"}
#: Controls, overrides of direction and other ends of lines, none of which a name or a note has.
STEERING = ("\x1b[31m", "\u202eevil", "a\u2028b", "\x7f", "\x85", "\u2066x")

#: Fields that hold contents of graphs, and rows of another log that are copied as they are.
CONTENT = {"umrf", "subgraphs", "script", "changes", "editor_audit", "profile", "choices"}
#: Fields that name what exists already, perhaps from an older version or from a file, or that quote a
#: compiler.
EXISTING = {
    *(
        "action",
        "actions",
        "aid",
        "before",
        "codes",
        "continue_from",
        "engine",
        "engines",
        "errors",
    ),
    *("graph", "graphs", "like", "of", "record", "renames", "replace", "robots", "run"),
}
#: Routes whose body is a file of a graph or an action, kept as it is; and Stop, which refuses nothing.
FILES = {
    *("/api/graphs", "/api/graphs/1/umrf", "/api/graphs/1/rewriting", "/api/pieces"),
    *("/api/actions", "/api/actions/1/umrf", "/api/stop", "/api/runs/1/stop"),
}


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A running editor and runner."""
    with running(tmp_path_factory.mktemp("hostile") / "data") as found:
        yield found


def failures(url: str) -> tuple[int, list[Any]]:
    """Return how many hostile requests were sent, and those that the server failed at."""
    failed, sent = [], 0
    with httpx.Client(base_url=url, headers=BEARER, trust_env=False, timeout=30) as client:
        document = client.get("/schema/openapi.json").json()
        for each in hostile.requests(document, every="TEST_LONG" in os.environ):
            headers = {"content-type": "application/json"} if each.content else {}
            with client.stream(
                each.method, each.url, content=each.content, headers=headers
            ) as answer:
                if "event-stream" not in answer.headers.get("content-type", ""):
                    answer.read()
            sent += 1
            if answer.status_code >= 500:
                failed.append((each, answer.status_code))
    return sent, failed


@pytest.mark.parametrize("process", ["editor", "runner"])
def test_no_text_makes_a_process_fail(product: Product, process: str) -> None:
    sent, failed = failures(product.url if process == "editor" else product.runner_url)
    assert failed[:10] == []
    assert sent > 100


def test_no_text_makes_an_editor_on_postgres_fail(postgres: Server, tmp_path: Path) -> None:
    with editor_running(tmp_path / "data", postgres.new_database()) as editor:
        sent, failed = failures(editor.url)
    assert failed[:10] == []
    assert sent > 100


@pytest.mark.parametrize("process", ["editor", "runner"])
def test_no_name_and_no_note_steers_what_shows_it(product: Product, process: str) -> None:
    url = product.url if process == "editor" else product.runner_url
    wrong, seen = [], set()
    with httpx.Client(base_url=url, headers=BEARER, trust_env=False, timeout=30) as client:
        document = client.get("/schema/openapi.json").json()
        for each in hostile.body_texts(document):
            if not (CONTENT | EXISTING).isdisjoint(each.keys) or each.url in FILES:
                continue
            text = STEERING[len(seen) % len(STEERING)]
            answer = client.request(
                each.method, each.url, content=each.filled(json.dumps(text)[1:-1])
            )
            seen.add((each.url, each.keys))
            if answer.status_code == 404:  # its route looks for the run first
                continue
            place = answer.json().get("where", {}).get("path")
            if (
                answer.status_code != 400
                or place is None
                or "control characters" not in answer.text
            ):
                wrong.append((each.method, each.url, each.keys, answer.status_code, answer.text))
    assert wrong[:10] == []
    assert len(seen) > 30


def test_line_breaks_stand_in_notes_and_older_names_are_shown_escaped(product: Product) -> None:
    with product.editor() as editor:
        graph = editor.post("/api/graphs", json={"name": "task"}).json()["id"]
        note = {"label": "one", "note": "first\r\n\tsecond"}
        assert editor.post(f"/api/graphs/{graph}/versions", json=note).status_code == 201
        steering = editor.post("/api/graphs", json={"name": "\u202etask"})
        assert (steering.status_code, steering.json()["where"]) == (400, {"path": "/name"})
        file = {"graph_name": "\u202etask", "actions": []}
        made = editor.post("/api/graphs", json=file)  # a file is kept as it is
        assert made.status_code == 201
        assert editor.get(f"/api/graphs/{made.json()['id']}").json()["name"] == "\u202etask"


def test_numbers_that_no_database_has_are_refused(product: Product) -> None:
    """Each number in an address that both documents name, about things that exist."""
    file = {"graph_name": "task", "actions": [{"name": "Go", "instance_id": 0, "type": "sync"}]}
    ends = {each: [{"name": "Go", "instance_id": 0}] for each in ("graph_entry", "graph_exit")}
    with product.editor() as editor, product.runner() as runner:
        graph = editor.post("/api/graphs", json=file | ends).json()["id"]
        made = editor.post(f"/api/graphs/{graph}/versions", json={}).json()["id"]
        version = editor.get(f"/api/versions/{made}").json()
        start = {key: version[key] for key in ("digest", "umrf")}
        start |= {"version": made, "engine": "simulator", "request_id": "numbers"}
        run = runner.post("/api/runs", json=start).json()["id"]
        action = editor.post("/api/actions", json={"name": "Look", "type": "sync"}).json()["id"]
        runner.post("/api/robots", json={"name": "Rover"}).raise_for_status()
        actions = editor.get(f"/api/graphs/{graph}/document?at=1").json()["actions"]
        values = {"graph_id": graph, "action_id": action, "run": run, "name": "Rover"}
        values |= {"of": next(iter(actions)).partition("|")[0], "field": "name"}
        wrong, asked = [], 0
        for client in (editor, runner):
            document = client.get("/schema/openapi.json").json()
            for method, url, query in hostile.number_requests(document, values):
                answer = client.request(method, url, params=query)
                asked += 1
                if answer.status_code != 400:
                    wrong.append((method, url, query, answer.status_code))
        assert wrong == []
        assert asked > 100
        last = {"last-event-id": f"{1 << 63}"}
        assert editor.get("/api/events", headers=last).status_code == 400
        assert runner.get(f"/api/runs/{run}/events", headers=last).status_code == 400
        for days in ("1e17", "1e300"):
            for field in ("runs", "raw"):
                body = f'{{"{field}": {days}}}'
                assert runner.post("/api/archive", content=body).status_code == 400, body


def test_a_stop_is_read_whatever_stands_beside_it(product: Product) -> None:
    with product.runner() as runner:
        for body in (
            b'{"stop_id": "\\u0000"}',
            b'{"stop_id": "\xff"}',
            b'{"stop_id": "\\ud800"}',
            b"\xff",
        ):
            assert runner.post("/api/stop?why=%00&what=%FF", content=body).status_code == 202, body
