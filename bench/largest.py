"""Measure how long others' edits wait while the largest graph allowed is imported, and while each of its routes is called.

An editor in a process of its own; somebody edits a small graph, 100 times a second, whether or not the edits
before are acknowledged. Seconds in which nothing else happens alternate with calls, so that both see the same machine.
`python largest.py` prints the tables, `python largest.py WORD ...` the rows with one of these words in them;
`PROBE_DATABASE` names a Postgres database, `PROBE_FOLDER` a folder whose graphs are kept for the next run.
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
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar

import httpx
import uvloop
from load import edits_of
from table import Table, show
from yjs_socket import Person, Plan

T = TypeVar("T")

ROOT: Final = Path(__file__).resolve().parent.parent
TOKEN: Final = "largest-graph-bench-token-0123456789"
BEARER: Final = {"authorization": f"Bearer {TOKEN}"}
EVERY_S: Final = 0.01  # between two edits
LEAST_S: Final = 4.0  # for which a route is watched, and for which nothing else happens
CALLS: Final = 4
MOST_CALLS: Final = 12  # of a route that answers at once
BESIDE_S: Final = 1.5  # without anything, before each call


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

    async def during(self, work: Awaitable[T]) -> tuple[list[float], T]:
        """The delays of the edits that were made while `work` went on, and what that returned."""
        self.delays = []
        begun = time.monotonic()
        said = await work
        ended = time.monotonic()
        while self._pending and self._pending[0][1] <= ended:  # noqa: ASYNC110 - nobody tells
            await asyncio.sleep(0.01)
        return [delay for due, delay in self.delays if begun <= due <= ended], said

    async def compared(self, what: str, call: Callable[[], Awaitable[float]]) -> list[str]:
        """One row: the delays while something is called again and again, and those between the calls."""
        beside: list[float] = []
        meanwhile: list[float] = []
        times: list[float] = []
        while len(times) < CALLS or (sum(times) < LEAST_S and len(times) < MOST_CALLS):
            beside += (await self.during(asyncio.sleep(BESIDE_S)))[0]
            delays, took = await self.during(call())
            meanwhile += delays
            times.append(took)
        return _row(what, meanwhile, beside, times)


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


async def _opened(plan: Plan, graph: str) -> float:
    """Open the room of a graph, as a page does, and leave it; the seconds until the document was there."""
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
    return float(out)


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


def _row(what: str, delays: list[float], beside: list[float], times: list[float]) -> list[str]:
    idle, (middle, late, longest) = _ms_at(beside, 0.99)[0], _ms_at(delays, 0.5, 0.99, 1)
    figures = [f"{each:.1f} ms" for each in (idle, middle, late, longest)]
    took = f"{sorted(times)[len(times) // 2]:.2f} s"
    load = f"{os.getloadavg()[0]:.1f}"
    row = [what, took, str(len(delays)), *figures, f"{late - idle:+.1f} ms", load]
    sys.stderr.write(f"{row}\n")
    return row


def _ms_at(delays: list[float], *shares: float) -> list[float]:
    """The delays in ms that these shares of all delays do not exceed."""
    delays = sorted(delays)
    return [delays[min(len(delays) - 1, int(len(delays) * share))] * 1e3 for share in shares]


def routes_of(graph: str, first: str, seq: int, draft: str) -> list[tuple[str, str, bytes | None]]:
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
        ("GET", f"{g}/packages.zip", None),
        ("GET", f"{g}/drafts", None),
        ("POST", f"{g}/drafts", json.dumps({"name": f"another {time.time()}"}).encode()),
        ("GET", f"/api/drafts/{draft}", None),
        ("POST", f"/api/drafts/{draft}/preview", b"{}"),
        ("POST", f"{g}/versions", json.dumps({"note": "one"}).encode()),
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
        folder = Path(os.environ.get("PROBE_FOLDER", name))
        async with (
            _editor(folder) as (url, port, pid),
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


async def _largest_there(http: httpx.AsyncClient) -> str:
    """Return the id of the graph that was imported; an empty text where it was not."""
    graphs = (await http.get("/api/graphs")).json()
    return next((graph["id"] for graph in graphs if graph["name"] == "Largest"), "")


async def _rows(
    prober: Prober, http: httpx.AsyncClient, url: str, plan: Plan, file: bytes, only: list[str]
) -> list[list[str]]:
    rows = []
    graph = await _largest_there(http)
    if not graph:
        beside, _ = await prober.during(asyncio.sleep(LEAST_S))
        delays, took = await prober.during(called(url, "/api/graphs", file))
        rows = [_row(f"import of {len(file) / 1e6:.1f} MB", delays, beside, [took])]
        after = float(os.environ.get("PROBE_AFTER", "30"))
        delays, _ = await prober.during(asyncio.sleep(after))
        rows.append(_row("after it", delays, beside, [after]))
        graph = await _largest_there(http)
        await http.patch(f"/api/graphs/{graph}", json={"description": "edited"})
        await asyncio.sleep(7)
    seq = (await http.get(f"/api/graphs/{graph}")).json()["seq"]
    document = (await http.get(f"/api/graphs/{graph}/document?at={seq}")).json()
    first = next(key for key in document["actions"] if "|" not in key)
    del document
    g = f"/api/graphs/{graph}"
    draft = "-"
    if not only or any("draft" in word for word in only):
        made = await http.post(f"{g}/drafts", json={"name": f"draft {time.time()}"})
        draft = made.json()["id"]
        await http.patch(f"/api/graphs/{draft}", json={"description": "of the draft"})
    for method, path, body in routes_of(graph, first, seq, draft):
        shown = f"{method} {path}"
        for found, word in ((graph, "{id}"), (first, "{key}"), (f"s/{draft}", "s/{draft}")):
            shown = shown.replace(found, word)
        if not only or any(word in shown for word in only):
            rows.append(await prober.compared(shown, partial(called, url, path, body, method)))

    async def edited() -> float:
        """Edit the graph, and read it at once: nothing is remembered of it as it is then."""
        name = {"description": f"at {time.monotonic()}"}
        patched = await called(url, g, json.dumps(name).encode(), "PATCH")
        return patched + await called(url, f"{g}/umrf")

    async def opened() -> float:
        took = await _opened(plan, graph)
        await asyncio.sleep(6.5)  # until the room is left alone, so that it is loaded again
        return took

    for shown, call in (("edit, then GET umrf", edited), ("open in a page", opened)):
        if not only or any(word in shown for word in only):
            rows.append(await prober.compared(shown, call))
    return rows


_COLUMNS: Final = (
    "meanwhile", "took", "edits", "idle p99", "p50", "p99", "longest", "p99 over idle", "load",
)  # fmt: skip


def tables() -> Iterator[Table]:
    """The delays with the largest graph."""
    rows = uvloop.run(measured(5_000, 20_000))
    yield Table([*_COLUMNS], rows)


if __name__ == "__main__":
    for table in tables():
        show(table)
