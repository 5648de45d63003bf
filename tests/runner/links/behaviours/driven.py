"""Runs with behaviours as a program starts and sees them."""

from typing import Any

import httpx

from action_assistant.umrf.model import Graph
from runner.harness import order
from runner.links.behaviours.written import (
    until,
)
from runner.process import started

QUICK = {"*": [{"after_s": 0.02}]}


def start(client: httpx.Client, graph: Graph, **changes: Any) -> str:
    """A run with behaviours; its id."""
    run = started(client, order(graph, script=QUICK, behaviours=True, **changes))
    assert run["behaviours"] is True
    found: str = run["id"]
    return found


def shown(client: httpx.Client, run: str) -> dict[str, Any]:
    found: dict[str, Any] = client.get(f"/api/runs/{run}").json()
    return found


def moves(client: httpx.Client, run: str, node: str) -> None:
    """Wait until the process of an action is there."""
    until(lambda: shown(client, run)["actions"][node]["state"] == "RUNNING")


def result(run: dict[str, Any], node: str) -> str:
    (visit,) = run["actions"][node]["visits"]
    found: str = visit["result"]
    return found


def messages(run: dict[str, Any], node: str) -> str:
    return "\n".join(each["text"] for each in run["actions"][node]["messages"])
