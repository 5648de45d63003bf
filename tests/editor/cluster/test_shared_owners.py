"""Several editors on one Postgres agree who owns a stream, whoever dies, freezes or is cut off."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager

import pytest

from action_assistant.editor.cluster.owners import Elsewhere, Here, Nobody
from action_assistant.editor.cluster.shared_owners import SharedOwners
from action_assistant.errors import CannotStart, Conflict, Unavailable
from action_assistant.journal.events import Addition, Draft, nothing
from action_assistant.journal.journal import Journal
from editor.cluster.several import have_begun
from journal.servers import Server
from support.waiting import wait_until

STREAM = "graph/g"


class Editor:
    """The journal of an editor, and its owners of streams."""

    def __init__(self, name: str, journal: Journal, owners: SharedOwners) -> None:
        self.url = f"http://{name}"
        self.journal = journal
        self.owners = owners
        self.lost: list[str] = []
        owners.when_lost(self.lost.append)

    async def epoch(self, stream: str = STREAM) -> int:
        """Own a stream, and return its epoch."""
        match await self.owners.owner(stream):
            case Here(epoch) if epoch is not None:
                return epoch
            case other:
                raise AssertionError(other)

    async def append(self, epoch: int, body: str) -> int:
        """Append an event to the stream, as its owner in this epoch, behind the end that is stored."""
        seq = await self.journal.newest(STREAM)
        event = Draft("thing.happened.v1", "ada", body.encode())
        (newest,) = await self.journal.append_all([Addition(STREAM, (event,), seq, epoch)])
        return newest


@asynccontextmanager
async def editor(url: str, name: str) -> AsyncIterator[Editor]:
    journal = await Journal.open(url, branch="editor", fold=nothing, several=True)
    try:
        await have_begun(journal, STREAM, "graph/other", *(f"graph/{n}" for n in range(20)))
        async with SharedOwners.joined(journal, url, f"http://{name}") as owners:
            yield Editor(name, journal, owners)
    finally:
        await journal.close()


@pytest.fixture
def database(postgres: Server) -> str:
    """Return the URL of a database that the two editors share."""
    return postgres.new_database()


@pytest.fixture
async def editors(database: str) -> AsyncIterator[tuple[Editor, Editor]]:
    """Two editors of one database."""
    async with AsyncExitStack() as stack:
        one = await stack.enter_async_context(editor(database, "one"))
        yield one, await stack.enter_async_context(editor(database, "two"))


async def test_who_comes_first_owns_a_stream_and_the_others_are_told_where_it_is(
    editors: tuple[Editor, Editor],
) -> None:
    one, two = editors
    assert await one.epoch() == 1
    assert await two.owners.owner(STREAM) == Elsewhere("http://one")
    assert await two.epoch("graph/other") == 1
    assert await one.owners.owner("graph/other") == Elsewhere("http://two")
    assert await one.append(1, "1") == 1
    await one.owners.give_up(STREAM)
    assert await two.epoch() == 2
    with pytest.raises(Conflict):
        await one.append(1, "late")
    assert await two.append(2, "2") == 2
    assert await one.owners.owner(STREAM) == Elsewhere("http://two")
    await two.owners.give_up("graph/not-owned")


async def test_of_two_who_take_a_stream_at_once_one_owns_it(
    editors: tuple[Editor, Editor],
) -> None:
    one, two = editors
    for n in range(20):
        stream = f"graph/{n}"
        found = await asyncio.gather(*(each.owners.owner(stream) for each in (one, two, one, two)))
        assert found[0] == found[2]
        assert found[1] == found[3]
        assert sorted(type(each).__name__ for each in found[:2]) == ["Elsewhere", "Here"]


async def test_a_stream_without_events_has_no_owner_and_leaves_nothing(
    editors: tuple[Editor, Editor], postgres: Server
) -> None:
    one, two = editors
    name = one.journal.address.rpartition("/")[2]
    before = postgres.ask("SELECT count(*) FROM head", name)
    for n in range(10):
        assert await one.owners.owner(f"graph/made-up-{n}") == Nobody()
        assert await two.owners.owner(f"graph/made-up-{n}") == Nobody()
    assert postgres.ask("SELECT count(*) FROM head", name) == before
    assert postgres.ask("SELECT count(*) FROM room", name) == "0"
    event = Draft("thing.happened.v1", "ada", b"1")
    await one.journal.append("graph/made-up-1", [event])
    assert await two.epoch("graph/made-up-1") == 1
    assert await one.owners.owner("graph/made-up-1") == Elsewhere("http://two")


async def test_an_editor_that_has_ended_leaves_its_streams_to_the_others(postgres: Server) -> None:
    url = postgres.new_database()
    async with editor(url, "two") as two:
        async with editor(url, "one") as one:
            assert await one.epoch() == 1
            assert await two.owners.owner(STREAM) == Elsewhere("http://one")
        assert await two.epoch() == 2


async def test_a_crash_frees_the_streams_at_once(
    editors: tuple[Editor, Editor], postgres: Server
) -> None:
    one, two = editors
    assert await one.epoch() == 1
    await one.journal.close()  # the beats go on; nobody holds the slot
    assert await two.epoch() == 2
    await wait_until(lambda: one.lost == [STREAM])


async def test_an_editor_whose_session_was_cut_takes_a_slot_again_and_goes_on(
    editors: tuple[Editor, Editor], database: str, postgres: Server
) -> None:
    one, two = editors
    epoch = await one.epoch()
    await one.owners.require_same_token(b"a token")
    # The locks of all databases of the server are listed, those of other tests too.
    slots = (
        " FROM pg_locks l JOIN pg_database d ON d.oid = l.database AND d.datname = current_database()"
        " WHERE l.locktype = 'advisory' AND l.granted AND l.objsubid = 2 AND l.objid = "
    )
    name = database.rpartition("/")[2]
    cut = f"SELECT l.pid, pg_terminate_backend(l.pid){slots}0"
    # As if another editor had held the slot last.
    await asyncio.to_thread(postgres.sql, "UPDATE editor SET proof = '\\x00' WHERE slot = 0", name)
    pid = (await asyncio.to_thread(postgres.ask, cut, name)).split("|")[0]
    held = f"SELECT l.pid{slots}0"
    async with asyncio.timeout(20):
        while await asyncio.to_thread(postgres.ask, held, name) in {"", pid}:  # noqa: ASYNC110
            await asyncio.sleep(0.05)
    await asyncio.sleep(0.6)  # for one more beat
    assert await two.owners.owner(STREAM) == Elsewhere("http://one")
    assert await one.append(epoch, "1") == 1
    assert one.lost == []
    await two.owners.require_same_token(b"a token")
    with pytest.raises(CannotStart, match="http://one has another token"):
        await two.owners.require_same_token(b"another token")


async def test_an_editor_that_drains_keeps_what_it_has_until_another_needs_it_and_takes_no_more(
    editors: tuple[Editor, Editor],
) -> None:
    one, two = editors
    epoch = await one.epoch()
    await one.owners.drain()
    assert await one.append(epoch, "1") == 1
    with pytest.raises(Unavailable, match="ending"):
        await one.owners.owner("graph/other")
    assert await two.epoch() == 2
    await wait_until(lambda: one.lost == [STREAM])
    assert await one.owners.owner(STREAM) == Elsewhere("http://two")


async def test_an_editor_that_the_database_does_not_hear_closes_its_rooms_and_goes_on_later(
    editors: tuple[Editor, Editor], postgres: Server
) -> None:
    one, two = editors
    assert await one.epoch() == 1
    postgres.stop()
    try:
        await wait_until(lambda: one.lost == [STREAM])
        with pytest.raises(Unavailable, match="which editor has this graph"):
            await one.owners.owner(STREAM)
    finally:
        postgres.start()
    owner = None
    async with asyncio.timeout(30):
        while owner is None:
            try:
                owner = await two.owners.owner(STREAM)
            except Unavailable:
                await asyncio.sleep(0.1)
    assert owner in (Here(2), Elsewhere("http://one"))
