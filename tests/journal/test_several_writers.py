"""Several writers of one Postgres, each in a slot of its own: streams that all share go on whoever was first,
streams with an owner are fenced by their epoch, and nothing is lost, doubled or damaged."""

import asyncio
import os
import random
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import msgspec
import pytest
from sqlalchemy import Executable
from sqlalchemy.dialects.postgresql import insert

from action_assistant.errors import CannotStart, Conflict, Unavailable
from action_assistant.journal.copies.copying import copy
from action_assistant.journal.databases import database_of
from action_assistant.journal.events import Addition, Draft, Event, Fold, nothing
from action_assistant.journal.heads import head_at
from action_assistant.journal.journal import Journal
from action_assistant.journal.slots import Cursor, before_first, slot_of
from action_assistant.schema import editor_tables
from action_assistant.web.audit.rows import AuditFilter, Fact, audit_page
from journal.servers import Server
from journal.whole_log import whole_log

#: Events that each random writer appends.
EVENTS = int(os.environ.get("SOAK_OVERTAKEN", "20"))
_CUT = (
    "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = current_database()"
    " AND pid <> pg_backend_pid() AND application_name NOT LIKE '%reads' ORDER BY random() LIMIT 1"
)


def draft(text: str = "x") -> Draft:
    return Draft("thing.happened.v1", "ada", text.encode())


async def opened(url: str, fold: Fold = nothing, *, several: bool = True) -> Journal:
    return await Journal.open(url, branch="editor", fold=fold, several=several)


async def test_each_writer_has_a_slot_and_the_only_writer_has_none_beside_it(
    postgres: Server,
) -> None:
    url = postgres.new_database()
    one, other = await opened(url), await opened(url)
    assert [one.slot, other.slot] == [0, 1]
    for n in range(3):
        assert await one.append("people", [draft()]) == 2 * n + 1
        assert await other.append("people", [draft()]) == 2 * n + 2
    positions = [each.position for each in await one.read("people")]
    begin = before_first(1)
    assert positions == [1, begin + 1, 2, begin + 2, 3, begin + 3]
    assert await one.verify() == []
    with pytest.raises(CannotStart, match="in use by another process"):
        await opened(url, several=False)
    await one.close()
    third = await opened(url)
    assert third.slot == 0
    assert await third.append("people", [draft()]) == 7
    assert (await third.read("people"))[-1].position == 4
    await third.close()
    await other.close()
    alone = await opened(url, several=False)
    assert await alone.append("people", [draft()]) == 8
    assert (await alone.read("people"))[-1].position == 5
    assert await alone.verify() == []
    with pytest.raises(CannotStart, match="shares it with no other"):
        await opened(url)
    await alone.close()


async def test_a_file_has_one_writer(tmp_path: Path) -> None:
    with pytest.raises(CannotStart, match="Several editors need a Postgres database"):
        await opened(f"sqlite:///{tmp_path}/editor.db")


async def test_who_owns_a_stream_no_longer_cannot_append_to_it(postgres: Server) -> None:
    url = postgres.new_database()
    one, other = await opened(url), await opened(url)
    await one.append_all([Addition("graph", (draft("1"),), 0, epoch=0)])
    postgres.sql("UPDATE head SET epoch = 1 WHERE stream = 'graph'", url.rpartition("/")[2])
    late = Addition("graph", (draft("late"),), 1, epoch=0)
    fenced, shared = await asyncio.gather(
        one.append_all([late]), one.append("people", [draft()]), return_exceptions=True
    )
    assert isinstance(fenced, Conflict)
    assert shared == 1
    assert await other.append_all([Addition("graph", (draft("2"),), 1, epoch=1)]) == [2]
    with pytest.raises(Conflict):
        await one.append_all([late])
    assert [each.body for each in await one.read("graph")] == [b"1", b"2"]
    assert await one.verify() == []
    await one.close()
    await other.close()


async def test_who_owned_a_stream_before_and_owns_it_again_goes_on_behind_the_others(
    postgres: Server,
) -> None:
    url = postgres.new_database()
    one, other = await opened(url), await opened(url)
    take = "UPDATE head SET epoch = epoch + 1 WHERE stream = 'graph'"
    await one.append_all([Addition("graph", (draft("1"),), 0, epoch=0)])
    postgres.sql(take, url.rpartition("/")[2])
    assert await other.append_all([Addition("graph", (draft("2"),), 1, epoch=1)]) == [2]
    postgres.sql(take, url.rpartition("/")[2])
    assert await one.append_all([Addition("graph", (draft("3"),), 2, epoch=2)]) == [3]
    assert await one.verify() == []
    await one.close()
    await other.close()


def people(event: Event) -> Sequence[Executable]:
    """Fold to the last author of each stream."""
    row = {"id": event.stream, "name": event.body.decode(), "seen_at": event.seq}
    made = insert(editor_tables.person).values(row)
    return [made.on_conflict_do_update(index_elements=["id"], set_=row)]


