"""A robot to practise with, by one press: over rclpy, with the real product."""

import json
import os
import time
from collections.abc import Callable
from pathlib import Path

import httpx
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from support.product import Product, running

GRAPH = {
    "graph_name": "one",
    "graph_entry": [{"name": "A"}],
    "graph_exit": [{"name": "A"}],
    "actions": [{"name": "A", "type": "sync"}],
}


def _until(what: str, is_so: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 30
    while not is_so():
        assert time.monotonic() < deadline, what
        time.sleep(0.1)


def _is_there(product: Product) -> bool:
    """Return whether the process of the robot goes on; its parent is the runner of `product`."""
    for each in Path("/proc").glob("[0-9]*"):
        try:
            words = (each / "cmdline").read_bytes().split(b"\0")
            if (
                b"simulate-robot" in words
                and str(product.data).encode() in (each / "environ").read_bytes()
            ):
                return True
        except OSError:
            continue
    return False


def _states(runner: httpx.Client) -> dict[str, str]:
    return {each["name"]: each["state"] for each in runner.get("/api/robots").json()}


@pytest.mark.timeout(240)
def test_a_practice_robot_is_started_once_ends_with_the_runner_and_is_started_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(os.environ, "PRACTICE_OF", str(tmp_path / "data"))
    (tmp_path / "one.json").write_text(json.dumps(GRAPH))
    with running(tmp_path / "data") as product:
        with product.runner() as runner:
            made = runner.post("/api/practice")
            assert (made.status_code, made.json()["name"]) == (201, "Practice")
            again = runner.post("/api/practice")
            assert (again.status_code, again.json()["type"]) == (409, "conflict")
            _until("it answers", lambda: _states(runner).get("Practice") == "answering")
        graph = product.cli("import", str(tmp_path / "one.json")).stdout.split()[0]
        ran = product.cli("run", graph, "--engine", "Practice")
        assert ran.returncode == 0, ran.stderr
        (run,) = json.loads(product.cli("runs", "--json").stdout)
        log = product.cli("runs", "log", run["id"], "--level", "info")
        assert "info           Received request to start UMRF graph: one" in log.stdout
        assert product.cli("runs", "log", run["id"], "--level", "error").stdout == ""
        assert _is_there(product)
        product.kill()
        _until("its process has ended", lambda: not _is_there(product))
        product.start()
        with product.runner() as runner:
            _until("its absence is seen", lambda: _states(runner).get("Practice") == "gone")
            registered = runner.get("/api/robots/Practice").json()
            again = runner.post("/api/practice")
            assert (again.status_code, again.json()["domain"]) == (201, registered["domain"])
            _until("it answers again", lambda: _states(runner).get("Practice") == "answering")
            third = runner.post("/api/practice")
            assert (third.status_code, third.json()["type"]) == (409, "conflict")
