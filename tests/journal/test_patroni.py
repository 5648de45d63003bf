"""A primary fails over to its replica under Patroni: what was confirmed is there, and is said only then."""

import asyncio
import os
import random
import signal
import time
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from action_assistant.errors import CannotStart, Unavailable
from action_assistant.journal import postgres as module
from action_assistant.journal.journal import Journal
from editor.process import running
from editor.test_postgres import Hand, made, seen
from journal.failover_cluster import Cluster, Node, are_installed, cluster
from journal.test_postgres import Writers, draft, opened
from journal.whole_log import whole_log
from support.waiting import wait_until

FAILOVERS = int(os.environ.get("SOAK_FAILOVERS", "2"))

pytestmark = [pytest.mark.long, pytest.mark.timeout(1800)]


@pytest.fixture(scope="module")
def nodes() -> Iterator[Cluster]:
    """A cluster that each test leaves with a primary and a synchronous replica."""
    if not are_installed():
        pytest.skip("Patroni or etcd is not installed (Debian: patroni, etcd-server)")
    with cluster() as one:
        yield one


def with_patroni(nodes: Cluster, url: str) -> str:
    """Return a URL that names Patroni too."""
    return "&".join([url, *(f"patroni={address}" for address in nodes.rest)])


async def stored(journal: Journal) -> Counter[bytes]:
    """Return how often each body is in the log."""
    return Counter(each.body for each in await whole_log(journal))


async def lose_power(nodes: Cluster, node: Node) -> None:
    node.kill()
    await asyncio.to_thread(nodes.primary, node)


async def freeze(nodes: Cluster, node: Node) -> None:
    """A computer that stands still, and goes on later with what it was doing."""
    node.signal(signal.SIGSTOP)
    await asyncio.to_thread(nodes.primary, node)
    node.signal(signal.SIGCONT)


async def test_failovers_under_load_lose_nothing_that_was_confirmed(
    nodes: Cluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_ANSWER", 3.0)  # a frozen server is given up sooner
    journal = await opened(with_patroni(nodes, nodes.new_database("under_load")))
    writing = Writers(journal, writers=8)
    chance = random.Random(17)
    for turn in range(FAILOVERS):
        await asyncio.sleep(chance.uniform(0.5, 1.5))
        primary = nodes.primary()
        await (lose_power, freeze)[turn % 2](nodes, primary)
        await writing.go_on(8, within=60)
        if turn % 2 == 0:
            primary.start()
        await asyncio.to_thread(nodes.wait_for_replica)
    await writing.end()
    found = await stored(journal)
    assert writing.refused > 0
    assert [body for body in writing.acknowledged if body not in found] == []
    twice = [body for body, times in found.items() if times > 1]
    assert len(twice) <= writing.open, "only what was called unknown was written again"
    assert await journal.verify() == []
    await journal.close()


async def test_what_only_a_dying_primary_has_is_not_called_stored(
    nodes: Cluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A commit waits for a replica that is off, and the wait is cancelled. The primary keeps that
    commit, and shows it to everybody; the replica, which takes over, never had it."""
    monkeypatch.setattr(module, "_ANSWER", 2.0)
    name = "not_replicated"
    journal = await opened(with_patroni(nodes, nodes.new_database(name)))
    await journal.append("a", [draft("both have it")])
    primary = nodes.primary()
    replica = next(each for each in nodes.nodes if each is not primary)
    primary.freeze_patroni()
    replica.kill()
    lost = asyncio.create_task(journal.append("a", [draft("one has it")]))
    held = "SELECT count(*) FROM event WHERE body = 'one has it'"
    await asyncio.sleep(10)  # the wait of the commit is cancelled by then, and it was asked about
    assert nodes.sql(held, name, primary) == "1", "the primary shows what its replica lacks"
    assert not lost.done()
    primary.kill()
    replica.start()
    with pytest.raises(Unavailable):
        await lost
    await asyncio.to_thread(nodes.primary, primary)
    await until_stored(journal)
    assert set(await stored(journal)) == {b"both have it", b"after it"}
    assert await journal.verify() == []
    await journal.close()
    primary.start()
    await asyncio.to_thread(nodes.wait_for_replica)


async def until_stored(journal: Journal) -> None:
    """Append until it succeeds."""
    async with asyncio.timeout(60):
        while True:
            try:
                await journal.append("a", [draft("after it")])
                return
            except Unavailable:
                await asyncio.sleep(0.2)


async def test_an_editor_with_people_goes_on_at_the_replica(
    nodes: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ten people edit five graphs with clients that connect anew for each edit. All that they were told is stored is
    in the documents, each of which equals its log."""
    monkeypatch.setenv("ACTION_ASSISTANT_LIMITS", "off")
    database = with_patroni(nodes, nodes.new_database("people"))
    with running(tmp_path / "data", database) as editor:
        graphs = [await asyncio.to_thread(made, editor) for _ in range(5)]
        told: dict[str, set[str]] = {graph: set() for graph in graphs}
        over = asyncio.Event()

        def is_more(before: int) -> bool:
            return sum(map(len, told.values())) > before

        async def edit(person: int, graph: str) -> None:
            hand, n = Hand(editor, graph, patience=120), 0
            while not over.is_set():
                await hand.write(f"{person}: {n}")
                told[graph].add(f"{person}: {n}")
                n += 1

        async with asyncio.TaskGroup() as people:
            for person in range(10):
                people.create_task(edit(person, graphs[person % 5]))
            for turn in range(FAILOVERS):
                await asyncio.sleep(3)
                primary = nodes.primary()
                began = time.monotonic()
                await (lose_power, freeze)[turn % 2](nodes, primary)
                promoted = time.monotonic() - began
                await wait_until(partial(is_more, sum(map(len, told.values()))), seconds=90)
                print(  # noqa: T201 - a figure of the soak
                    f"promoted after {promoted:.1f} s, stored again after {time.monotonic() - began:.1f} s"
                )
                if turn % 2 == 0:
                    primary.start()
                await asyncio.to_thread(nodes.wait_for_replica)
            over.set()
        for graph in graphs:
            assert told[graph] - await seen(editor, graph) == set()
        with editor.client() as client:
            answer = await asyncio.to_thread(client.get, "/readyz")
        assert answer.status_code == 200
    journal = await opened(database)
    assert await journal.verify() == []
    await journal.close()


async def test_a_primary_that_waits_for_no_replica_is_refused(nodes: Cluster) -> None:
    url = nodes.new_database("unsafe")
    nodes.configure(synchronous_mode=False)
    try:
        for _ in range(100):
            if nodes.sql("SHOW synchronous_standby_names") == "":
                break
            await asyncio.sleep(0.1)
        with pytest.raises(CannotStart, match=r"could lose.*synchronous_mode of Patroni is off"):
            await opened(with_patroni(nodes, url))
        with pytest.raises(CannotStart, match=r"could lose.*\(synchronous_standby_names is empty"):
            await opened(url)
        alone = f"postgresql://aa@127.0.0.1:{nodes.primary().port}/unsafe"
        with pytest.raises(CannotStart, match="synchronous_standby_names is empty"):
            await opened(f"{alone}?failover=synchronous")
        await (await opened(alone)).close()  # who does not speak of a failover has one server
    finally:
        nodes.configure(synchronous_mode=True)
        await asyncio.to_thread(nodes.wait_for_replica)
    await (await opened(url)).close()
    await (await opened(with_patroni(nodes, url))).close()
