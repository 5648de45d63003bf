"""The real engine behind the whole product: no start without a second person's yes, and what its code did.

`TEST_SECOND_PERSON_DOMAIN` is the domain (default 149).
"""

import os
import sys
import time
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

DOMAIN = int(os.environ.get("TEST_SECOND_PERSON_DOMAIN", "149"))
INPUTS = {
    "delay": {"pvf_type": "number", "pvf_value": 60},
    "result": {"pvf_type": "string", "pvf_value": "on_true"},
}
GRAPH = {
    "graph_name": "second",
    "graph_entry": [{"name": "OxWork"}],
    "graph_exit": [{"name": "OxWork"}],
    "actions": [{"name": "OxWork", "type": "sync", "input_parameters": INPUTS}],
}

pytestmark = [needs_engine, pytest.mark.timeout(240)]


def order_of(product: Product) -> dict[str, Any]:
    """Return the body of a start of a new graph's version."""
    with product.editor() as editor:
        graph = editor.post("/api/graphs", json=GRAPH).json()["id"]
        version = editor.post(f"/api/graphs/{graph}/versions", json={}).json()
    parts = {"digest": version["digest"], "umrf": version["umrf"]}
    return {"version": version["id"], "engine": "David", "graph": graph, **parts}


def start(who: httpx.Client, order: dict[str, Any], number: int) -> httpx.Response:
    return who.post("/api/runs", json=order | {"request_id": f"second {number}"})


def test_its_code_moves_only_after_the_yes_and_not_after_the_stop(tmp_path: Path) -> None:
    with (
        real_engine(tmp_path, DOMAIN) as events,
        running(tmp_path / "data") as product,
        browser(product, "Ada", is_named=True) as ada,
        browser(product, "Ben", is_named=True) as ben,
    ):
        robot = {"name": "David", "domain": DOMAIN, "profile": {"second_person": True}}
        assert ada.post("/api/robots", json=robot).is_success
        until("David answers", lambda: answers(ada, "David"))
        order = order_of(product)

        assert ada.post("/api/approvals", json={"digest": order["digest"]}).is_success
        refused = start(ada, order, 1)
        assert (refused.status_code, refused.json()["where"]["item"]) == (409, "approved")
        time.sleep(2)
        assert events() == []

        started = start(ben, order, 2)
        assert started.status_code == 201, started.text
        until("its code begins", lambda: events()[:1] == ["begin"])
        run = started.json()["id"]
        assert ben.post(f"/api/runs/{run}/stop", json={"stop_id": "s"}).status_code == 202
        until("it is stopped", lambda: ben.get(f"/api/runs/{run}").json()["state"] == "stopped")
        assert events()[-1] == "end"
        time.sleep(2)
        assert events().count("begin") == 1
        sys.stdout.write(f"what its code did: {', '.join(events())}\n")