async def test_tables_are_rebuilt_alike_whoever_wrote_the_events(postgres: Server) -> None:
    url = postgres.new_database()
    journals = [await opened(url, people) for _ in range(3)]
    dice = random.Random(7)
    for n in range(60):
        await dice.choice(journals).append(f"s{dice.randrange(5)}", [draft(str(n))])
    rows = "SELECT string_agg(id || name || seen_at, ' ' ORDER BY id) FROM person"
    before = postgres.ask(rows, url.rpartition("/")[2])
    assert await journals[2].rebuild() == 60
    assert postgres.ask(rows, url.rpartition("/")[2]) == before
    assert await journals[0].verify() == []
    for each in journals:
        await each.close()


async def test_a_missing_event_of_any_slot_is_found(postgres: Server) -> None:
    url = postgres.new_database()
    journals = [await opened(url) for _ in range(3)]
    for n in range(12):
        await journals[n % 3].append("people", [draft(str(n))])
        await journals[n % 3].append(f"own/{n % 3}", [draft(str(n))])
    name = url.rpartition("/")[2]
    for slot in range(3):
        lost = f"own/{slot}"
        postgres.sql(f"CREATE TABLE kept AS SELECT * FROM event WHERE stream = '{lost}'", name)
        postgres.sql(f"DELETE FROM event WHERE stream = '{lost}'", name)
        postgres.sql(f"DELETE FROM head WHERE stream = '{lost}'", name)
        (found,) = await journals[0].verify()
        assert "missing" in found.why
        postgres.sql("INSERT INTO event SELECT * FROM kept", name)
        postgres.sql(
            "INSERT INTO head SELECT stream, seq, chain FROM kept ORDER BY seq DESC LIMIT 1", name
        )
        postgres.sql("DROP TABLE kept", name)
        assert await journals[0].verify() == []
    for each in journals:
        await each.close()


class Racer:
    """A writer that appends to several streams at once, half of the time only behind the end that it knows."""

    def __init__(self, journal: Journal, name: str, seed: int) -> None:
        self._journal = journal
        self._name = name
        self._dice = random.Random(seed)
        self.acknowledged: list[tuple[str, int, bytes]] = []
        self.refused: Counter[str] = Counter()

    async def race(self) -> None:
        for n in range(EVENTS):
            body = f"{self._name}/{n}"
            while not await self._tried(body):  # noqa: ASYNC110 - it waits for no event
                await asyncio.sleep(self._dice.uniform(0, 0.02))

    async def _tried(self, body: str) -> bool:
        streams = self._dice.sample(range(4), self._dice.randint(1, 3))
        expects = self._dice.random() < 0.3
        additions = [
            Addition(
                f"s{n}", (draft(body),), await self._journal.newest(f"s{n}") if expects else None
            )
            for n in streams
        ]
        try:
            seqs = await self._journal.append_all(additions)
        except Conflict:
            self.refused["conflict"] += 1
            return False
        except Unavailable as error:
            self.refused["not known" if "not known" in error.detail else "unavailable"] += 1
            return False
        for addition, seq in zip(additions, seqs, strict=True):
            self.acknowledged.append((addition.stream, seq, body.encode()))
        return True


@pytest.mark.parametrize("seed", range(int(os.environ.get("SOAK_SEEDS", "1"))))
async def test_writers_of_shared_streams_whose_connections_are_cut_lose_nothing(
    postgres: Server, seed: int
) -> None:
    url = postgres.new_database()
    journals = [await opened(url) for _ in range(3)]
    racers = [Racer(each, f"w{n}", seed * 10 + n) for n, each in enumerate(journals)]
    races = [asyncio.create_task(each.race()) for each in racers]
    dice = random.Random(seed)
    for _ in range(4):
        await asyncio.sleep(dice.uniform(0.02, 0.2))
        await asyncio.to_thread(postgres.sql, _CUT, url.rpartition("/")[2])
    await asyncio.gather(*races)
    stored = await whole_log(journals[0])
    refused = sum((each.refused for each in racers), Counter())
    assert refused["not known"] == 0
    told = [each for racer in racers for each in racer.acknowledged]
    assert Counter((each.stream, each.seq, each.body) for each in stored) == Counter(told)
    slots = {slot_of(each.position) for each in stored}
    for slot in slots:
        mine = [each.position for each in stored if slot_of(each.position) == slot]
        assert mine == [before_first(slot) + n for n in range(1, len(mine) + 1)]
    assert len(slots) >= 3
    assert await journals[0].verify() == []
    for each in journals:
        await each.close()


