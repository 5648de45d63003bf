"""Measure how long others' edits wait while the largest graph allowed is imported, and while each of its routes is called.

An editor in a process of its own; somebody edits a small graph, 100 times a second, whether or not the edits
before are acknowledged. `python largest.py` prints the tables; `PROBE_DATABASE` names a Postgres database.
"""

import asyncio
import json
import os
import random
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Final

import httpx
import uvloop
from load import edits_of
from table import Table, show
from yjs_socket import Person, Plan

ROOT: Final = Path(__file__).resolve().parent.parent
TOKEN: Final = "largest-graph-bench-token-0123456789"
BEARER: Final = {"authorization": f"Bearer {TOKEN}"}
EVERY_S: Final = 0.01  # between two edits
LEAST_S: Final = 3.0  # for which a route is watched
CALLS: Final = 3
SETTLED_S: Final = 120.0  # after an import, at most


def largest(actions: int, arrows: int, seed: int = 1) -> bytes:
    """A UMRF file with so many actions, each with parameters, and so many arrows."""
    dice = random.Random(seed)
    names = [{"name": f"Act{n}", "instance_id": 0} for n in range(actions)]
    ends: set[tuple[int, int]] = {(n, n + 1) for n in range(actions - 1)}
    while len(ends) < arrows - 2:  # entry and exit are two more
        first, second = sorted(dice.sample(range(actions), 2))
        ends.add((first, second))
    made: list[dict[str, Any]] = [
        {
            **name,
            "type": "sync",
            "description": f"Moves the {n}. time",
            "input_parameters": {"speed": {"pvf_type": "number", "pvf_value": n}},
            "parents": [],
            "children": [],
        }
        for n, name in enumerate(names)
    ]
    for first, second in sorted(ends):
        made[first]["children"].append({**names[second], "conditions": ["on_true -> run"]})
        made[second]["parents"].append({**names[first], "conditions": ["on_true -> run"]})
    graph = {
        "graph_name": "Largest",
        "actions": made,
        "graph_entry": [names[0]],
        "graph_exit": [{**names[-1], "conditions": ["on_true -> run"]}],
    }
    return json.dumps(graph).encode()


class Prober(Person):
    """Edits a small graph, and notes how long each edit waits for its acknowledgement."""

    def __init__(self, plan: Plan, room: str) -> None:
        self.plan, self.ending, self.lost = plan, False, 0
        super().__init__(self, 0, room)
        self.delays: list[tuple[float, float]] = []  # when an edit was due, and how long it waited
        self._pending: list[tuple[int, float]] = []
        self._edits = edits_of(0, 60_000, "drag")
        self._nth = 0

    def heard(self, person: Person, data: bytes) -> None:
        """Ignore what others do."""

    def _take(self, data: bytes) -> None:
        super()._take(data)
        now = time.monotonic()
        while self._pending and self._pending[0][0] <= self.acknowledged:
            due = self._pending.pop(0)[1]
            self.delays.append((due, now - due))

    async def work(self) -> None:
        """Edit at a steady pace until cancelled: a delay does not make the next edit come later."""
        due = time.monotonic()
        while True:
            due += EVERY_S
            await asyncio.sleep(max(0.0, due - time.monotonic()))
            before, after = self._edits[self._nth]
            self._nth += 1
            self.edit(before + b"%019d" % time.monotonic_ns() + after)
            self._pending.append((self.sent, due))

    async def during(self, work: Callable[[], Awaitable[str]]) -> tuple[list[float], str]:
        """The delays of the edits that were made while `work` went on, and what that returned."""
        self.delays = []
        begun = time.monotonic()
        said = await work()
        ended = time.monotonic()
        while self._pending and self._pending[0][1] <= ended:  # noqa: ASYNC110 - nobody tells
            await asyncio.sleep(0.01)
        return sorted(delay for due, delay in self.delays if begun <= due <= ended), said


async def called(url: str, route: str, body: bytes | None = None, method: str = "") -> float:
    """Call a route from another process, so that reading the answer delays no edit; the seconds it took."""
    words = [
        "curl",
        "-sS",
        "--fail-with-body",
        "-o",
        os.devnull,
        "-w",
        "%{http_code} %{time_total}",
    ]
    words += ["-H", f"authorization: Bearer {TOKEN}", "--max-time", "120", url + route]
    if method:
        words += ["-X", method]
    if body is not None:
        words += ["-H", "content-type: application/json", "--data-binary", "@-"]
    pipe = asyncio.subprocess.PIPE
    curl = await asyncio.create_subprocess_exec(*words, stdin=pipe, stdout=pipe)
    out, _ = await curl.communicate(body)
    status, took = out.decode().split()
    if not status.startswith("2"):
        raise RuntimeError(f"{route}: {status}")
    return float(took)


