"""Clients that press hard on a runner: `python -m support.load_on_runner PORT SILENT CLIENTS`.

Every route with the worst body that it takes, from as many people as there are clients, beside
strangers who hold connections and say nothing, or begin to. Ends when it is killed.
"""

import asyncio
import itertools
import os
import random
import resource
import sys
from collections.abc import Iterator
from pathlib import Path

import msgspec

from action_assistant.journal.journal import Journal
from action_assistant.runner import projection
from action_assistant.runner.links.observations import GraphState, NodeState
from action_assistant.runner.runs.events import Ended, Observed, Published, Requested, draft_of
from action_assistant.runner.runs.fold import RunEvent
from action_assistant.runner.runs.recorder import stream_of
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from action_assistant.web.auth.keys import Keys

LONG = "long"
_US = 1_000_000
_BEGAN = 1_790_000_000 * _US


def long_run(data: Path, events: int) -> None:
    """A stored run of so many events, of 200 actions."""
    data.mkdir(parents=True, exist_ok=True)
    asyncio.run(_stored(data, events))


async def _stored(data: Path, count: int) -> None:
    from runner.harness import ANN, sequence

    url = f"sqlite:///{data / 'runner.db'}"
    Journal.prepare(url, "runner")
    journal = await Journal.open(url, branch="runner", fold=projection.fold)
    graph = sequence("hostile", 200)
    names = {each.full_name: each.key for each in graph.actions}
    begun = Requested(
        at=_BEGAN, run=LONG, number=1, request_id="long", author=ANN, graph="hostile",
        graph_name="hostile", version="v", digest=digest(graph), engine="simulator",
        simulated=True, actions=names, umrf=codec.write(graph), script="",
    )  # fmt: skip
    try:
        told = [begun, Published(_BEGAN + 1, "life"), *_shown(list(names), count)]
        told.append(Ended(_BEGAN + (count + 5) * 10_000, "finished", "on_true"))
        for start in range(0, len(told), 500):
            drafts = [draft_of(each, "simulator") for each in told[start : start + 500]]
            await journal.append(stream_of(LONG), drafts)
    finally:
        await journal.close()


def _shown(names: list[str], count: int) -> Iterator[RunEvent]:
    yield Observed(_BEGAN + 2, (GraphState(_BEGAN + 2, "hostile", "RUNNING"),))
    for number in range(count):
        at = _BEGAN + (number + 3) * 10_000
        name = names[number % len(names)]
        states = (
            NodeState(at, "hostile", name, "RUNNING"),
            NodeState(at + 9_000, "hostile", name, "STOPPED"),
        )
        yield Observed(at + 9_000, states)


def graph_text(actions: int, filler: int = 0) -> bytes:
    """A graph of so many actions, of at least so many bytes."""
    from runner.harness import sequence

    value = msgspec.json.decode(codec.write(sequence("hostile", actions)))
    value["graph_description"] = "x" * filler
    return msgspec.json.encode(value)