async def test_a_reader_gets_each_event_of_all_writers_once_whoever_stored_it_when(
    postgres: Server,
) -> None:
    url = postgres.new_database()
    writers = [await opened(url) for _ in range(3)]
    reader = writers[1]
    chance = random.Random(45)
    seen: list[Event] = []
    moment = await reader.cursor()
    for _ in range(30):
        some = [chance.choice(writers) for _ in range(chance.randrange(6))]
        await asyncio.gather(*(each.append("people", [draft()] * 3) for each in some))
        page = await reader.read_since(Cursor.parse(str(moment)))
        seen += page
        for each in page:
            moment = moment.after(each.position)
    assert moment == await reader.cursor()
    assert len(seen) == len({each.position for each in seen})
    assert sorted(each.seq for each in seen) == [each.seq for each in await reader.read("people")]
    for writer in writers:
        await writer.close()


async def test_whoever_follows_hears_the_events_of_all_writers_in_the_order_of_their_streams(
    postgres: Server,
) -> None:
    url = postgres.new_database()
    journals = [await opened(url) for _ in range(3)]
    heard: list[tuple[str, int]] = []
    async with journals[1].follow() as events:
        for n in range(30):
            await journals[n % 3].append(f"s{n % 4}", [draft(str(n))])
        async with asyncio.timeout(20):
            while len(heard) < 30:
                event = await anext(events)
                heard.append((event.stream, event.seq))
    for stream in {stream for stream, _ in heard}:
        seqs = [seq for each, seq in heard if each == stream]
        assert seqs == list(range(1, len(seqs) + 1))
    seen, read = Cursor(), list[tuple[str, int]]()
    while page := await journals[2].read_since(seen, limit=4):
        for event in page:
            read.append((event.stream, event.seq))
            seen = Cursor.parse(str(seen.after(event.position)))
    assert sorted(read) == sorted(heard) == sorted(set(heard))
    for stream in {stream for stream, _ in read}:
        seqs = [seq for each, seq in read if each == stream]
        assert seqs == sorted(seqs)
    assert seen == await journals[0].cursor()
    assert seen.events == 30
    for each in journals:
        await each.close()


async def test_the_audit_of_several_writers_is_paged_by_time(postgres: Server) -> None:
    url = postgres.new_database()
    journals = [await opened(url) for _ in range(3)]
    for n in range(25):
        by = "bob" if n % 4 == 0 else "ada"
        kind = "noise.v1" if n == 12 else "thing.happened.v1"
        await journals[n % 3].append(f"s{n % 2}", [Draft(kind, by, str(n).encode())])

    def describe(event: Event) -> Fact:
        return Fact(kind="other", text=event.body.decode())

    async def told(wanted: AuditFilter, *never: str) -> list[int]:
        found: list[int] = []
        while True:
            page = await journals[0].ask(
                lambda connection, wanted=wanted: audit_page(
                    connection, "editor", wanted, describe, frozenset(never)
                )
            )
            found += [int(row.text) for row in page.rows]
            if page.before is None:
                return found
            wanted = msgspec.structs.replace(wanted, before=page.before)

    assert await told(AuditFilter(limit=4)) == list(range(25))[::-1]
    assert await told(AuditFilter(limit=2, person="bob"), "noise.v1") == [24, 20, 16, 8, 4, 0]
    at = {int(each.body): each.at for each in await whole_log(journals[0])}
    within = AuditFilter(limit=2, since=at[5], until=at[20])
    assert await told(within) == [n for n in range(24, -1, -1) if at[5] <= at[n] < at[20]]
    for each in journals:
        await each.close()


async def test_the_end_of_the_log_of_several_writers_is_found_again_later(postgres: Server) -> None:
    url = postgres.new_database()
    journals = [await opened(url) for _ in range(2)]
    for n in range(6):
        await journals[n % 2].append("people", [draft(str(n))])
    then = await journals[0].cursor()
    line = await head_at(journals[0], "editor", then, lambda _: [])
    for n in range(6):
        await journals[n % 2].append("people", [draft(str(n))])
    assert await head_at(journals[1], "editor", Cursor.parse(str(then)), lambda _: []) == line
    now = await journals[0].cursor()
    assert (await head_at(journals[0], "editor", now, lambda _: [])).digest != line.digest
    assert now.covers(then)
    assert not then.covers(now)
    for each in journals:
        await each.close()


async def test_a_copy_of_a_log_of_several_writers_is_sound(
    postgres: Server, tmp_path: Path
) -> None:
    url = postgres.new_database()
    journals = [await opened(url, people) for _ in range(3)]
    dice = random.Random(3)
    for n in range(40):
        await dice.choice(journals).append(f"s{dice.randrange(5)}", [draft(str(n))])
    for each in journals:
        await each.close()
    target = f"sqlite:///{tmp_path / 'copy.db'}"
    back = postgres.new_database()
    for source, into in ((url, target), (target, back)):
        copied = await asyncio.to_thread(
            copy, database_of(source), database_of(into), branch="editor", fold=nothing
        )
        assert copied == 40
        journal = await opened(into, several=False)
        assert await journal.verify() == []
        assert await journal.rebuild() == 40
        assert (await journal.cursor()).events == 40
        await journal.close()
