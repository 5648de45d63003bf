"""Servers and connections of Postgres die, and the journal recovers."""

import asyncio
import os
import random
from collections import Counter
from collections.abc import Iterator

import pytest
from sqlalchemy import insert

from action_assistant.errors import BadInput, CannotStart, Unavailable
from action_assistant.journal import postgres as module
from action_assistant.journal.events import Draft, Event, nothing
from action_assistant.journal.journal import Journal
from action_assistant.journal.postgres import PostgresSession
from action_assistant.schema import editor_tables
from journal.proxy import Verdict, proxy
from journal.servers import Server, binaries, server
from journal.whole_log import whole_log
from support.waiting import wait_until

STOPS = int(os.environ.get("SOAK_STOPS", "6"))
CUTS = int(os.environ.get("SOAK_CUTS", "24"))


def draft(text: str = "x") -> Draft:
    return Draft("thing.happened.v1", "ada", text.encode())


async def opened(url: str) -> Journal:
    return await Journal.open(url, branch="editor", fold=nothing)


@pytest.fixture
def mortal() -> Iterator[Server]:
    """A server that a test may kill."""
    if binaries() is None:
        pytest.skip("Postgres is not installed (Debian: postgresql)")
    with server() as one:
        one.sql("CREATE DATABASE aa")
        yield one


class Writers:
    """Several who append without pause, and append again what was refused."""

    def __init__(self, journal: Journal, writers: int) -> None:
        self._journal = journal
        self._tasks = [asyncio.create_task(self._write(n)) for n in range(writers)]
        self._enough = False
        self.acknowledged: list[bytes] = []
        self.refused = 0
        self.open = 0  # answered with: nobody knows

    async def _write(self, writer: int) -> None:
        n = 0
        while not self._enough:
            body = f"{writer}/{n}".encode()
            try:
                await self._journal.append(f"s{writer % 3}", [draft(body.decode())])
            except Unavailable as error:
                self.refused += 1
                self.open += "not known" in error.detail
                await asyncio.sleep(0.02)
                continue
            self.acknowledged.append(body)
            n += 1

    async def go_on(self, more: int = 1, within: float = 20) -> None:
        """Wait until so many more were acknowledged."""
        wanted = len(self.acknowledged) + more
        await wait_until(lambda: len(self.acknowledged) >= wanted, within)

    async def end(self) -> None:
        self._enough = True
        await asyncio.gather(*self._tasks)

    async def check(self) -> None:
        """Check that nothing is lost or doubled, that there is no gap, and that the journal is
        sound."""
        stored = await whole_log(self._journal)
        bodies = Counter(each.body for each in stored)
        assert self.open == 0
        assert [body for body in self.acknowledged if body not in bodies] == []
        assert [body for body, times in bodies.items() if times > 1] == []
        assert [each.position for each in stored] == list(range(1, len(stored) + 1))
        assert await self._journal.verify() == []


async def test_immediate_stops_under_load_lose_nothing_and_double_nothing(mortal: Server) -> None:
    journal = await opened(mortal.url("aa"))
    writing = Writers(journal, writers=8)
    chance = random.Random(7)
    for _ in range(STOPS):
        await asyncio.sleep(chance.uniform(0.1, 0.5))
        await asyncio.to_thread(mortal.stop, "immediate")
        await asyncio.to_thread(mortal.start)
        await writing.go_on(within=5)
    await writing.end()
    assert writing.refused > 0
    await writing.check()
    await journal.close()


async def test_a_server_that_is_away_is_said_once(
    mortal: Server, caplog: pytest.LogCaptureFixture
) -> None:
    journal = await opened(mortal.url("aa"))
    await asyncio.to_thread(mortal.stop, "fast")
    for _ in range(3):
        with pytest.raises(Unavailable):
            await journal.append("a", [draft()])
    lines = [each for each in caplog.records if each.levelname == "ERROR"]
    assert 1 <= len(lines) <= 2, "the end of the connection, and that nobody answers"
    await journal.close()


