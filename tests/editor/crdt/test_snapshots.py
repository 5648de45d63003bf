"""Snapshots are a cache: gone, damaged or old ones make no difference but time."""

import hashlib
import pickle
import sqlite3
import zlib
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from pycrdt import Doc, Map

from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.crdt.loading import Loaded, load
from action_assistant.editor.log.graph_events import UPDATED
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import BadInput
from action_assistant.journal.events import Draft, nothing
from action_assistant.journal.journal import Journal
from editor.client import Client, settle

Change = Callable[[sqlite3.Connection], Any]


def proof(database: sqlite3.Connection, seq: int, state: bytes) -> bytes:
    """Return the proof that ties a state to the event of its moment; also for a wrong state."""
    (body,) = database.execute("SELECT body FROM event WHERE seq = ?", (seq,)).fetchone()
    return hashlib.sha256(hashlib.sha256(body).digest() + state).digest()


def forged(database: sqlite3.Connection) -> None:
    """Bytes that are no snapshot of ours, with a proof that fits."""
    (seq,) = database.execute("SELECT seq FROM snapshot").fetchone()
    state = b"\x94\x01 rubbish"
    database.execute(
        "UPDATE snapshot SET state = ?, proof = ?", (state, proof(database, seq, state))
    )


CHANGES: dict[str, Change] = {
    "as it was made": lambda _: None,
    "gone": lambda database: database.execute("DELETE FROM snapshot"),
    "one byte of it changed": lambda database: database.execute(
        "UPDATE snapshot SET state = substr(state, 1, 40) || x'00' || substr(state, 42)"
    ),
    "cut short": lambda database: database.execute("UPDATE snapshot SET state = substr(state, 1, 99)"),
    "said to be younger": lambda database: database.execute("UPDATE snapshot SET seq = seq + 1"),
    "said to be older": lambda database: database.execute("UPDATE snapshot SET seq = seq - 5"),
    "beyond the end of the log": lambda database: database.execute("UPDATE snapshot SET seq = 9999"),
    "forged": forged,
}  # fmt: skip


async def written(path: Path) -> None:
    """A log of three people who write and delete, with a snapshot in its middle."""
    journal = await Journal.open(f"sqlite:///{path}", branch="editor", fold=nothing)
    rooms = Rooms(journal, linger=60, window=0)
    people = [Client(name) for name in ("ada", "bob", "cem")]
    async with rooms.enter("graph/g") as room:
        for person in people:
            person.join(room)
        await settle(*people)
        for n in range(60):
            person = people[n % 3]
            person.map[f"{person.person.id} {n // 6}"] = n
            if n % 7 == 6:
                del person.map[next(iter(person.map.keys()))]
            await settle(*people)
            if n == 30:
                await room._snapshots.store_now(room.seq, room._replica)
                old = await journal.snapshot("graph/g")
        for person in people:
            person.leave()
    await rooms.close()
    assert old is not None
    await journal.keep_snapshot("graph/g", old.seq, old.state)  # the one in the middle stands
    await journal.close()


def held(loaded: Loaded) -> tuple[Any, ...]:
    """Return all that a loaded document knows."""
    replica = loaded.replica
    things = replica.doc.get("things", type=Map).to_py()
    state = replica.doc.get_state()
    return loaded.seq, things, sorted(state), replica.owners, loaded.damaged


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
async def test_the_document_is_the_same_with_any_or_no_snapshot(
    change: Change, tmp_path: Path
) -> None:
    path = tmp_path / "editor.db"
    await written(path)
    with closing(sqlite3.connect(path)) as database:
        before = database.execute("SELECT seq FROM snapshot").fetchall()
        change(database)
        database.commit()
    journal = await Journal.open(f"sqlite:///{path}", branch="editor", fold=nothing)
    found = await load(journal, "graph/g")
    whole = await load(journal, "graph/g", learn=True, upto=await journal.newest("graph/g"))
    await journal.close()
    with closing(sqlite3.connect(path)) as database:
        database.execute("DELETE FROM snapshot")
        database.commit()
    journal = await Journal.open(f"sqlite:///{path}", branch="editor", fold=nothing)
    replayed = await load(journal, "graph/g")
    await journal.close()
    assert before == [(before[0][0],)]
    assert 0 < before[0][0] < replayed.seq
    assert held(found) == held(replayed) == held(whole)


def later_edits(count: int) -> list[bytes]:
    """Return `count` updates of one client, each of which waits for the one before it."""
    doc, made = Doc[Any](), list[bytes]()
    subscription = doc.observe(lambda event: made.append(event.update))
    for n in range(count):
        doc.get("things", type=Map)[f"late {n}"] = n
    doc.unobserve(subscription)
    return made


