"""The gate of a led run while 20 people edit: how long after a press of *Wait*, or of Stop, anything begins."""

import json
import math
import os
import random
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Final, NamedTuple

import httpx
import psutil
from peers import Ours, running
from table import Table

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from runner.harness import carousel, order
from runner.process import RunnerProcess, over, started

TITLE = "The gate of a led run in the simulator, while 20 people edit one graph"
PRESSES: Final = int(os.environ.get("BENCH_PRESSES", "300"))  # of each kind
PEOPLE: Final = 20
RATE: Final = 10  # edits of each, per second
_QUICK: Final = {"*": [{"after_s": 0.002}]}
_BEGINS: Final = frozenset({"run.play_began.v1", "run.piece_began.v1"})


class Found(NamedTuple):
    """Times of presses of one kind. `closed`: from the moment before a press was sent until the gate was
    closed, in ms; `last`: until the last action began after that moment, 0 for none; `after`: actions that
    began although the gate was closed."""

    closed: list[float]
    last: list[float]
    after: int


def tables() -> Iterator[Table]:
    """Waits and Stops, alone and while people edit; `edit, %`: the processor time of the editor then."""
    head = [
        "press",
        "n",
        "closed p50, ms",
        "p99, ms",
        "max, ms",
        "last begin p99, ms",
        "begun after",
    ]
    rows = [[*row, ""] for row in _rows("alone")]
    with running(Ours) as editor:
        threading.Thread(target=_edit, args=(editor,), daemon=True).start()
        _await_edits(editor)
        before, began = _processor(editor), time.monotonic()
        edited = list(_rows(f"{PEOPLE} people, {RATE} edits/s each"))
        share = (_processor(editor) - before) / (time.monotonic() - began)
        _await_edits(editor)  # they went on until the end
    yield Table([*head, "edit, %"], [*rows, *([*row, f"{share:.0%}"] for row in edited)])


def _edit(editor: Ours) -> None:
    with suppress(RuntimeError):  # the presses are over, and so the editor was ended
        seconds = 60 + PRESSES * 3
        editor.under(
            "fan out", editor.rooms(1), people=PEOPLE, rate=RATE, seconds=seconds, kind="drag"
        )


def _processor(editor: Ours) -> float:
    times = psutil.Process(editor.pid).cpu_times()
    return float(times.user + times.system)


def _await_edits(editor: Ours) -> None:
    """Wait until the editor works more than a tenth of a second in a second. Raise TimeoutError after 90 s."""
    for _ in range(90):
        before = _processor(editor)
        time.sleep(1)
        if _processor(editor) - before > 0.1:
            return
    raise TimeoutError("Nobody edits.")


def _rows(load: str) -> Iterator[list[str]]:
    with tempfile.TemporaryDirectory() as folder:
        runner = RunnerProcess(Path(folder) / "data").start()
        try:
            with runner.client() as client:
                yield _row(f"Wait, {load}", _waits(client))
                yield _row(f"Stop, {load}", _stops(client))
        finally:
            runner.end()


def _row(name: str, found: Found) -> list[str]:
    closed, last = sorted(found.closed), sorted(found.last)
    figures = (_at(closed, 0.5), _at(closed, 0.99), closed[-1], _at(last, 0.99))
    return [name, str(len(closed)), *(f"{each:.1f}" for each in figures), str(found.after)]


def _at(ordered: Sequence[float], share: float) -> float:
    return ordered[min(len(ordered) - 1, math.ceil(len(ordered) * share) - 1)]


def _begun(client: httpx.Client) -> str:
    request = order(carousel(), engine="conducted", robots={"": "simulator"}, script=_QUICK)
    run: str = started(client, request)["id"]
    return run


def _waits(client: httpx.Client) -> Found:
    """Press *Wait* and *Go on* in turn, in one run whose actions begin all the time."""
    run = _begun(client)
    presses: list[tuple[float, float, float]] = []  # sent, closed and gone on
    for _ in range(PRESSES):
        time.sleep(random.uniform(0.05, 0.2))
        sent = time.time()
        answer = client.post(f"/api/runs/{run}/wait", json={})
        held = answer.raise_for_status().json()["held"]
        time.sleep(0.1)
        gone_on = time.time()
        client.post(f"/api/runs/{run}/go_on", json={"since": held["since"]}).raise_for_status()
        presses.append((sent, datetime.fromisoformat(held["since"]).timestamp(), gone_on))
    client.post(f"/api/runs/{run}/stop").raise_for_status()
    over(client, run)
    return _found(presses, _begins(client, run))


def _stops(client: httpx.Client) -> Found:
    """Press Stop, in a run of its own each time."""
    all_of: list[Found] = []
    for _ in range(PRESSES):
        run = _begun(client)
        time.sleep(random.uniform(0.1, 0.3))
        sent = time.time()
        client.post(f"/api/runs/{run}/stop").raise_for_status()
        over(client, run)
        (closed, *_) = _times(client, run, frozenset({"run.stop_requested.v1"}))
        all_of.append(_found([(sent, closed, math.inf)], _begins(client, run)))
    return Found(
        [ms for each in all_of for ms in each.closed],
        [ms for each in all_of for ms in each.last],
        sum(each.after for each in all_of),
    )


def _found(presses: Sequence[tuple[float, float, float]], begins: Sequence[float]) -> Found:
    last, after = [], 0
    for sent, closed, gone_on in presses:
        later = [at for at in begins if sent < at < gone_on]
        last.append((later[-1] - sent) * 1e3 if later else 0.0)
        after += sum(at > closed for at in later)
    return Found([(closed - sent) * 1e3 for sent, closed, _ in presses], last, after)


def _begins(client: httpx.Client, run: str) -> list[float]:
    return _times(client, run, _BEGINS)


def _times(client: httpx.Client, run: str, kinds: frozenset[str]) -> list[float]:
    """Return when events of these kinds happened in a run that is over, in seconds, in order."""
    lines = client.get(f"/api/runs/{run}/events").text.splitlines()
    told = [json.loads(line.removeprefix("data:")) for line in lines if line.startswith("data:")]
    return [each["body"]["at"] / 1e6 for each in told if each["kind"] in kinds]