async def test_while_the_server_is_down_appends_and_reads_fail_at_once(mortal: Server) -> None:
    journal = await opened(mortal.url("aa"))
    await journal.append("a", [draft()])
    await asyncio.to_thread(mortal.stop, "fast")
    async with asyncio.timeout(2):
        away = "the database server does not answer"
        with pytest.raises(Unavailable, match=f"Nothing can be stored at the moment: {away}"):
            await journal.append("a", [draft()])
        with pytest.raises(Unavailable, match=f"cannot be read: {away}"):
            await journal.read("a")
        assert away in (await journal.health() or "")
    await asyncio.to_thread(mortal.start)
    assert await journal.append("a", [draft()]) == 2
    assert [e.seq for e in await journal.read("a")] == [1, 2]
    await journal.close()


async def test_a_restart_while_nobody_writes_is_not_noticed(mortal: Server) -> None:
    journal = await opened(mortal.url("aa"))
    await journal.append("a", [draft()])
    await asyncio.to_thread(mortal.stop, "immediate")
    await asyncio.to_thread(mortal.start)
    assert await journal.append("a", [draft()]) == 2
    assert [e.seq for e in await journal.read("a")] == [1, 2]
    await journal.close()


@pytest.mark.parametrize("folded", [False, True], ids=["one statement", "a transaction"])
@pytest.mark.parametrize("how", ["cut before", "cut after", "silence"])
async def test_a_connection_that_dies_in_a_commit_stores_exactly_once(
    postgres: Server, how: Verdict, folded: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_ANSWER", 0.5)
    url = postgres.new_database()
    chance = random.Random(11)
    decisive = b"COMMIT" if folded else b"bad-luck"
    armed = False

    def judge(data: bytes) -> Verdict:
        nonlocal armed
        if armed and decisive in data:
            armed = False
            return how
        return "pass"

    def fold(event: Event) -> list[object]:
        row = {"id": str(event.position), "name": "x", "seen_at": event.at}
        return [insert(editor_tables.person).values(row)] if folded else []

    async with proxy(postgres.port, judge) as way:
        through = url.replace(f":{postgres.port}/", f":{way.port}/")
        journal = await Journal.open(through, branch="editor", fold=fold)  # type: ignore[arg-type]
        cuts = 2 if how == "silence" else CUTS // 4
        acknowledged = 0
        for n in range(cuts):
            await asyncio.sleep(chance.uniform(0, 0.01))
            armed = True
            try:
                await journal.append("a", [draft(f"bad-luck {n}")])
                acknowledged += 1
            except Unavailable as error:
                assert "Nothing can be stored" in error.detail  # noqa: PT017
                await journal.append("a", [draft(f"bad-luck {n}")], expected=n)
        assert way.cuts == cuts
        assert acknowledged == (0 if how == "cut before" else cuts)
        stored = await journal.read("a")
        assert [e.body.decode() for e in stored] == [f"bad-luck {n}" for n in range(cuts)]
        assert await journal.verify() == []
        await journal.close()


@pytest.mark.parametrize("closing", ["is let go", "cannot even be let go"])
async def test_after_a_connection_that_was_aborted_another_one_writes(
    postgres: Server, closing: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The driver sometimes aborts a connection that did not answer in time."""
    journal = await opened(postgres.new_database())
    await journal.append("a", [draft()])
    session = journal._writer._session
    assert isinstance(session, PostgresSession)
    session._raw._abort()
    if closing != "is let go":
        monkeypatch.setattr(session, "close", lambda: 1 / 0)
    async with asyncio.timeout(30):
        assert await journal.append("a", [draft()]) == 2
        await journal.close()
    monkeypatch.undo()
    if not session._loop.is_closed():
        await asyncio.to_thread(session.close)


@pytest.mark.turns
async def test_cuts_anywhere_under_load_lose_nothing_and_double_nothing(postgres: Server) -> None:
    url = postgres.new_database()
    chance = random.Random(13)
    calm = True

    def judge(_: bytes) -> Verdict:
        if calm or chance.random() > 0.02:
            return "pass"
        return "cut before" if chance.random() < 0.5 else "cut after"

    async with proxy(postgres.port, judge) as way:
        journal = await opened(url.replace(f":{postgres.port}/", f":{way.port}/"))
        writing = Writers(journal, writers=6)
        calm = False
        await wait_until(lambda: way.cuts >= CUTS, seconds=60 + CUTS)
        calm = True
        await writing.end()
        await writing.check()
        await journal.close()


@pytest.mark.parametrize(
    ("setting", "says"),
    [("fsync = off", "fsync is off"), ("synchronous_commit = off", "synchronous_commit is off")],
)
async def test_a_server_that_forgets_commits_is_refused(
    mortal: Server, setting: str, says: str
) -> None:
    mortal.sql(f"ALTER SYSTEM SET {setting}")
    mortal.sql("SELECT pg_reload_conf()")
    await wait_until(lambda: mortal.ask(f"SHOW {setting.split()[0]}") == "off")
    with pytest.raises(CannotStart, match=says):
        await opened(mortal.url("aa"))


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("postgresql://aa@127.0.0.1:1/aa", "nothing listens there"),
        ("postgresql://aa:secret@127.0.0.1:PORT/missing", '"missing" does not exist'),
        ("postgresql://127.0.0.1", "not supported"),
    ],
)
async def test_a_database_that_cannot_be_opened_is_one_sentence_without_the_password(
    postgres: Server, url: str, says: str
) -> None:
    with pytest.raises(CannotStart, match=says) as caught:
        await opened(url.replace("PORT", str(postgres.port)))
    assert "secret" not in str(caught.value)


async def test_text_that_postgres_cannot_hold_is_the_callers_error_and_harms_no_other(
    postgres: Server,
) -> None:
    def fold(event: Event) -> list[object]:
        row = {"id": event.body.decode(), "name": "", "seen_at": event.at}
        return [insert(editor_tables.person).values(row)]

    journal = await Journal.open(postgres.new_database(), branch="editor", fold=fold)  # type: ignore[arg-type]
    outcomes = await asyncio.gather(
        journal.append("a", [draft("one")]),
        journal.append("a", [draft("nul \0")]),
        journal.append("a", [draft("two")]),
        return_exceptions=True,
    )
    assert outcomes[0] == 1
    assert isinstance(outcomes[1], BadInput)
    assert outcomes[2] == 2
    await journal.close()


async def test_the_lock_goes_with_a_process_that_dies(postgres: Server) -> None:
    url = postgres.new_database()
    first = await opened(url)
    await first.append("a", [draft()])
    with pytest.raises(CannotStart, match="in use"):
        await opened(url)
    postgres.sql(
        "SELECT pg_terminate_backend(pid) FROM pg_stat_activity"
        f" WHERE datname = '{url.rpartition('/')[2]}'"
    )
    second = await opened(url)
    await second.append("a", [draft()], expected=1)
    with pytest.raises(Unavailable, match="in use"):
        await first.append("a", [draft()])  # somebody else writes now
    await second.close()
    assert await first.append("a", [draft()]) == 3
    await first.close()


async def test_the_server_writes_its_own_messages_of_one_commit_window_as_one_statement(
    postgres: Server,
) -> None:
    sent: list[bytes] = []

    def judge(data: bytes) -> Verdict:
        sent.append(data)
        return "pass"

    url = postgres.new_database()
    async with proxy(postgres.port, judge) as way:
        journal = await opened(url.replace(f":{postgres.port}/", f":{way.port}/"))
        await asyncio.gather(*(journal.append(f"s{n}", [draft()]) for n in range(20)))
        sent.clear()
        await asyncio.gather(*(journal.append(f"s{n}", [draft()]) for n in range(20)))
        assert len(sent) <= 4  # the first one alone, the others together; not 20
        await journal.close()