async def _watched(url: str, route: str, body: bytes | None, method: str = "") -> str:
    """Call a route some times."""
    begun, times = time.monotonic(), []
    while len(times) < CALLS or time.monotonic() - begun < LEAST_S:
        times.append(await called(url, route, body, method))
    return f"{sorted(times)[len(times) // 2]:.2f} s"


async def _opened(plan: Plan, graph: str) -> str:
    """Open the room of a graph, as a page does, some times."""
    begun, times = time.monotonic(), []
    while len(times) < CALLS or time.monotonic() - begun < LEAST_S:
        # In another process: to take the document in would delay the edits of this one.
        code = (
            "import asyncio,sys,json\n"
            f"sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
            "from largest import join\n"
            "print(asyncio.run(join(json.loads(sys.argv[1]), sys.argv[2])))"
        )
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-c", code, json.dumps(plan), graph, stdout=asyncio.subprocess.PIPE
        )
        out, _ = await process.communicate()
        times.append(float(out))
        await asyncio.sleep(6.5)  # until the room is left alone, so that it is loaded again
    return f"{sorted(times)[len(times) // 2]:.2f} s"


async def join(plan: list[Any], graph: str) -> float:
    """Join a room once; the seconds until the document is there."""
    person = Prober(Plan(*plan), graph)
    begun = time.monotonic()
    await asyncio.get_running_loop().create_connection(
        lambda: person, "127.0.0.1", person.plan.port
    )
    await asyncio.wait_for(person.synced, 60)
    took = time.monotonic() - begun
    person.ending = True
    person.transport.abort()
    return took


def _row(what: str, delays: list[float], idle: float, said: str) -> list[str]:
    at = [delays[min(len(delays) - 1, int(len(delays) * share))] * 1e3 for share in (0.5, 0.99, 1)]
    figures = [f"{each:.1f} ms" for each in at]
    return [what, said, str(len(delays)), *figures, f"{at[1] - idle:+.1f} ms"]


def routes_of(graph: str, first: str, seq: int) -> list[tuple[str, str, bytes | None]]:
    """The routes that take a graph, and which may take long with a large one: method, path, body."""
    g = f"/api/graphs/{graph}"
    extraction = json.dumps({"actions": [first], "name": "Part"}).encode()
    since = json.dumps({"good": 1, "script": {"behaviours": {}}}).encode()
    return [
        ("GET", g, None),
        ("GET", f"{g}/umrf", None),
        ("GET", f"{g}/umrf?at=1", None),
        ("GET", f"{g}/problems", None),
        ("GET", f"{g}/document?at={seq}", None),
        ("GET", f"{g}/document?at=1", None),
        ("GET", f"{g}/changes?after=0&upto={seq}", None),
        ("GET", f"{g}/diff?from=1", None),
        ("GET", f"{g}/history", None),
        ("GET", f"{g}/blame?of={first}", None),
        ("GET", f"{g}/blame/values?of={first}&field=", None),
        ("POST", f"{g}/since", since),
        ("GET", f"{g}/versions", None),
        ("GET", f"{g}/subgraphs", None),
        ("GET", f"{g}/flat", None),
        ("POST", f"{g}/extraction", extraction),
        ("POST", f"{g}/rehearsal", json.dumps({"script": {"behaviours": {}}}).encode()),
        ("GET", f"{g}/packages", None),
        ("GET", f"{g}/drafts", None),
        ("GET", "/api/actions", None),
        ("GET", "/api/actions/graphs", None),
        ("PATCH", g, json.dumps({"name": "Largest"}).encode()),
        ("POST", f"{g}/restore", json.dumps({"seq": 1}).encode()),
    ]


