"""The real engine behind the whole product: a graph that others started is stopped, and what its code did.

The action takes three seconds to obey, of the five that its engine waits. Whoever says "stopped" before its code has ended is wrong.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from ros.robots import started_by_others
from support.product import Product, running
from support.real_engine import answers, browser, needs_engine, real_engine
from support.waiting import until

SLOW = {
    "graph_name": "theirs",
    "graph_entry": [{"name": "OxSlowStop"}],
    "graph_exit": [{"name": "OxSlowStop"}],
    "actions": [
        {
            "name": "OxSlowStop",
            "type": "sync",
            "input_parameters": {
                "delay": {"pvf_type": "number", "pvf_value": 120},
                "stop_time": {"pvf_type": "number", "pvf_value": 3},
            },
        }
    ],
}

pytestmark = [needs_engine, pytest.mark.timeout(240)]


def held(runner: httpx.Client) -> list[dict[str, Any]]:
    """Return the graphs that David holds."""
    found: list[dict[str, Any]] = runner.get("/api/robots/David").json()["holds"]
    return found


def told(runner: httpx.Client) -> list[str]:
    """Return the stop events in David's log, oldest first."""
    lines = runner.get("/api/robots/David/events").json()
    return [each["kind"] for each in reversed(lines) if each["kind"].startswith("stop_")]


@contextmanager
def moving(
    domain: int, tmp_path: Path
) -> Iterator[tuple[Callable[[], list[str]], Product, httpx.Client]]:
    """Start a graph of others on a real engine, with the product and a signed-in browser beside
    it."""
    with (
        real_engine(tmp_path, domain) as events,
        running(tmp_path / "data") as product,
        browser(product, "Ada") as ada,
    ):
        assert ada.post("/api/robots", json={"name": "David", "domain": domain}).is_success
        until("David answers", lambda: answers(ada, "David"))
        with started_by_others(domain, SLOW):
            until("it moves", lambda: any(each["active"] for each in held(ada)))
            assert events() == ["begin"]
            yield events, product, ada


def test_stop_all_succeeds_when_the_code_has_ended(domain: int, tmp_path: Path) -> None:
    with moving(domain, tmp_path) as (events, product, _):
        said = product.cli("stop", "--all", "--wait", "30")
        assert events() == ["begin", "stop", "end"]
        assert (said.returncode, said.stdout) == (0, "stopped\n"), said


def test_a_runner_that_was_killed_goes_on_until_its_code_has_ended(
    domain: int, tmp_path: Path
) -> None:
    with moving(domain, tmp_path) as (events, product, ada):
        assert ada.post("/api/stop").json()["graphs"] == {"David": ["theirs"]}
        until("its code is told", lambda: "stop" in events())
        until("it is written down", lambda: told(ada) == ["stop_asked"])
        product.kill()
        product.start()
        with browser(product, "Ada") as back:
            until("it is proven", lambda: told(back) == ["stop_asked", "stop_proven"])
            assert events() == ["begin", "stop", "end"]
            assert all(each["stopping"] is None for each in held(back))