async def test_an_update_that_waits_for_ever_does_not_stop_snapshots(tmp_path: Path) -> None:
    first, second, third = later_edits(3)
    path = f"sqlite:///{tmp_path / 'editor.db'}"
    journal = await Journal.open(path, branch="editor", fold=nothing)
    rooms = Rooms(journal, linger=60, window=0)
    async with rooms.enter("graph/g") as room:
        await room.submit(third, "late")
        await room.submit(second, "late")
        for update in later_edits(30):
            await room.submit(update, "ada")
        newest = room.seq
    await rooms.close()
    kept = await journal.snapshot("graph/g")
    assert kept is not None
    assert kept.seq == newest
    loaded = await load(journal, "graph/g")
    assert loaded.kept == newest
    assert set(loaded.replica.waiting) == {second, third}
    rooms = Rooms(journal, linger=60, window=0)
    async with rooms.enter("graph/g") as room:
        await room.submit(first, "late")
        replica = await room.quiet()
        shown = replica.doc.get("things", type=Map).to_py() or {}
        assert {key for key in shown if key.startswith("late")} >= {"late 0", "late 1", "late 2"}
        assert replica.waiting == ()
        assert replica.owners[min(replica.owners)] in {"late", "ada"}
    await rooms.close()
    events = await journal.read("graph/g")
    assert [second, third] == sorted([e.body for e in events[:2]], key=[second, third].index)
    await journal.close()


async def test_a_waiting_update_keeps_its_author_after_a_snapshot(
    tmp_path: Path,
) -> None:
    first, second = later_edits(2)
    path = f"sqlite:///{tmp_path / 'editor.db'}"
    journal = await Journal.open(path, branch="editor", fold=nothing)
    rooms = Rooms(journal, linger=60, window=0)
    async with rooms.enter("graph/g") as room:
        await room.submit(second, "late")
    await rooms.close()
    assert await journal.snapshot("graph/g") is not None
    rooms = Rooms(journal, linger=60, window=0)
    async with rooms.enter("graph/g") as room:
        with pytest.raises(BadInput, match="somebody else"):
            await room.submit(first, "eve")
    await rooms.close()
    await journal.close()


def large() -> Doc[Any]:
    """A document of more than 1 MiB."""
    doc: Doc[Any] = Doc()
    notes = doc.get("notes", type=Map)
    with doc.transaction():
        for n in range(16_000):
            notes[f"note {n}"] = f"The value of note {n} is written out here, to be long enough."
    return doc


async def test_the_snapshot_of_a_large_document_is_stored_packed(tmp_path: Path) -> None:
    path = tmp_path / "editor.db"
    journal = await Journal.open(f"sqlite:///{path}", branch="editor", fold=nothing)
    doc = large()
    notes = doc.get("notes", type=Map)
    rooms = Rooms(journal, linger=60, window=0)
    async with rooms.enter("graph/g") as room:
        await room.submit(doc.get_update(), "ada")
    await rooms.close()
    snapshot = await journal.snapshot("graph/g")
    assert snapshot is not None
    assert snapshot.seq == 1
    assert len(doc.get_update()) > 1 << 20
    assert len(snapshot.state) < len(doc.get_update()) // 3
    packed = await load(journal, "graph/g")
    await journal.keep_snapshot(
        "graph/g", 1, zlib.decompress(snapshot.state)
    )  # of an older version
    plain = await load(journal, "graph/g")
    await journal.close()
    for found in (packed, plain):
        assert (found.seq, found.kept) == (1, 1)
        assert found.replica.doc.get_state() == doc.get_state()
        assert found.replica.doc.get("notes", type=Map).to_py() == notes.to_py()
        assert found.replica.owners == {doc.client_id: "ada"}


async def test_a_packed_snapshot_that_is_damaged_makes_no_difference(tmp_path: Path) -> None:
    journal = await Journal.open(
        f"sqlite:///{tmp_path / 'editor.db'}", branch="editor", fold=nothing
    )
    doc: Doc[Any] = Doc()
    doc.get("notes", type=Map)["a"] = "b"
    rooms = Rooms(journal, linger=60, window=0)
    async with rooms.enter("graph/g") as room:
        await room.submit(doc.get_update(), "ada")
    await rooms.close()
    whole = zlib.compress(b"what is no snapshot", level=1)
    for state in (whole, whole[:-1], whole[:5] + bytes(9)):
        await journal.keep_snapshot("graph/g", 1, state)
        found = await load(journal, "graph/g")
        assert (found.seq, found.kept) == (1, 0)
        assert found.replica.doc.get("notes", type=Map).to_py() == {"a": "b"}
    await journal.close()


async def test_a_large_document_travels_packed_between_processes(tmp_path: Path) -> None:
    """The event loop copies all values that it pickles for a worker and gets back."""
    journal = await Journal.open(
        f"sqlite:///{tmp_path / 'editor.db'}", branch="editor", fold=nothing
    )
    doc, sizes = large(), list[int]()
    notes, whole = doc.get("notes", type=Map), len(doc.get_update())

    async def in_worker(work: Callable[..., Any], /, *values: Any) -> Any:
        found = work(*values)
        sizes.extend(len(pickle.dumps(each)) for each in (values, found))
        return found

    rooms = Rooms(journal, linger=60, window=0)
    async with rooms.enter("graph/g") as room:
        await room.submit(doc.get_update(), "ada")
    await rooms.close()
    closed = Rooms(journal)
    assert (await GraphReader(journal, closed, in_worker).now("g")).seq == 1
    before = doc.get_state()
    notes["one more"] = "value"
    await journal.append("graph/g", [Draft(UPDATED, "ada", doc.get_update(before))])
    reader = GraphReader(journal, closed, in_worker)
    for seq in (1, 2):
        sight = await reader.at("g", seq)
        assert sight.seq == seq
        read: Doc[Any] = Doc()
        read.apply_update(sight.state)
        assert len(read.get("notes", type=Map)) == 15_999 + seq
    assert len(sizes) == 2
    assert max(sizes) < whole // 3
    await closed.close()
    await journal.close()