@asynccontextmanager
async def _editor(folder: Path) -> AsyncIterator[tuple[str, int, int]]:
    """An editor that runs: its address, port and process."""
    port = int(os.environ.get("PROBE_PORT", "8171"))
    words = [sys.executable, "-m", "action_assistant", "editor"]
    words += ["--data", str(folder / "data"), "--port", str(port)]
    if database := os.environ.get("PROBE_DATABASE"):
        words += ["--database", database]
    env = {**os.environ, "ACTION_ASSISTANT_TOKEN": TOKEN}
    with (folder / "log").open("wb") as log:
        process = await asyncio.create_subprocess_exec(*words, env=env, stdout=log, stderr=log)
    url = f"http://127.0.0.1:{port}"
    try:
        async with httpx.AsyncClient(base_url=url, trust_env=False) as http:
            for _ in range(300):
                try:
                    if (await http.get("/readyz")).status_code == 200:
                        break
                except httpx.TransportError:
                    pass
                await asyncio.sleep(0.1)
        yield url, port, process.pid
    finally:
        process.terminate()
        await process.wait()
        sys.stderr.write((folder / "log").read_text()[-2000:])


async def measured(actions: int, arrows: int) -> list[list[str]]:
    """One row for each thing that was done with a graph of this size."""
    only = sys.argv[1:] if __name__ == "__main__" else []
    with tempfile.TemporaryDirectory() as name:
        async with (
            _editor(Path(name)) as (url, port, pid),
            httpx.AsyncClient(base_url=url, headers=BEARER, trust_env=False, timeout=120) as http,
        ):
            small = (await http.post("/api/graphs", json={"name": "small"})).json()["id"]
            plan = Plan(
                port, pid, "plain", "/api/graphs/{room}/room?acks=1", [small],
                [f"Authorization: Bearer {TOKEN}"], "one by one",
            )  # fmt: skip
            prober = Prober(plan, small)
            loop = asyncio.get_running_loop()
            await loop.create_connection(lambda: prober, "127.0.0.1", port)
            await prober.synced
            await asyncio.sleep(4)
            working = asyncio.create_task(prober.work())
            try:
                return await _rows(prober, http, url, plan, largest(actions, arrows), only)
            finally:
                working.cancel()
                prober.ending = True


async def _rows(
    prober: Prober, http: httpx.AsyncClient, url: str, plan: Plan, file: bytes, only: list[str]
) -> list[list[str]]:
    async def nothing() -> str:
        await asyncio.sleep(2 * LEAST_S)
        return ""

    delays, _ = await prober.during(nothing)
    idle = delays[int(len(delays) * 0.99)] * 1e3
    rows = [_row("nothing", delays, idle, "")]

    async def bring() -> str:
        return f"{await called(url, '/api/graphs', file):.2f} s"

    delays, said = await prober.during(bring)
    rows.append(_row(f"import of {len(file) / 1e6:.1f} MB", delays, idle, said))
    sys.stderr.write(f"{rows[-1]}\n")
    (graph,) = [g["id"] for g in (await http.get("/api/graphs")).json() if g["name"] == "Largest"]

    async def settle() -> str:
        begun = time.monotonic()
        await asyncio.sleep(float(os.environ.get("PROBE_AFTER", "60")))
        return f"{time.monotonic() - begun:.0f} s"

    delays, said = await prober.during(settle)
    rows.append(_row("after it", delays, idle, said))
    sys.stderr.write(f"{rows[-1]}\n")
    await http.patch(f"/api/graphs/{graph}", json={"description": "edited"})
    await asyncio.sleep(7)
    seq = (await http.get(f"/api/graphs/{graph}")).json()["seq"]
    document = (await http.get(f"/api/graphs/{graph}/document?at={seq}")).json()
    first = next(key for key in document["actions"] if "|" not in key)
    del document
    for method, path, body in routes_of(graph, first, seq):
        shown = f"{method} {path.replace(graph, '{id}').replace(first, '{key}')}"
        if only and not any(word in shown for word in only):
            continue
        delays, said = await prober.during(lambda: _watched(url, path, body, method))  # noqa: B023
        rows.append(_row(shown, delays, idle, said))
        sys.stderr.write(f"{rows[-1]}\n")
    if not only or "open" in only:
        delays, said = await prober.during(lambda: _opened(plan, graph))
        rows.append(_row("opening it in a page", delays, idle, said))
        sys.stderr.write(f"{rows[-1]}\n")
    return rows


def tables() -> Iterator[Table]:
    """The delays with the largest graph."""
    rows = uvloop.run(measured(5_000, 20_000))
    yield Table(["meanwhile", "took", "edits", "p50", "p99", "longest", "p99 over idle"], rows)


if __name__ == "__main__":
    for table in tables():
        show(table)
