"""Nobody may delay Stop: while many press hard on every route, and strangers on every descriptor.

Real processes: a runner at `ulimit -n 1024`, its load in another process, and somebody who presses
Stop. What the runner itself does between the moment at which a Stop comes in and its answer is its *own
share*: the processor time of all its threads, which it tells with the answer. What is told beside it
also holds the time for which it was ready to go on and others had the processors. `TEST_HOSTILE_STOPS` is how many stops are
pressed (default 20), `TEST_HOSTILE_SILENT` how many strangers say nothing (default 300).
"""

import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import psutil
import pytest
from websockets.sync.client import connect

from action_assistant.web.auth.keys import Keys
from runner.harness import order, sequence
from runner.process import TOKEN, RunnerProcess, body, started
from support.load_on_runner import long_run

STOPS = int(os.environ.get("TEST_HOSTILE_STOPS", "20"))
SILENT = int(os.environ.get("TEST_HOSTILE_SILENT", "300"))
WHOLE = STOPS >= 1_000
CLIENTS = 20
ODD = 'g_state={"i_l":0}; a b=1; lang=\xe9; aa_{port}=planted; '
ENDLESS = {"*": [{"never": True}]}


@pytest.fixture(scope="module")
def runner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunnerProcess]:
    """A runner with a long run and few descriptors."""
    data = tmp_path_factory.mktemp("hostile") / "data"
    long_run(data, events=20_000 if WHOLE else 3_000)
    process = RunnerProcess(data)
    process.start("prlimit", "--nofile=1024:1024")
    yield process
    process.end()


