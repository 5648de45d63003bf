"""Every journal keeps these promises, on either database."""

import asyncio
from collections.abc import Awaitable, Callable, Sequence

import msgspec
import pytest
from sqlalchemy import Executable, insert, select

from action_assistant.errors import BadInput, CannotStart, Conflict
from action_assistant.journal.events import Addition, Draft, Event
from action_assistant.journal.journal import Journal
from action_assistant.schema import editor_tables

Open = Callable[..., Awaitable[Journal]]


def draft(text: str = "x", *, kind: str = "thing.happened.v1", author: str = "ada") -> Draft:
    return Draft(kind, author, text.encode())


def people(event: Event) -> Sequence[Executable]:
    """A fold with one row per event; the same body twice is a clash."""
    return [
        insert(editor_tables.person).values(
            id=event.body.decode(), name=event.author, seen_at=event.seq
        )
    ]


async def test_events_come_back_in_order_and_whole(journal: Journal) -> None:
    assert await journal.append("a", [draft("1"), draft("2")]) == 2
    assert await journal.append("a", [draft("\x00\xff")]) == 3
    assert await journal.append("b", [draft("4", kind="other.v1", author="bob")]) == 1
    found = await journal.read("a")
    assert [(e.seq, e.body) for e in found] == [(1, b"1"), (2, b"2"), (3, "\x00\xff".encode())]
    (other,) = await journal.read("b")
    assert (other.stream, other.kind, other.author, other.position) == ("b", "other.v1", "bob", 4)


async def test_reading_takes_a_range_and_a_limit(journal: Journal) -> None:
    await journal.append("a", [draft(str(n)) for n in range(1, 11)])
    assert [e.seq for e in await journal.read("a", after=3, upto=7)] == [4, 5, 6, 7]
    assert [e.seq for e in await journal.read("a", after=3, limit=2)] == [4, 5]
    assert [e.seq for e in await journal.read("a", upto=0)] == []
    assert await journal.newest("a") == 10
    assert await journal.newest("nobody") == 0


async def test_appending_nothing_tells_the_newest(journal: Journal) -> None:
    await journal.append("a", [draft()])
    assert await journal.append("a", []) == 1


async def test_an_append_that_expects_another_end_is_refused_and_leaves_nothing(
    journal: Journal,
) -> None:
    await journal.append("a", [draft()], expected=0)
    with pytest.raises(Conflict):
        await journal.append("a", [draft(), draft()], expected=0)
    assert await journal.newest("a") == 1
    assert await journal.append("a", [draft()], expected=1) == 2


async def test_one_of_several_appends_that_expect_the_same_end_succeeds(journal: Journal) -> None:
    async def attempt() -> bool:
        try:
            await journal.append("a", [draft()], expected=0)
        except Conflict:
            return False
        return True

    assert sum(await asyncio.gather(*(attempt() for _ in range(20)))) == 1


async def test_many_writers_leave_no_gap_in_any_stream(journal: Journal) -> None:
    async def write(stream: str) -> None:
        for n in range(25):
            await journal.append(stream, [draft(str(n))])

    await asyncio.gather(*(write(f"s{n % 4}") for n in range(12)))
    for name in ("s0", "s1", "s2", "s3"):
        assert [e.seq for e in await journal.read(name)] == list(range(1, 76))
    everything = await journal.read_all(limit=1000)
    assert [e.position for e in everything] == list(range(1, 301))


async def test_additions_to_several_streams_happen_all_or_none(journal: Journal) -> None:
    await journal.append("b", [draft()])
    with pytest.raises(Conflict):
        await journal.append_all([Addition("a", (draft(),)), Addition("b", (draft(),), expected=0)])
    assert await journal.newest("a") == 0
    ends = await journal.append_all([Addition("a", (draft(),)), Addition("b", (draft(),))])
    assert ends == [1, 2]
    assert [e.position for e in await journal.read_all()] == [1, 2, 3]


async def test_acknowledged_events_are_there_after_opening_again(open_journal: Open) -> None:
    first = await open_journal()
    await first.append("a", [draft("kept")])
    await first.close()
    second = await open_journal()
    assert [e.body for e in await second.read("a")] == [b"kept"]
    assert await second.append("a", [draft()]) == 2


async def test_a_journal_has_one_writing_process(open_journal: Open) -> None:
    await open_journal()
    with pytest.raises(CannotStart, match="in use"):
        await open_journal()


async def test_the_fold_is_written_with_its_event(open_journal: Open) -> None:
    journal = await open_journal(fold=people)
    await journal.append("a", [draft("one"), draft("two")])
    rows = await journal.query(
        select(editor_tables.person.c.id).order_by(editor_tables.person.c.seen_at)
    )
    assert [row.id for row in rows] == ["one", "two"]


