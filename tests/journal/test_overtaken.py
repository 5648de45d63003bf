"""Several writers on one Postgres, as where a pooler or a failover gave the lock of the only writer away:
whoever knows an old end of a stream is refused, and nothing is lost, doubled or damaged."""

import asyncio
import logging
import os
import random
from collections import Counter
from typing import Any

import pytest
from sqlalchemy import make_url

from action_assistant.errors import Conflict, Unavailable
from action_assistant.journal.events import Addition, Draft, nothing
from action_assistant.journal.journal import Journal
from action_assistant.journal.postgres import Postgres
from action_assistant.journal.removal import StreamRemoved
from journal.servers import Server
from journal.whole_log import whole_log

#: Events that each random writer appends.
EVENTS = int(os.environ.get("SOAK_OVERTAKEN", "20"))


class Unlocked(Postgres):
    """A database whose lock is not asked for, as often as `times`."""

    def __init__(self, url: str, times: int) -> None:
        super().__init__(make_url(url))
        self._times = times

    async def _take_over(self, raw: Any) -> None:
        if self._times > 0:
            self._times -= 1
            return
        await super()._take_over(raw)


def draft(text: str = "x") -> Draft:
    return Draft("thing.happened.v1", "ada", text.encode())


async def opened(url: str, *, unlocked: int = 1_000_000) -> Journal:
    return await Journal.on(Unlocked(url, unlocked), branch="editor", fold=nothing)


async def test_what_was_made_for_an_old_end_is_refused_alone(postgres: Server) -> None:
    url = postgres.new_database()
    one, other = await opened(url), await opened(url)
    await one.append("graph", [draft("1")])
    await one.append("people", [draft("1")])
    await other.append("graph", [draft("2")], expected=1)
    stale, fresh = await asyncio.gather(
        one.append("graph", [draft("lost")], expected=1),
        one.append("people", [draft("2")]),
        return_exceptions=True,
    )
    assert isinstance(stale, Conflict)
    assert fresh == 2
    assert [each.body for each in await one.read("graph")] == [b"1", b"2"]
    assert await one.verify() == []
    await one.close()
    await other.close()


async def test_a_stream_that_was_taken_out_is_not_gone_on_with_by_who_knows_its_middle(
    postgres: Server,
) -> None:
    url = postgres.new_database()
    one, other = await opened(url), await opened(url)
    await one.append("run", [draft("1")])
    await other.append("run", [draft("2")])
    end = await other.end("run")
    removed = StreamRemoved("run", end.seq, end.chain.hex(), "elsewhere", "00")
    by = await other.take_out(removed, lambda _: Addition("notes", (draft(),)))
    while await other.delete_some("run", by):
        pass
    with pytest.raises(Conflict):
        await one.append("run", [draft("late")], expected=1)
    assert await one.read("run") == []
    assert await one.verify() == []
    await one.close()
    await other.close()


async def test_who_cannot_have_the_lock_stores_nothing_and_says_why(
    postgres: Server, caplog: pytest.LogCaptureFixture
) -> None:
    url = postgres.new_database()
    real = await opened(url, unlocked=0)
    stray = await opened(url, unlocked=1)
    await real.append("a", [draft("1")])
    await stray.append("a", [draft("2")])
    with caplog.at_level(logging.ERROR):
        assert await real.append("a", [draft("3")]) == 3
        assert "another process writes to it" in caplog.text
        with pytest.raises(Unavailable, match="in use by another process"):
            await stray.append("a", [draft("4")])
    assert [each.body for each in await real.read("a")] == [b"1", b"2", b"3"]
    assert await real.verify() == []
    await real.close()
    await stray.close()


class Racer:
    """A writer that appends to several streams, half of the time only behind the end that it knows,
    and appends again what was not stored."""

    def __init__(self, journal: Journal, name: str, seed: int) -> None:
        self._journal = journal
        self._name = name
        self._dice = random.Random(seed)
        self._known: dict[str, int] = {}
        self.acknowledged: list[tuple[str, int, bytes]] = []
        self.refused: Counter[str] = Counter()

    async def race(self) -> None:
        for n in range(EVENTS):
            body = f"{self._name}/{n}"
            while not await self._tried(body):  # noqa: ASYNC110 - it waits for no event
                await asyncio.sleep(self._dice.uniform(0, 0.05))
            await asyncio.sleep(self._dice.uniform(0, 0.15))  # who was overtaken connects again

    async def _tried(self, body: str) -> bool:
        stream = f"s{self._dice.randrange(4)}"
        expected = self._known.get(stream) if self._dice.random() < 0.5 else None
        try:
            seq = await self._journal.append(stream, [draft(body)], expected=expected)
        except Conflict:
            self.refused["conflict"] += 1
            self._known[stream] = await self._journal.newest(stream)
            return False
        except Unavailable as error:
            self.refused["not known" if "not known" in error.detail else "unavailable"] += 1
            return False
        assert expected is None or seq == expected + 1
        self._known[stream] = seq
        self.acknowledged.append((stream, seq, body.encode()))
        return True


@pytest.mark.parametrize("seed", range(int(os.environ.get("SOAK_SEEDS", "1"))))
async def test_three_writers_whose_connections_are_cut_lose_double_and_damage_nothing(
    postgres: Server, seed: int
) -> None:
    url = postgres.new_database()
    journals = [await opened(url) for _ in range(3)]
    racers = [Racer(each, f"w{n}", seed * 10 + n) for n, each in enumerate(journals)]
    races = [asyncio.create_task(each.race()) for each in racers]
    dice = random.Random(seed)
    cut = (
        "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = current_database()"
        " AND pid <> pg_backend_pid() AND application_name NOT LIKE '%reads' LIMIT 1"
    )
    for _ in range(3):
        await asyncio.sleep(dice.uniform(0.02, 0.1))
        await asyncio.to_thread(postgres.sql, cut, url.rpartition("/")[2])
    await asyncio.gather(*races)
    stored = await whole_log(journals[0])
    refused = sum((each.refused for each in racers), Counter())
    assert refused["not known"] == 0
    assert refused["conflict"] > 0
    told = [each for racer in racers for each in racer.acknowledged]
    assert Counter((each.stream, each.seq, each.body) for each in stored) == Counter(told)
    assert [each.position for each in stored] == list(range(1, len(stored) + 1))
    assert await journals[0].verify() == []
    for each in journals:
        await each.close()
