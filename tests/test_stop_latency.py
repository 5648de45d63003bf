"""A Stop leaves at once after the click, whatever the computer and the editor do.

Real processes. The click is the moment before the request is sent; the message is what the runner
notes when it has handed a stop to the engine's link. `TEST_STOP_CLICKS` is how many for each way and
condition (default 3); with `-s` the figures are printed.
"""

import os
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress

import httpx
import msgspec
import pytest
from websockets.sync.client import connect

from action_assistant.umrf.files import codec
from runner.harness import order, sequence
from runner.process import body
from support.product import TOKEN, Product, running

CLICKS = int(os.environ.get("TEST_STOP_CLICKS", "3"))
ENDLESS = {"*": [{"never": True}]}
#: A file that keeps the editor at work for as long as an update of 8.7 MB.
LARGE = 8_700_000

Press = Callable[[str], None]


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("ACTION_ASSISTANT_LIMITS", "off")
        with running(tmp_path_factory.mktemp("stop") / "data") as product:
            yield product


@contextmanager
def quiet(_: Product) -> Iterator[None]:
    yield


@contextmanager
def both_cores_busy(_: Product) -> Iterator[None]:
    burn = [
        subprocess.Popen([sys.executable, "-c", "while True: pass"])
        for _ in range(2 * (os.cpu_count() or 1))
    ]
    try:
        yield
    finally:
        for each in burn:
            each.kill()
            each.wait()


@contextmanager
def a_large_update(product: Product) -> Iterator[None]:
    """The editor takes in one large graph after the other."""
    text = codec.write(sequence("large", 300))
    graph = msgspec.json.decode(text)
    graph["graph_description"] = "x" * (LARGE - len(text))
    ended, began = threading.Event(), threading.Event()

    def feed() -> None:
        with product.editor() as editor, suppress(httpx.HTTPError):
            while not ended.is_set():
                began.set()
                editor.post("/api/graphs", json=graph)

    thread = threading.Thread(target=feed)
    thread.start()
    began.wait()
    try:
        yield
    finally:
        ended.set()
        thread.join()


@contextmanager
def a_frozen_editor(product: Product) -> Iterator[None]:
    editor = product.process("editor")
    editor.suspend()
    try:
        yield
    finally:
        editor.resume()


@pytest.mark.timeout(0 if CLICKS > 50 else 120)
@pytest.mark.parametrize(
    "condition", [quiet, both_cores_busy, a_large_update, a_frozen_editor], ids=lambda c: c.__name__
)
def test_a_stop_leaves_at_once(
    product: Product, condition: Callable[[Product], Iterator[None]]
) -> None:
    with ExitStack() as stack:
        client = stack.enter_context(product.runner())
        live = stack.enter_context(
            connect(
                f"{product.runner_url.replace('http', 'ws', 1)}/api/live",
                additional_headers={"authorization": f"Bearer {TOKEN}"},
                proxy=None,
                max_size=None,
            )
        )
        threading.Thread(target=lambda: [None for _ in live], daemon=True).start()
        ways: dict[str, Press] = {
            "POST": lambda run: client.post(f"/api/runs/{run}/stop").raise_for_status(),
            "live socket": lambda run: live.send(
                msgspec.json.encode({"type": "stop", "run": run, "stop_id": run}).decode()
            ),
        }
        with condition(product):  # type: ignore[attr-defined]
            for way, press in ways.items():
                took = sorted(_clicked(client, press) for _ in range(CLICKS))
                middle, last = statistics.median(took), took[min(len(took) - 1, CLICKS * 99 // 100)]
                sys.stdout.write(
                    f"\n{condition.__name__:16} {way:12} n={CLICKS} p50={middle:.1f} ms "
                    f"p99={last:.1f} ms max={took[-1]:.1f} ms\n"
                )


def _clicked(client: httpx.Client, press: Press) -> float:
    """Milliseconds from a click on Stop until the message has left for the engine."""
    asked = order(sequence("patrol"), script=ENDLESS)
    run = client.post("/api/runs", content=body(asked)).raise_for_status().json()["id"]
    clicked = time.time_ns()
    press(run)
    deadline = time.monotonic() + 20
    while (found := client.get(f"/api/runs/{run}").json())["state"] != "stopped":
        assert time.monotonic() < deadline, found
        time.sleep(0.01)
    return (_left_at(client, run) * 1000 - clicked) / 1e6


def _left_at(client: httpx.Client, run: str) -> int:
    """Return when the first stop of a run left, in microseconds UTC."""
    told = client.get(f"/api/runs/{run}/events").text.split("\n\n")
    stops = [each for each in told if "event: run.stop_sent.v1" in each]
    data = next(line for line in stops[0].splitlines() if line.startswith("data: "))
    stored = msgspec.json.decode(data.removeprefix("data: "))
    at: int = stored.get("body", stored)["at"]
    return at
