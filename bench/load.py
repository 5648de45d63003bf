"""Yjs clients in one process: what one server sends to whom, how late, at what cost.

Run as `python load.py JSON`, with a `Plan` as JSON; prints one `Outcome` as JSON. Every edit is a
real Yjs update that carries who made it, its number and its time, so that what a server merges or
leaves out is counted right. Delivered: edits that reached a client, each for each.
"""

import asyncio
import heapq
import json
import random
import re
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import psutil
import uvloop
from pycrdt import Doc, Map
from yjs_socket import Person, Plan

MARK: Final = re.compile(rb"<(\d{4})(\d{7})(\d{19})>")
NEVER: Final = b"0" * 19
ROOT: Final = "positions"  # keys that belong to no action are left alone by every reader
WARM_S: Final = 1.0
WARM_ROUNDS: Final = 30
DRAIN_S: Final = 5.0


class Clients:
    """Everybody, and what they saw."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.people: list[Person] = []
        self.delivered = self.lost = 0
        self.delays: list[int] = []  # ns
        self.ending = self.measuring = False
        self.process = psutil.Process(plan.pid)

    async def come(self, count: int) -> None:
        """Connect, 20 at a time, until each has the document."""
        loop = asyncio.get_running_loop()
        gate = asyncio.Semaphore(20)

        async def one(name: int) -> Person:
            async with gate:
                person = Person(self, name, self.plan.rooms[name % len(self.plan.rooms)])
                await loop.create_connection(lambda: person, "127.0.0.1", self.plan.port)
                await asyncio.wait_for(asyncio.shield(person.synced), 60)
                return person

        self.people = await asyncio.gather(*(one(name) for name in range(count)))

    def heard(self, person: Person, data: bytes) -> None:
        now = time.monotonic_ns()
        last = person.last
        for sender, nth, then in MARK.findall(data):
            who, which = int(sender), int(nth)
            fresh = which - last.get(who, -1)
            if who != person.name and fresh > 0:
                last[who] = which
                self.delivered += fresh
                if self.measuring:
                    self.delays.append(now - int(then))

    def processor(self) -> float:
        """Seconds of processor that the server used, all its threads and children."""
        family = [self.process, *self.process.children(recursive=True)]
        return sum(seconds_of(each) for each in family)

    def memory(self) -> float:
        """Resident MB of the server."""
        family = [self.process, *self.process.children(recursive=True)]
        return sum(each.memory_info().rss for each in family) / 1e6

    def leave(self) -> None:
        self.ending = True
        for person in self.people:
            person.transport.abort()


def seconds_of(process: psutil.Process) -> float:
    """Processor time of all threads, to the nanosecond where the kernel tells: what it counts by ticks of
    10 ms misses much of what wakes for less."""
    found = Path(f"/proc/{process.pid}/task").glob("*/schedstat")
    try:
        exact = sum(int(each.read_text().split()[0]) for each in found) / 1e9
    except OSError:  # a thread that ended meanwhile
        exact = 0.0
    return exact or sum(process.cpu_times()[:2])


def edits_of(name: int, count: int, kind: str) -> list[tuple[bytes, bytes]]:
    """Updates of one person, cut where their time goes."""
    doc: Doc[Any] = Doc(client_id=random.randrange(1 << 21, 1 << 31))
    things = doc.get(ROOT, type=Map)
    made: list[bytes] = []
    subscription = doc.observe(lambda event: made.append(bytes(event.update)))
    for nth in range(count):
        key = f"{name}" if kind == "drag" else f"{name}/{nth}"
        things[key] = f"<{name:04d}{nth:07d}{NEVER.decode()}>"
    doc.unobserve(subscription)
    cuts = [update.index(b"<%04d%07d" % (name, nth)) + 12 for nth, update in enumerate(made)]
    return [(u[:cut], u[cut + 19 :]) for u, cut in zip(made, cuts, strict=True)]


async def fan_out(clients: Clients) -> dict[str, Any]:
    """Everybody does something `rate` times a second; what reached the others, and its cost."""
    plan = clients.plan
    await clients.come(plan.people)
    each = int(plan.rate * (plan.seconds + WARM_S)) + 2
    edits = {p.name: edits_of(p.name, each, plan.kind) for p in clients.people}
    done = [0] * plan.people
    gap, begin = 1 / plan.rate, time.monotonic() + 0.1
    order = [(begin + random.Random(n).random() * gap, n) for n in range(plan.people)]
    heapq.heapify(order)
    neighbours = [sum(p.room == other.room for other in clients.people) - 1 for p in clients.people]
    start: tuple[float, float, int] | None = None
    while (now := time.monotonic()) < begin + WARM_S + plan.seconds:
        if start is None and now >= begin + WARM_S:
            clients.measuring, start = True, (now, clients.processor(), clients.delivered)
        while order[0][0] <= now:
            due, name = heapq.heappop(order)
            heapq.heappush(order, (due + gap, name))
            act(clients.people[name], edits[name], done, plan.kind)
        await asyncio.sleep(max(0.0005, order[0][0] - time.monotonic()))
    assert start is not None
    wall, cost = now - start[0], clients.processor() - start[1]
    reached = clients.delivered - start[2]
    expected = sum(count * others for count, others in zip(done, neighbours, strict=True))
    until = time.monotonic() + DRAIN_S
    while clients.delivered < expected and time.monotonic() < until:  # noqa: ASYNC110 - nobody tells
        await asyncio.sleep(0.02)
    delays = sorted(clients.delays) or [0]
    return {
        "delivered_per_s": reached / wall,
        "cpu_us": cost / max(reached, 1) * 1e6,
        "cpu_share": cost / wall,
        "p50_ms": delays[len(delays) // 2] / 1e6,
        "p99_ms": delays[int(len(delays) * 0.99)] / 1e6,
        "missing": expected - clients.delivered,
        "disconnected": clients.lost,
        "memory_mb": clients.memory(),
    }


async def lockstep(clients: Clients) -> dict[str, Any]:
    """Rounds of `burst` edits by some of them; the next one begins a moment after all have arrived. So
    what is asked of a server does not depend on how busy it is: who is slow cannot merge more."""
    plan = clients.plan
    await clients.come(plan.people)
    chance = random.Random(7)
    rounds = WARM_ROUNDS + plan.count
    chosen = [chance.sample(range(plan.people), plan.burst) for _ in range(rounds)]
    counts = Counter(name for some in chosen for name in some)
    edits = {name: edits_of(name, count, plan.kind) for name, count in counts.items()}
    done = [0] * plan.people
    neighbours = [sum(p.room == other.room for other in clients.people) - 1 for p in clients.people]
    expected, cost, before = 0, 0.0, 0
    for nth, some in enumerate(chosen):
        if nth == WARM_ROUNDS:
            clients.measuring, cost, before = True, clients.processor(), clients.delivered
        for name in some:
            act(clients.people[name], edits[name], done, plan.kind)
            expected += neighbours[name]
        async with asyncio.timeout(20):
            while clients.delivered < expected:  # noqa: ASYNC110 - nobody tells
                await asyncio.sleep(0.0005)
        await asyncio.sleep(plan.gap)
    cost, reached = clients.processor() - cost, clients.delivered - before
    delays = sorted(clients.delays)
    return {
        "cpu_us": cost / reached * 1e6,
        "p50_ms": delays[len(delays) // 2] / 1e6,
        "p99_ms": delays[int(len(delays) * 0.99)] / 1e6,
        "missing": expected - clients.delivered,
        "disconnected": clients.lost,
        "memory_mb": clients.memory(),
    }


def act(person: Person, edits: list[tuple[bytes, bytes]], done: list[int], kind: str) -> None:
    """The next operation of one person."""
    nth, now = done[person.name], b"%019d" % time.monotonic_ns()
    if nth >= len(edits):
        return
    done[person.name] += 1
    if kind == "presence":
        person.be_somewhere(nth, now)
    else:
        before, after = edits[nth]
        person.edit(before + now + after)


async def idle(clients: Clients) -> dict[str, Any]:
    """What a thousand sockets that say nothing cost."""
    before, cost = clients.memory(), clients.processor()
    await clients.come(clients.plan.people)
    cost = clients.processor() - cost
    await asyncio.sleep(2)
    return {
        "memory_mb": clients.memory() - before,
        "connect_ms": cost / clients.plan.people * 1e3,
    }


async def fill(clients: Clients) -> dict[str, Any]:
    """One person writes a long history."""
    await clients.come(1)
    (person,) = clients.people
    for nth, (before, after) in enumerate(edits_of(0, clients.plan.count, "add")):
        person.edit(before + b"%019d" % time.monotonic_ns() + after)
        if nth % 200 == 199:
            await until_acknowledged(person)
    await until_acknowledged(person)
    return {}


async def until_acknowledged(person: Person) -> None:
    """Wait until the server has said so of everything that was sent."""
    async with asyncio.timeout(60):
        while person.acknowledged < person.sent - (person.prefix != b""):
            person.news.clear()
            await person.news.wait()


async def open_(clients: Clients) -> dict[str, Any]:
    """How long until the whole document is there, and for how long nobody else was served."""
    plan = clients.plan
    longest, looking = 0.0, True

    async def look() -> None:
        nonlocal longest
        reader, writer = await asyncio.open_connection("127.0.0.1", plan.port)
        while looking:
            then = time.monotonic()
            writer.write(f"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1:{plan.port}\r\n\r\n".encode())
            await reader.readuntil(b"}" if plan.dialect == "plain" else b"\r\n\r\n")
            longest = max(longest, time.monotonic() - then)
            await asyncio.sleep(0.001)
        writer.close()

    looks = asyncio.create_task(look()) if plan.dialect == "plain" else None
    await asyncio.sleep(0.3)
    longest, begin, cost = 0.0, time.monotonic(), clients.processor()
    await clients.come(1)
    took = time.monotonic() - begin
    answer = clients.people[0].synced.result()
    await asyncio.sleep(0.1)
    looking = False
    if looks is not None:
        await looks
    doc: Doc[Any] = Doc()
    things = doc.get(ROOT, type=Map)
    doc.apply_update(answer)
    return {
        "ms": took * 1e3,
        "cpu_ms": (clients.processor() - cost) * 1e3,
        "blocked_ms": longest * 1e3 if looks is not None else None,
        "things": len(things),
        "bytes": len(answer),
    }


async def one_by_one(clients: Clients) -> dict[str, Any]:
    """One person who waits for each acknowledgement before the next edit."""
    await clients.come(1)
    (person,) = clients.people
    times: list[float] = []
    cost = clients.processor()
    for before, after in edits_of(0, clients.plan.count, "add"):
        then = time.monotonic()
        person.edit(before + b"%019d" % time.monotonic_ns() + after)
        await until_acknowledged(person)
        times.append(time.monotonic() - then)
        await asyncio.sleep(0.02)
    times.sort()
    return {
        "p50_ms": times[len(times) // 2] * 1e3,
        "p99_ms": times[int(len(times) * 0.99)] * 1e3,
        "cpu_us": (clients.processor() - cost) / len(times) * 1e6,
    }


LOADS: Final[dict[str, Callable[[Clients], Any]]] = {
    "fan out": fan_out,
    "lockstep": lockstep,
    "idle": idle,
    "fill": fill,
    "open": open_,
    "one by one": one_by_one,
}


async def main(plan: Plan) -> None:
    clients = Clients(plan)
    found = await LOADS[plan.operation](clients)
    clients.leave()
    sys.stdout.write(json.dumps(found))


if __name__ == "__main__":
    uvloop.run(main(Plan(**json.loads(sys.argv[1]))))