def requests() -> list[tuple[str, str, bytes]]:
    """Method, path and body, of every route that takes one or has much to do."""
    wide, deep = graph_text(5_000), b'{"graph_name":"g","actions":' + b"[" * 60 + b"]" * 60 + b"}"
    many = b'{"graph_name":"g","actions":[' + b",".join([b"[]"] * 600_000) + b"]}"
    sealed = digest(codec.read(wide).graph).encode()

    def start(umrf: bytes, engine: bytes = b'"engine":"simulator"') -> bytes:
        name = str(random.getrandbits(64)).encode()
        head = b'{"version":"v","digest":"%b","request_id":"%b",%b,"umrf":' % (sealed, name, engine)
        return head + umrf + b"}"

    arrow = b'{"parent":"a1","child":"a2","outcome":"on_true"}'
    group = b'"engines":["simulator"]'
    never = b',"script":{"behaviours":{"*":[{"never":true}]}}}'
    quick = b',"script":{"behaviours":{"*":[{"after_s":0}]}}}'
    commands = [
        ("POST", "/api/runs", start(wide)[:-1] + never),
        ("POST", "/api/runs", start(wide)[:-1] + quick),
        ("POST", "/api/runs", start(many)),
        ("POST", "/api/preflight", start(wide, group)),
        ("POST", "/api/preflight", start(many, group)),
        ("POST", "/api/groups", start(wide, b'"engines":["nobody"]')),
        ("POST", f"/api/runs/{LONG}/script", b'{"umrf":%b}' % wide),
        ("POST", f"/api/runs/{LONG}/script", b'{"umrf":%b}' % many),
        ("POST", f"/api/runs/{LONG}/script", b'{"umrf":%b}' % deep),
        ("POST", f"/api/runs/{LONG}/modify", start(wide)),
        ("POST", "/api/expectations", msgspec.json.encode({"run": LONG, "name": "n" * 99_000})),
        ("POST", "/api/expectations", msgspec.json.encode({"run": LONG, "name": "long"})),
        ("POST", "/api/expectations", b'{"name":"wide","graph":"g","umrf":%b}' % wide),
        ("POST", "/api/expectations", b'{"name":"deep","graph":"g","umrf":%b}' % deep),
        ("POST", "/api/expectations/check", b'{"graph":"g","umrf":%b}' % wide),
        ("POST", "/api/expectations/check", b'{"graph":"g","umrf":%b}' % many),
        ("POST", "/api/expectations/proposal", b'{"umrf":%b,"arrow":%b}' % (wide, arrow)),
        ("POST", "/api/expectations/proposal", b'{"umrf":%b,"arrow":%b}' % (many, arrow)),
        ("POST", "/api/robots", msgspec.json.encode({"name": "n" * 99_000})),
        ("POST", "/api/session", msgspec.json.encode({"token": "t" * 9_000})),
        ("POST", "/api/stop", b"[" * 1_000_000),
        ("POST", f"/api/runs/{LONG}/stop", b"x" * 1_000_000),
        ("PATCH", f"/api/runs/{LONG}/marks", msgspec.json.encode({"note": "n" * 4_000})),
    ]  # fmt: skip
    return commands + [("GET", path, b"") for path in _asked_for()]


def _asked_for() -> list[str]:
    """Return the paths of all answers that may be long."""
    return [
        "/api/runs?limit=1000&text=a",
        f"/api/runs/{LONG}",
        f"/api/runs/{LONG}/film",
        f"/api/runs/{LONG}/film?after=2000",
        f"/api/runs/{LONG}/causes",
        f"/api/runs/{LONG}/script",
        f"/api/runs/{LONG}/umrf",
        f"/api/runs/{LONG}/events",
        f"/api/runs/{LONG}/export?format=jsonl",
        f"/api/runs/{LONG}/export?format=csv",
        f"/api/runs/{LONG}/export?format=mcap",
        f"/api/comparison?a={LONG}&b={LONG}",
        "/api/statistics?graph=hostile&last=1000",
        "/api/expectations",
        "/api/robots",
        "/schema/openapi.json",
    ]


async def press(port: int, head: bytes, requests_: list[tuple[str, str, bytes]]) -> None:
    """One after the other, for ever; now and then without waiting for the answer."""
    for number in itertools.count():
        method, path, body = random.choice(requests_)
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            first = f"{method} {path} HTTP/1.1\r\ncontent-length: {len(body)}\r\n".encode()
            writer.write(first + head + b"\r\n" + body)
            if number % 5:
                while await reader.read(1 << 16):
                    pass
            else:
                await writer.drain()
            writer.close()
        except OSError:
            await asyncio.sleep(0.05)


async def hold(port: int, said: bytes) -> None:
    """A stranger who comes back whenever the door is shut."""
    while True:
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(said)
            await reader.read(1)
            writer.close()
        except OSError:
            pass
        await asyncio.sleep(2 + 2 * random.random())


async def main(port: int, silent: int, clients: int) -> None:
    """Run all clients at once."""
    keys, page = Keys(_token()), port - 1
    requests_ = requests()
    said = [b"", b"GET / HTTP/1.1\r\n", b"POST /api/stop HTTP/1.1\r\nhost: localhost\r\nx: "]
    tasks = [asyncio.create_task(hold(port, said[i % 3])) for i in range(silent)]
    for i in range(clients):
        cookie = f"aa_{page}={keys.sealed(keys.new_session(f'Eve {i}'))}"
        head = (
            f"host: 127.0.0.1:{port}\r\norigin: http://127.0.0.1:{page}\r\n"
            f"connection: close\r\ncookie: {cookie}\r\n"
        )
        tasks.append(asyncio.create_task(press(port, head.encode(), requests_)))
    sys.stdout.write("pressing\n")
    sys.stdout.flush()
    await asyncio.gather(*tasks)


def _token() -> str:
    from support.product import TOKEN

    return TOKEN


if __name__ == "__main__":
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    os.nice(5)  # it shall not be what is measured
    asyncio.run(main(*(int(each) for each in sys.argv[1:4])))