async def test_an_event_whose_fold_clashes_is_not_stored_and_harms_no_other(
    open_journal: Open,
) -> None:
    journal = await open_journal(fold=people)
    await journal.append("a", [draft("taken")])
    outcomes = await asyncio.gather(
        journal.append("b", [draft("before")]),
        journal.append("a", [draft("fine"), draft("taken")]),
        journal.append("a", [draft("after")]),
        return_exceptions=True,
    )
    assert outcomes[0] == 1
    assert isinstance(outcomes[1], Conflict)
    assert outcomes[2] == 2
    rows = await journal.query(select(editor_tables.person.c.id))
    assert {row.id for row in rows} == {"taken", "before", "after"}
    assert [e.position for e in await journal.read_all()] == [1, 2, 3]


async def test_a_fold_that_breaks_is_the_callers_error_and_harms_no_other(
    open_journal: Open,
) -> None:
    def broken(event: Event) -> Sequence[Executable]:
        if event.body == b"bad":
            raise ValueError("cannot fold this")
        return ()

    journal = await open_journal(fold=broken)
    with pytest.raises(ValueError, match="cannot fold"):
        await journal.append("a", [draft("bad")])
    assert await journal.append("a", [draft("good")]) == 1


@pytest.mark.parametrize("name", ["nul \0", "half \ud83d", "byte \udcff"])
async def test_a_name_that_no_database_can_hold_is_refused_and_harms_no_other(
    journal: Journal, name: str
) -> None:
    outcomes = await asyncio.gather(
        journal.append("a", [draft("before")]),
        journal.append("a", [draft(author=name)]),
        journal.append(name, [draft()]),
        journal.append("a", [draft("after")]),
        return_exceptions=True,
    )
    assert outcomes[0::3] == [1, 2]
    assert [type(each) for each in outcomes[1:3]] == [BadInput, BadInput]


async def test_tables_made_again_are_the_same(open_journal: Open) -> None:
    journal = await open_journal(fold=people)
    await journal.append("a", [draft(f"p{n}") for n in range(1200)])
    before = await journal.query(select(editor_tables.person).order_by(editor_tables.person.c.id))
    assert await journal.rebuild() == 1200
    after = await journal.query(select(editor_tables.person).order_by(editor_tables.person.c.id))
    assert before == after
    assert len(after) == 1200


async def test_a_follower_hears_everything_from_now_on_in_order(journal: Journal) -> None:
    await journal.append("a", [draft("old")])
    heard: list[bytes] = []
    async with journal.follow() as events:
        await journal.append("a", [draft("1")])
        await asyncio.gather(*(journal.append(f"s{n}", [draft(str(n))]) for n in range(2, 50)))
        async for event in events:
            heard.append(event.body)
            if len(heard) == 49:
                break
    assert sorted(heard, key=int) == [str(n).encode() for n in range(1, 50)]


async def test_a_follower_that_was_away_for_long_still_misses_nothing(journal: Journal) -> None:
    seqs: list[int] = []
    async with journal.follow() as events:
        for _ in range(7):
            await journal.append("a", [draft() for _ in range(400)])
        async for event in events:
            seqs.append(event.seq)
            if event.seq == 2800:
                break
    assert seqs == list(range(1, 2801))


async def test_followers_end_when_the_journal_closes(journal: Journal) -> None:
    async with journal.follow() as events:
        await journal.append("a", [draft()])
        await journal.close()
        assert [e.seq async for e in events] == [1]


async def test_an_append_is_committed_even_if_nobody_waits_for_it_any_more(
    journal: Journal,
) -> None:
    task = asyncio.create_task(journal.append("a", [draft("orphan")]))
    await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    await journal.append("b", [draft()])
    assert [e.body for e in await journal.read("a")] == [b"orphan"]


async def test_a_snapshot_comes_back_until_a_newer_one_replaces_it(journal: Journal) -> None:
    await journal.append("a", [draft("1"), draft("2")])
    assert await journal.snapshot("a") is None
    await journal.keep_snapshot("a", 1, b"one")
    await journal.keep_snapshot("a", 2, b"two")
    found = await journal.snapshot("a")
    assert found is not None
    assert (found.seq, found.state) == (2, b"two")


async def test_values_are_comparable(journal: Journal) -> None:
    await journal.append("a", [draft("1")])
    (once,), (again,) = await journal.read("a"), await journal.read_all()
    assert once == again
    assert msgspec.structs.replace(once, seq=2) != again
