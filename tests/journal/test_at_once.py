"""Appends that the event loop commits itself, while commits are quick: the same promises as by the thread."""

import asyncio
import math
import sqlite3
import threading
import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.errors import Unavailable
from action_assistant.journal import commit_metrics
from action_assistant.journal.chain import link
from action_assistant.journal.events import Addition, Draft, Event, nothing
from action_assistant.journal.journal import Journal
from action_assistant.journal.sqlite import SqliteSession
from support.doses import examples
from support.waiting import wait_until

SMALL, LARGE = Draft("small.v1", "ada", b"x"), Draft("large.v1", "ada", bytes(100_000))


class Watched:
    """A journal, and on which thread each of its commits was done. `delay`: of the next ones, seconds;
    `may_store`: they wait until it is set."""

    def __init__(self, journal: Journal) -> None:
        self.journal = journal
        self.here: list[bool] = []
        self.delay = 0.0
        self.may_store = threading.Event()
        self.may_store.set()
        self.broken: list[Exception] = []

    def store(self, original: Any) -> Any:
        def stored(session: SqliteSession, *values: Any) -> None:
            self.here.append(threading.current_thread() is threading.main_thread())
            time.sleep(self.delay)
            assert self.may_store.wait(60)
            if self.broken:
                raise self.broken.pop()
            original(session, *values)

        return stored

    async def then(self, *drafts: Draft, stream: str = "a") -> int:
        """Append as a room does."""
        done: asyncio.Future[int] = asyncio.get_running_loop().create_future()

        def told(seq: int | None, error: BaseException | None) -> None:
            if seq is None:
                done.set_exception(error or AssertionError())
            else:
                done.set_result(seq)

        self.journal.append_then(Addition(stream, drafts), told)
        return await asyncio.wait_for(done, 10)


@pytest.fixture
async def watched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Watched]:
    url = f"sqlite:///{tmp_path / 'editor.db'}"
    journal = await Journal.open(url, branch="editor", fold=nothing, at_once=True)
    watched = Watched(journal)
    monkeypatch.setattr(SqliteSession, "store", watched.store(SqliteSession.store))
    monkeypatch.setattr(commit_metrics, "_SLOW_S", 0.5)  # on a busy machine, too
    monkeypatch.setattr(commit_metrics, "_FAR_TOO_SLOW_S", 1.0)
    monkeypatch.setattr(commit_metrics, "_SHARE", math.inf)  # nothing but commits happens here
    yield watched
    await journal.close()


async def known(watched: Watched) -> None:
    """Append until commits count as quick."""
    for _ in range(20):
        await watched.then(SMALL)
    watched.here.clear()


async def test_the_first_ones_are_the_threads_and_then_the_loops(watched: Watched) -> None:
    for _ in range(25):
        await watched.then(SMALL)
    assert watched.here == [False] * 20 + [True] * 5
    found = await watched.journal.read("a")
    assert [event.seq for event in found] == list(range(1, 26))
    assert not await watched.journal.verify()


async def test_the_thread_commits_large_work_and_other_work_than_appends(watched: Watched) -> None:
    await known(watched)
    await watched.then(LARGE)
    await watched.journal.append("b", [SMALL])
    await watched.journal.derive(lambda connection: connection.exec_driver_sql("SELECT 1"))
    await watched.then(SMALL)
    assert watched.here == [False, False, True]


async def test_appends_that_come_while_the_thread_writes_wait_their_turn(watched: Watched) -> None:
    await known(watched)
    watched.may_store.clear()
    slow = asyncio.create_task(watched.journal.append("a", [SMALL]))
    await wait_until(lambda: watched.here)
    asyncio.get_running_loop().call_soon(watched.may_store.set)
    assert await watched.then(SMALL) == 22
    assert await slow == 21
    assert watched.here == [False, False]


async def test_results_of_the_thread_are_reported_before_those_of_the_loop(
    watched: Watched,
) -> None:
    await known(watched)
    told: list[str] = []
    journal = watched.journal
    watched.delay = 0.1
    journal.append_then(Addition("a", (LARGE,)), lambda *_: told.append("first"))
    await wait_until(lambda: watched.here)  # the thread has it
    journal.append_then(Addition("a", (SMALL,)), lambda *_: told.append("second"))
    time.sleep(0.3)  # noqa: ASYNC251 - the thread is done with it while nobody can be told
    await wait_until(lambda: len(told) == 2)
    assert told == ["first", "second"]


async def test_a_slow_disk_is_waited_for_by_the_thread(watched: Watched) -> None:
    await known(watched)
    watched.delay = 1.1
    await watched.then(SMALL)
    watched.delay = 0
    await watched.then(SMALL)
    assert watched.here == [True, False]


async def test_a_failed_commit_is_reported_and_the_next_one_is_the_threads(
    watched: Watched,
) -> None:
    await known(watched)
    watched.broken.append(sqlite3.OperationalError("disk I/O error"))
    with pytest.raises(Unavailable, match="disk I/O error"):
        await watched.then(SMALL)
    assert [await watched.then(SMALL), await watched.then(SMALL)] == [21, 22]
    assert watched.here == [True, False, True]
    assert not await watched.journal.verify()


async def test_a_journal_that_was_not_asked_to_never_holds_up_its_loop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    url = f"sqlite:///{tmp_path / 'runner.db'}"
    watched = Watched(await Journal.open(url, branch="runner", fold=nothing))
    monkeypatch.setattr(SqliteSession, "store", watched.store(SqliteSession.store))
    for _ in range(25):
        await watched.then(SMALL)
    await watched.journal.close()
    assert watched.here == [False] * 25


steps = st.lists(
    st.tuples(st.sampled_from("ab"), st.sampled_from(["then", "large", "append"]), st.booleans()),
    max_size=25,
)


@settings(max_examples=examples(25), deadline=None)
@given(steps)
def test_events_are_stored_reported_and_followed_in_order_whoever_commits(
    tmp_path_factory: pytest.TempPathFactory, did: list[tuple[str, str, bool]]
) -> None:
    url = f"sqlite:///{tmp_path_factory.mktemp('dice') / 'editor.db'}"
    asyncio.run(mixed(url, did))


async def mixed(url: str, did: list[tuple[str, str, bool]]) -> None:
    """Some appends of each kind, of which some are waited for before the next one."""
    journal = await Journal.open(url, branch="editor", fold=nothing, at_once=True)
    for _ in range(100):
        journal.metrics.quick.took(0.0)
    watched, followed, waiting = Watched(journal), list[Event](), []
    async with journal.follow() as events:
        for stream, kind, waits in did:
            draft = LARGE if kind == "large" else SMALL
            if kind == "append":
                task = asyncio.ensure_future(journal.append(stream, [draft]))
            else:
                task = asyncio.ensure_future(watched.then(draft, stream=stream))
            waiting.append((stream, task))
            if waits:
                await task
        told = [(stream, await task) for stream, task in waiting]
        while len(followed) < len(did):
            followed.append(await asyncio.wait_for(anext(events), 10))
    stored = await journal.read_all()
    assert followed == stored
    assert sorted(told) == sorted((event.stream, event.seq) for event in stored)
    assert [event.position for event in stored] == list(range(1, len(did) + 1))
    for stream in {event.stream for event in stored}:
        chain = bytes(16)
        for event in stored:
            chain = link(chain, event) if event.stream == stream else chain
        assert (await journal.end(stream)).chain == chain
    await journal.close()