@contextmanager
def load(runner: RunnerProcess, *what: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run all clients that press hard, beside the block."""
    path = Path(__file__).parent
    process = subprocess.Popen(
        [sys.executable, "-m", "support.load_on_runner", str(runner.port), *what],
        env={**os.environ, "PYTHONPATH": str(path)},
        stdout=subprocess.PIPE,
    )
    assert process.stdout is not None
    try:
        assert process.stdout.readline() == b"pressing\n"
        yield process
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


class Share:
    """Processor time of a process, thread by thread, and how long its first thread had to wait for
    a processor (seconds)."""

    def __init__(self, pid: int) -> None:
        self._tasks = Path(f"/proc/{pid}/task")
        self._first = self._tasks / str(pid) / "schedstat"

    def now(self) -> tuple[float, float]:
        total = 0
        for task in self._tasks.iterdir():
            with suppress(OSError):
                total += int((task / "schedstat").read_text().split()[0])
        return total / 1e9, int(self._first.read_text().split()[1]) / 1e9


@contextmanager
def overslept(late: list[float]) -> Iterator[None]:
    """Measure how late an idle process wakes up that sleeps for a millisecond."""
    script = (
        "import time,sys\n"
        "while True:\n"
        " t=time.perf_counter(); time.sleep(.001)\n"
        " print(time.perf_counter()-t-.001, flush=True)\n"
    )
    idle = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE)

    def read() -> None:
        assert idle.stdout is not None
        late.extend(float(line) for line in idle.stdout)

    reader = threading.Thread(target=read)
    reader.start()
    try:
        yield
    finally:
        idle.kill()
        idle.wait()
        reader.join()
        assert idle.stdout is not None
        idle.stdout.close()


def told(name: str, seconds: list[float]) -> tuple[float, float]:
    """Print p50, p99 and the longest; the last two."""
    ordered = sorted(seconds)
    p50, p99 = (ordered[min(len(ordered) - 1, int(len(ordered) * q))] for q in (0.5, 0.99))
    sys.stdout.write(
        f"{name:44} n={len(ordered):5} p50={1e3 * p50:8.2f} p99={1e3 * p99:8.2f} "
        f"max={1e3 * ordered[-1]:8.2f} ms\n"
    )
    return p99, ordered[-1]


def _told(answer: httpx.Response, what: str) -> float:
    """A figure of the answer, in seconds."""
    parts = dict(each.strip().split(";dur=") for each in answer.headers["server-timing"].split(","))
    return float(parts[what]) / 1e3


class Stops:
    """Measures the duration of stops, and the runner's share of it, in seconds."""

    def __init__(self, share: Share) -> None:
        self._share = share
        self._took: list[float] = []
        self._own: list[float] = []
        self._inside: list[float] = []
        self._used: list[float] = []
        self._waited: list[float] = []

    def timed(self, ask: Callable[[], httpx.Response]) -> httpx.Response:
        """One more."""
        cpu, ready = self._share.now()
        began = time.perf_counter()
        answer = ask()
        took = time.perf_counter() - began
        cpu_after, ready_after = self._share.now()
        self._took.append(took)
        self._own.append(_told(answer, "cpu"))
        self._inside.append(_told(answer, "total"))
        self._used.append(min(took, cpu_after - cpu))
        self._waited.append(min(took, ready_after - ready))
        return answer

    def told(self) -> tuple[float, float]:
        """Print all of it; p99 and the longest of the runner's own share."""
        told("click to answer", self._took)
        found = told("the runner's own share of it", self._own)
        told("inside the runner", self._inside)
        told("what it did for everybody meanwhile", self._used)
        told("the runner was ready, others had the CPUs", self._waited)
        return found


def all_stopped(runner: RunnerProcess, runs: list[str]) -> None:
    """Waits until each of them is, a minute at most."""
    with runner.client() as client:
        for run in runs:
            deadline = time.monotonic() + 60
            while client.get(f"/api/runs/{run}").json()["state"] != "stopped":
                assert time.monotonic() < deadline
                time.sleep(0.1)


@pytest.mark.timeout(0)
@pytest.mark.skipif(sys.platform != "linux", reason="asks Linux who used the processors")
def test_stop_is_taken_whatever_everybody_does(runner: RunnerProcess) -> None:
    with runner.client() as client:
        runs = [
            started(client, order(sequence(f"patrol{i}"), script=ENDLESS))["id"] for i in range(8)
        ]
    keys = Keys(TOKEN)
    cookie = f"aa_{runner.port - 1}={keys.sealed(keys.new_session('Ann'))}"
    signed_in = {
        "cookie": ODD.replace("{port}", str(runner.port - 1)) + cookie,
        "origin": f"http://127.0.0.1:{runner.port - 1}",
    }
    shares = Stops(Share(runner.pid))
    late: list[float] = []
    with load(runner, str(SILENT), str(CLIENTS)), overslept(late):
        time.sleep(2)
        base = f"http://127.0.0.1:{runner.port}"
        raw = [(name, value.encode("latin-1")) for name, value in signed_in.items()]
        open_one = httpx.Client(base_url=base, headers=raw, trust_env=False, timeout=60)
        with open_one:
            for number in range(STOPS):
                path = f"/api/runs/{runs[number % len(runs)]}/stop"
                fresh = number % 2 == 0
                asked: Callable[..., httpx.Response] = httpx.post if fresh else open_one.post
                more: dict[str, Any] = (
                    {"headers": raw, "trust_env": False, "timeout": 60} if fresh else {}
                )
                url = f"{base}{path}" if fresh else path
                answer = shares.timed(partial(asked, url, json={"stop_id": str(number)}, **more))
                assert answer.status_code == 202, answer.text
                time.sleep(0.01)
    sys.stdout.write("\n")
    p99, longest = shares.told()
    told("an idle process woke up late by", late)
    if WHOLE:
        assert p99 < 0.05
        assert longest < 0.15
    all_stopped(runner, runs)


@pytest.mark.parametrize("first", [0x89, 0x8A, 0x81], ids=["pings", "pongs", "texts"])
def test_stop_is_taken_while_a_socket_is_flooded(runner: RunnerProcess, first: int) -> None:
    flood = b"".join([bytes((first, 0x80)), bytes(4)]) * 40_000
    taken = 0
    over = threading.Event()
    headers = {"authorization": f"Bearer {TOKEN}"}
    with connect(f"ws://127.0.0.1:{runner.port}/api/live", additional_headers=headers) as page:
        raw = page.socket.dup()

        def push() -> None:
            nonlocal taken
            with suppress(OSError):  # whoever says too much may be sent away
                while not over.is_set():
                    taken += raw.send(flood[taken % 6 :])

        pusher = threading.Thread(target=push)
        pusher.start()
        try:
            with runner.client() as client:
                client.timeout = httpx.Timeout(120)
                for number in range(10):
                    answer = client.post("/api/stop", json={"stop_id": f"f{first}-{number}"})
                    assert answer.status_code == 202
        finally:
            over.set()
            with suppress(OSError):
                raw.shutdown(socket.SHUT_RDWR)
            pusher.join()
            raw.close()
    # The bytes that the kernel keeps, and those handled before ten Stops.
    assert taken < 20_000_000


def _workers(runner: RunnerProcess) -> list[psutil.Process]:
    """Return the living workers, without the process that forks them."""
    workers = []
    for child in psutil.Process(runner.pid).children(recursive=True):
        with suppress(psutil.NoSuchProcess):  # it may die between the two questions
            if child.ppid() != runner.pid:
                workers.append(child)
    return workers


def test_a_start_whose_worker_dies_is_refused_and_nothing_was_sent(runner: RunnerProcess) -> None:
    with runner.client() as client:
        asked = order(sequence("again", 1_500), script=ENDLESS)  # takes a while to be looked at
        before = {run["id"] for run in client.get("/api/runs").json()}
        with ThreadPoolExecutor(1) as person:
            asking = person.submit(client.post, "/api/runs", content=body(asked))
            killed: list[psutil.Process] = []
            while not asking.done():
                for worker in _workers(runner):
                    with suppress(psutil.NoSuchProcess):
                        worker.kill()
                    killed.append(worker)
                time.sleep(0.02)
            answer = asking.result()
        # The next question may not find one that is about to die.
        psutil.wait_procs(killed, timeout=10)
        assert answer.status_code == 503, answer.text
        assert "died" in answer.json()["detail"]
        assert {run["id"] for run in client.get("/api/runs").json()} == before
        run = started(client, asked)
        assert client.post(f"/api/runs/{run['id']}/stop").status_code == 202


def test_bodies_that_are_too_large_are_refused(runner: RunnerProcess) -> None:
    with runner.client() as client:
        for path, size in [
            ("/api/runs", 2_100_001),
            ("/api/runs/x/script", 2_100_001),
            ("/api/preflight", 2_100_001),
            ("/api/groups", 2_100_001),
            ("/api/expectations", 2_100_001),
            ("/api/expectations/check", 2_100_001),
            ("/api/expectations/proposal", 2_100_001),
            ("/api/robots", 100_001),
            ("/api/approvals", 100_001),
        ]:
            assert client.post(path, content=b" " * size).status_code == 413, path
        assert client.post("/api/stop", content=b"x" * 1_000_000).status_code == 202
