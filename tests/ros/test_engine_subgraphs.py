"""The real engine runs a graph inside of another: the look before the start tells whether it has just that one.

`TEST_SUBGRAPHS_DOMAIN` is the domain (default 150).
"""

import json
import os
from pathlib import Path
from typing import Any

import httpx
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from support.product import Product, running
from support.real_engine import answers, browser, needs_engine, real_engine
from support.waiting import until

DOMAIN = int(os.environ.get("TEST_SUBGRAPHS_DOMAIN", "150"))
ACTIONS = Path(os.environ.get("ENGINE_LAB", "/nonexistent")) / "actions"
INDEXED = ACTIONS / "subgraphs"
INNER = "SubSeq"
OUTER = {
    "graph_name": "around",
    "graph_entry": [{"name": INNER}],
    "graph_exit": [{"name": INNER}],
    "actions": [{"name": INNER, "type": "sync"}],
}

pytestmark = [needs_engine, pytest.mark.timeout(240)]


def order_of(product: Product, graph: str) -> dict[str, Any]:
    """Return the body of a start of a new version of the graph."""
    with product.editor() as editor:
        version = editor.post(f"/api/graphs/{graph}/versions", json={}).json()
    keys = ("digest", "umrf", "subgraphs", "tree_digest")
    parts = {key: version[key] for key in keys}
    parts["subgraphs"] = [
        {key: each[key] for key in ("name", "digest", "umrf")} for each in parts["subgraphs"]
    ]
    return {"version": version["id"], "engine": "David", "graph": graph, **parts}


def item_of(runner: httpx.Client, order: dict[str, Any]) -> dict[str, Any]:
    """Return the pre-flight item about the graphs inside."""
    asked = {key: value for key, value in order.items() if key != "engine"}
    answer = runner.post("/api/preflight", json=asked | {"engines": ["David"]})
    assert answer.is_success, answer.text
    (look,) = answer.json()
    found: dict[str, Any] = next(each for each in look["items"] if each["code"] == "subgraphs")
    return found


def test_indexed_graphs_are_compared_and_their_code_runs_inside(tmp_path: Path) -> None:
    inner = json.loads((INDEXED / f"{INNER}.graph.json").read_text())
    with (
        real_engine(tmp_path, DOMAIN) as events,
        running(tmp_path / "data") as product,
        browser(product, "Ada") as ada,
    ):
        assert ada.post("/api/robots", json={"name": "David", "domain": DOMAIN}).is_success
        until("David answers", lambda: answers(ada, "David"))
        with product.editor() as editor:
            inside = editor.post("/api/graphs", json=inner).json()["id"]
            graph = editor.post("/api/graphs", json=OUTER).json()["id"]
        same = order_of(product, graph)
        assert item_of(ada, same)["verdict"] == "passed"

        run = ada.post("/api/runs", json=same | {"request_id": "nested 1"})
        assert run.status_code == 201, run.text
        path = f"/api/runs/{run.json()['id']}"
        until("it has ended", lambda: ada.get(path).json()["state"] == "finished")
        actions = len(inner["actions"])
        assert [events().count(each) for each in ("begin", "end")] == [actions, actions]

        with product.editor() as editor:
            first = inner["actions"][0]["input_parameters"]["delay"]
            first["pvf_value"] += 1
            seq = editor.get(f"/api/graphs/{inside}").json()["seq"]
            changed = editor.put(f"/api/graphs/{inside}/umrf", params={"seq": seq}, json=inner)
            assert changed.is_success, changed.text
        other = item_of(ada, order_of(product, graph))
        assert (other["verdict"], other["codes"]) == ("blocked", ["subgraph-differs"])


def test_missing_graphs_are_written_into_the_index_and_their_code_runs_inside(
    tmp_path: Path,
) -> None:
    name = "WrittenByAssistant"
    inner = json.loads((INDEXED / f"{INNER}.graph.json").read_text()) | {"graph_name": name}
    outer = json.loads(json.dumps(OUTER).replace(INNER, name).replace("around", "around_written"))
    written: list[str] = []
    with (
        real_engine(tmp_path, DOMAIN) as events,
        running(tmp_path / "data", "--index-folder", f"David={ACTIONS}") as product,
        browser(product, "Ada") as ada,
    ):
        try:
            assert ada.post("/api/robots", json={"name": "David", "domain": DOMAIN}).is_success
            until("David answers", lambda: answers(ada, "David"))
            with product.editor() as editor:
                editor.post("/api/graphs", json=inner)
                graph = editor.post("/api/graphs", json=outer).json()["id"]
            order = order_of(product, graph)
            assert item_of(ada, order)["folder"]["writable"] == [{"graph": name, "replaces": ""}]
            wish = {key: order[key] for key in ("digest", "tree_digest", "subgraphs")}
            answer = ada.post("/api/robots/David/index", json=wish)
            assert answer.is_success, answer.text
            written += [each["path"] for each in answer.json()["written"]]
            until("David has indexed it", lambda: item_of(ada, order)["verdict"] == "passed")

            run = ada.post("/api/runs", json=order | {"request_id": "written 1"})
            assert run.status_code == 201, run.text
            path = f"/api/runs/{run.json()['id']}"
            until("it has ended", lambda: ada.get(path).json()["state"] == "finished")
            actions = len(inner["actions"])
            assert [events().count(each) for each in ("begin", "end")] == [actions, actions]
        finally:
            for each in written:
                (ACTIONS / each).unlink()
