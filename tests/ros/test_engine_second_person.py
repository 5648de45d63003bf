"""The real engine behind the whole product: no start without a second person's yes, and what its code did.

Needs ENGINE_LAB, the folder of a built engine, and UMRF_SHARED, which has the program that starts it.
`TEST_SECOND_PERSON_DOMAIN` is the domain (default 149).
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from support.product import TOKEN, Product, running

DOMAIN = int(os.environ.get("TEST_SECOND_PERSON_DOMAIN", "149"))
PROGRAM = Path(os.environ.get("UMRF_SHARED", "/nonexistent")) / "engine-lab" / "engine"
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

pytestmark = [
    pytest.mark.skipif(
        not os.environ.get("ENGINE_LAB") or not PROGRAM.exists(),
        reason="the real engine is not here (ENGINE_LAB, UMRF_SHARED)",
    ),
    pytest.mark.timeout(240),
]


def until(what: str, true: Callable[[], Any], seconds: float = 40) -> None:
    deadline = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < deadline, what
        time.sleep(0.1)


def browser(product: Product, name: str) -> httpx.Client:
    """Somebody's session, at the runner."""
    body = {"token": TOKEN, "name": name}
    answer = httpx.post(
        f"{product.url}/api/session", json=body, headers={"origin": product.url}, trust_env=False
    )
    assert answer.is_success, answer.text
    cookie = answer.headers["set-cookie"].partition(";")[0]
    headers = {"cookie": cookie, "origin": product.url}
    return httpx.Client(base_url=product.runner_url, headers=headers, trust_env=False, timeout=30)


@contextmanager
def real_engine(folder: Path) -> Iterator[Callable[[], list[str]]]:
    """Yield what the code of the engine's action has done so far, as it wrote it down itself."""
    truth = folder / "truth"
    command = [sys.executable, str(PROGRAM), "David", str(DOMAIN), "--truth", str(truth)]

    def events() -> list[str]:
        lines = truth.read_text().splitlines() if truth.exists() else []
        return [line.split()[2] for line in lines]

    with (folder / "engine.log").open("w") as log:
        engine = subprocess.Popen(command, stdout=log, stderr=log)
    try:
        yield events
    finally:
        engine.kill()
        engine.wait()


def order_of(product: Product) -> dict[str, Any]:
    """What a start of a new graph's version carries."""
    with product.editor() as editor:
        graph = editor.post("/api/graphs", json=GRAPH).json()["id"]
        version = editor.post(f"/api/graphs/{graph}/versions", json={}).json()
    parts = {"digest": version["digest"], "umrf": version["umrf"]}
    return {"version": version["id"], "engine": "David", "graph": graph, **parts}


def start(who: httpx.Client, order: dict[str, Any], number: int) -> httpx.Response:
    return who.post("/api/runs", json=order | {"request_id": f"second {number}"})


def test_its_code_moves_only_after_the_yes_and_not_after_the_stop(tmp_path: Path) -> None:
    with (
        real_engine(tmp_path) as events,
        running(tmp_path / "data") as product,
        browser(product, "Ada") as ada,
        browser(product, "Ben") as ben,
    ):
        robot = {"name": "David", "domain": DOMAIN, "profile": {"second_person": True}}
        assert ada.post("/api/robots", json=robot).is_success
        until("David answers", lambda: _state(ada) == "answering")
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


def _state(runner: httpx.Client) -> str:
    robots = {each["name"]: each for each in runner.get("/api/robots").json()}
    return str(robots.get("David", {}).get("state", ""))
