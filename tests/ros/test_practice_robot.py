"""A robot to practise with, by one press: over rclpy, with the real product."""

import json
import os
import time
from collections.abc import Callable
from pathlib import Path

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


@pytest.mark.timeout(240)
def test_a_practice_robot_is_started_once_runs_a_graph_and_ends_with_the_runner(
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
            states = lambda: {e["name"]: e["state"] for e in runner.get("/api/robots").json()}  # noqa: E731
            _until("it answers", lambda: states().get("Practice") == "answering")
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
