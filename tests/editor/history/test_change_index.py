"""The index of key changes agrees with the log that it is made of, wherever and whenever one looks."""

import itertools
import random
from collections import defaultdict
from contextlib import suppress
from typing import Any

import anyio
import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pycrdt import Doc, Map
from sqlalchemy import delete, select

from action_assistant.editor.history import index_queries
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.change_summaries import maps_of, state_of
from action_assistant.editor.history.key_changes import LoggedChange, owner_of, unpacked
from action_assistant.editor.log.graph_events import graph_stream
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import Unavailable
from action_assistant.journal.events import Draft
from action_assistant.journal.journal import Journal
from action_assistant.schema.editor_tables import key_change, key_change_head
from editor.history.random_edits import GRAPH, edited, plain
from support.doses import examples

_ALL = 1_000_000


def _seen(changes: list[LoggedChange]) -> bytes:
    return plain(maps_of(state_of(changes)))


@pytest.mark.parametrize("seed", range(examples(12) // 2))
async def test_the_state_at_any_moment_is_what_the_log_replays(
    journal: Journal, rooms: Rooms, seed: int
) -> None:
    held = await edited(rooms, seed, 50)
    index = ChangeIndex(journal)
    assert await index.upto(GRAPH) == len(held)
    for n, maps in enumerate(held):
        assert _seen(await index.value(index_queries.at, GRAPH, n + 1)) == plain(maps), n + 1


@pytest.mark.parametrize("seed", range(examples(12) // 2))
async def test_changes_between_two_moments_lead_from_one_to_the_other(
    journal: Journal, rooms: Rooms, seed: int
) -> None:
    held = await edited(rooms, seed, 50)
    index = ChangeIndex(journal)
    await index.upto(GRAPH)
    dice = random.Random(seed)
    for _ in range(20):
        first, last = sorted(dice.choices(range(1, len(held) + 1), k=2))
        between = await index.value(index_queries.between, GRAPH, first, last, _ALL)
        then = state_of(await index.value(index_queries.at, GRAPH, first))
        assert plain(maps_of(then | state_of(between))) == plain(held[last - 1])
        back = {change.place: change.before for change in reversed(between)}
        now = state_of(await index.value(index_queries.at, GRAPH, last))
        assert plain(maps_of(now | back)) == plain(held[first - 1])


@pytest.mark.parametrize("seed", range(examples(12) // 2))
async def test_the_author_of_a_value_is_the_one_that_a_search_of_the_whole_log_finds(
    journal: Journal, rooms: Rooms, seed: int
) -> None:
    held = await edited(rooms, seed, 50)
    events = await journal.read(graph_stream(GRAPH))
    sought: dict[tuple[str, str], tuple[int, str, object]] = {}
    before = {}
    for event, maps in zip(events, held, strict=True):
        now = {(root, key): v for root, fields in maps.items() for key, v in fields.items()}
        for place in before.keys() | now.keys():
            if before.get(place) != now.get(place):
                sought[place] = event.seq, event.author, now.get(place)
        before = now
    index = ChangeIndex(journal)
    await index.upto(GRAPH)
    found = {
        change.place: (change.seq, change.author, unpacked(change.after))
        for change in await index.value(index_queries.at, GRAPH, len(held))
    }
    assert found == {place: who for place, who in sought.items() if who[2] is not None}


@pytest.mark.parametrize("seed", range(examples(8) // 2))
async def test_however_often_it_is_brought_up_it_holds_the_same(
    journal: Journal, rooms: Rooms, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("action_assistant.editor.history.index_queries._EVENTS", 1 + seed % 7)
    held = await edited(rooms, seed, 40)
    index, dice = ChangeIndex(journal), random.Random(seed)
    for upto in sorted(dice.sample(range(1, len(held) + 1), k=5)):
        assert await index.upto(GRAPH, upto) >= upto
    await index.upto(GRAPH)
    pieces = await index.value(index_queries.between, GRAPH, 0, len(held), _ALL)
    await journal.derive(lambda connection: connection.execute(delete(key_change)))
    await journal.derive(lambda connection: connection.execute(delete(key_change_head)))
    monkeypatch.undo()
    await index.upto(GRAPH)
    assert pieces == await index.value(index_queries.between, GRAPH, 0, len(held), _ALL)


async def test_a_packed_document_and_one_kept_before_they_were_packed_are_gone_on_with(
    journal: Journal, rooms: Rooms, monkeypatch: pytest.MonkeyPatch
) -> None:
    held = await edited(rooms, 6, 30)
    index = ChangeIndex(journal)
    monkeypatch.setattr(index_queries, "_EVENTS", 7)
    for large in (1 << 30, 0, 1 << 30, 0):  # as it was, packed, and again
        monkeypatch.setattr(index_queries, "_LARGE", large)
        await index.upto(GRAPH, await index.head(GRAPH) + 1)
    (row,) = await journal.query(select(key_change_head.c.document))
    assert row.document[:1] == b"\x78"
    assert await index.upto(GRAPH) == len(held)
    assert _seen(await index.value(index_queries.at, GRAPH, len(held))) == plain(held[-1])


@pytest.mark.parametrize("seed", range(examples(8) // 2))
async def test_killed_between_two_slices_it_is_made_as_if_it_had_not_been(
    journal: Journal, rooms: Rooms, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("action_assistant.editor.history.change_index.ROWS", 3)
    held = await edited(rooms, seed, 30)
    dice, derive = random.Random(seed), journal.derive

    async def dies(work: Any) -> Any:
        nonlocal left
        left -= 1
        if left < 0:
            raise Unavailable("killed")
        return await derive(work)

    for _ in range(3):
        left = dice.randrange(8)
        with monkeypatch.context() as patch:
            patch.setattr(journal, "derive", dies)
            with suppress(Unavailable):
                await ChangeIndex(journal).upto(GRAPH)
        index = ChangeIndex(journal)
        reached = await index.head(GRAPH)
        since = await index.value(index_queries.latest_since, GRAPH, 1)
        assert max(since.values(), default=0) <= reached
    pieces = []
    for _ in range(2):
        assert await index.upto(GRAPH) == len(held)
        pieces.append(await index.value(index_queries.between, GRAPH, 0, len(held), _ALL))
        await index._forget(GRAPH)
        assert not await index.value(index_queries.between, GRAPH, 0, len(held), _ALL)
    assert pieces[0] == pieces[1]


async def test_a_document_kept_by_another_version_is_made_again(
    journal: Journal, rooms: Rooms
) -> None:
    held = await edited(rooms, 1, 30)
    index = ChangeIndex(journal)
    await index.upto(GRAPH, 5)
    strange = key_change_head.update().values(document=b"what is this")
    await journal.derive(lambda connection: connection.execute(strange))
    assert await index.upto(GRAPH) == len(held)
    assert _seen(await index.value(index_queries.at, GRAPH, len(held))) == plain(held[-1])


async def test_the_index_ends_where_the_log_is_damaged(journal: Journal, rooms: Rooms) -> None:
    held = await edited(rooms, 2, 30)
    await rooms.close()
    bad = Draft("graph.updated.v1", "ada", b"\x01\x01\xff\xff\xff\xff\xff")
    await journal.append(graph_stream(GRAPH), [bad])
    index = ChangeIndex(journal)
    assert await index.upto(GRAPH) == len(held)
    assert await index.upto(GRAPH) == len(held)
    assert _seen(await index.value(index_queries.at, GRAPH, len(held) + 1)) == plain(held[-1])


async def test_the_index_follows_the_log_without_any_question(
    journal: Journal, rooms: Rooms, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("action_assistant.editor.history.change_index._PERIOD", 0.01)
    index = ChangeIndex(journal)
    async with index.kept_up():
        held = await edited(rooms, 3, 30)
        found: dict[bool, int] = defaultdict(int)
        while not found[True]:
            found[len(await index.value(index_queries.at, GRAPH, len(held))) > 0] += 1
            assert found[False] < 5000


async def test_a_graph_under_edit_is_indexed_once_it_rests(
    journal: Journal, rooms: Rooms, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unless there is too much of it; whoever asks has it at once."""
    module = "action_assistant.editor.history.change_index"
    look, looked = anyio.Semaphore(0), anyio.Semaphore(0)

    async def sleep(_: float) -> None:
        looked.release()
        await look.acquire()

    async def next_look() -> None:
        look.release()
        await looked.acquire()

    monkeypatch.setattr(f"{module}._FAR", 40)
    index = ChangeIndex(journal)

    async def indexed() -> int:
        return await index.head(GRAPH)

    with monkeypatch.context() as patch:
        patch.setattr(anyio, "sleep", sleep)
        async with index.kept_up():
            await looked.acquire()
            for nth in range(2):
                await edited(rooms, nth, 8)
                await next_look()
                assert await indexed() == 0
            await next_look()  # nothing was edited since
            rests = await indexed()
            assert rests == await journal.newest(graph_stream(GRAPH))
            await edited(rooms, 5, 80)
            await next_look()
            assert await indexed() > rests


async def test_a_document_that_cannot_be_read_ends_nothing(
    journal: Journal,
    rooms: Rooms,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    monkeypatch.setattr("action_assistant.editor.history.change_index._PERIOD", 0.01)
    tries, thrice = itertools.count(1), anyio.Event()

    async def fails(*_: object) -> object:
        if next(tries) == 3:
            thrice.set()
        raise RuntimeError

    await edited(rooms, 3, 5)
    async with ChangeIndex(journal, fails).kept_up():  # type: ignore[arg-type]
        with anyio.fail_after(20):
            await thrice.wait()
    assert "cannot be indexed" in caplog.text


@given(st.from_regex(r"[A-Za-z0-9]{12}", fullmatch=True), st.text(max_size=5))
@settings(max_examples=examples(50), suppress_health_check=[HealthCheck.too_slow])
def test_a_key_speaks_of_what_stands_before_its_first_bar(aid: str, rest: str) -> None:
    assert owner_of("actions", f"{aid}|{rest}") == aid
    assert owner_of("relations", f"{aid}>exit|{rest}") == f"{aid}>exit"
    assert owner_of("positions", f"w/{aid}>exit|run") == f"{aid}>exit"
    assert owner_of("positions", aid) == aid
    assert owner_of("positions", "g/note") == "g/note"
    assert owner_of("meta", f"x/{rest}") == ""


async def test_rows_are_stored_in_the_order_of_the_indexes(journal: Journal, rooms: Rooms) -> None:
    doc: Doc[Any] = Doc()
    with doc.transaction():
        for root in ("actions", "relations"):
            fields = doc.get(root, type=Map)
            for n in random.Random(1).sample(range(1000), 300):
                fields[f"key{n:04}"] = "value"
    async with rooms.enter(graph_stream(GRAPH)) as room:
        await room.submit(doc.get_update(), "ada")
    found = await ChangeIndex(journal).value(index_queries.growth, GRAPH, 200)
    assert found is not None
    rows = [row for each in found.slices for row in msgspec.msgpack.decode(each)]
    place = [index_queries.COLUMNS.index(name) for name in ("seq", "root", "key")]
    stored = [tuple(row[n] for n in place) for row in rows]
    assert len(stored) == 600
    assert stored == sorted(stored)
