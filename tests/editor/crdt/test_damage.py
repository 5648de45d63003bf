"""A log with a damaged row: its graph opens read-only where it was last good; others do not notice."""

import contextlib
import shutil
import sqlite3
from pathlib import Path
from typing import Any

import pytest
from pycrdt import Doc, Map

from action_assistant.editor.crdt import loading, messages
from action_assistant.editor.crdt.loading import load
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import Conflict
from action_assistant.journal.events import Draft, nothing
from action_assistant.journal.journal import Journal
from editor import forged_updates
from editor.client import Client, settle
from editor.process import Editor

STREAM = "graph/g"
EVENTS = 30


@pytest.fixture
async def folder(tmp_path: Path) -> Path:
    """A log of one graph that says `k` is 0, 1, 2 …, and of another one."""
    journal = await opened(tmp_path)
    doc: Doc[Any] = Doc()
    things = doc.get("things", type=Map)
    made: list[bytes] = []
    subscription = doc.observe(lambda event: made.append(event.update))
    for n in range(EVENTS):
        things["k"] = float(n)
    doc.unobserve(subscription)
    await journal.append(STREAM, [Draft("graph.updated.v1", "ada", update) for update in made])
    await journal.append("graph/other", [Draft("graph.updated.v1", "ada", made[0])])
    await journal.close()
    return tmp_path


async def opened(folder: Path) -> Journal:
    return await Journal.open(f"sqlite:///{folder / 'editor.db'}", branch="editor", fold=nothing)


def spoil(folder: Path, change: str, *values: object) -> None:
    with contextlib.closing(sqlite3.connect(folder / "editor.db")) as database, database:
        assert database.execute(change, values).rowcount == 1


SPOILS = [
    "UPDATE event SET body = zeroblob(length(body)) WHERE stream = 'graph/g' AND seq = 12",
    "UPDATE event SET body = x'0101ff' WHERE stream = 'graph/g' AND seq = 12",
    "UPDATE event SET author = 'eve' WHERE stream = 'graph/g' AND seq = 12",
    "UPDATE event SET author = CAST(x'ff' AS TEXT) WHERE stream = 'graph/g' AND seq = 12",
    "UPDATE event SET body = 'text' WHERE stream = 'graph/g' AND seq = 12",
    "UPDATE event SET author = x'616461' WHERE stream = 'graph/g' AND seq = 12",
    "UPDATE event SET kind = 5 WHERE stream = 'graph/g' AND seq = 12",
    "UPDATE event SET at = 'then' WHERE stream = 'graph/g' AND seq = 12",
    "UPDATE event SET position = 12.5 WHERE stream = 'graph/g' AND seq = 12",
    "UPDATE event SET chain = 'text' WHERE stream = 'graph/g' AND seq = 12",
    "UPDATE event SET seq = 99 WHERE stream = 'graph/g' AND seq = 12",
    "UPDATE event SET stream = 'graph/h' WHERE stream = 'graph/g' AND seq = 12",
    "DELETE FROM event WHERE stream = 'graph/g' AND seq = 12",
]


async def test_a_gap_wider_than_what_is_read_at_once_is_seen_in_a_past_state_too(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loading, "SLICES", (8, 4))
    with contextlib.closing(sqlite3.connect(folder / "editor.db")) as database, database:
        database.execute("DELETE FROM event WHERE stream = 'graph/g' AND seq BETWEEN 8 AND 25")
    journal = await opened(folder)
    for upto in (None, 28, 10):
        loaded = await load(journal, STREAM, upto=upto)
        assert loaded.seq == 7
        assert loaded.damaged is not None, upto
        assert loaded.damaged.seq == 8
    before = await load(journal, STREAM, upto=7)
    assert (before.seq, before.damaged) == (7, None)
    await journal.close()


@pytest.mark.parametrize("change", SPOILS)
async def test_a_damaged_row_leaves_what_was_before_it(folder: Path, change: str) -> None:
    spoil(folder, change)
    journal = await opened(folder)
    loaded = await load(journal, STREAM)
    assert loaded.seq == 11
    assert loaded.damaged is not None
    assert loaded.damaged.seq == 12
    assert loaded.replica.doc.get("things", type=Map).to_py() == {"k": 10.0}
    await journal.close()


async def test_a_row_that_was_stored_but_cannot_be_applied_is_damage_too(folder: Path) -> None:
    journal = await opened(folder)
    bad = [Draft("graph.updated.v1", "ada", body) for body in (b"nonsense", forged_updates.entry(5, 0, "a", "b"))]  # fmt: skip
    await journal.append(STREAM, bad)
    loaded = await load(journal, STREAM)
    assert loaded.seq == EVENTS
    assert loaded.damaged is not None
    assert loaded.damaged.seq == EVENTS + 1
    await journal.close()


async def test_each_flipped_byte_of_a_body_is_found(folder: Path, tmp_path: Path) -> None:
    with contextlib.closing(sqlite3.connect(folder / "editor.db")) as database:
        (body,) = database.execute(
            "SELECT body FROM event WHERE stream = 'graph/g' AND seq = 20"
        ).fetchone()
    for place in range(len(body)):
        copy = tmp_path / f"copy{place}"
        copy.mkdir()
        shutil.copy(folder / "editor.db", copy)
        flipped = bytearray(body)
        flipped[place] ^= 1 << (place % 8)
        spoil(copy, "UPDATE event SET body = ? WHERE stream = 'graph/g' AND seq = 20", bytes(flipped))  # fmt: skip
        journal = await opened(copy)
        loaded = await load(journal, STREAM)
        assert (loaded.seq, loaded.replica.doc.get("things", type=Map).to_py()) == (19, {"k": 18.0})
        await journal.close()


async def test_the_room_of_a_damaged_graph_can_only_be_read(folder: Path) -> None:
    spoil(folder, SPOILS[0])
    journal = await opened(folder)
    rooms = Rooms(journal, linger=60, window=0)
    ada, eve = Client("ada"), Client("eve")
    async with rooms.enter(STREAM) as room, rooms.enter("graph/other") as other:
        ada.join(room)
        eve.join(room)
        await settle(ada, eve)
        assert ada.things == {"k": 10.0}
        assert ada.read_only == "This graph can only be read: change 12 of its history is damaged."
        eve.map["k"] = "new"
        await settle(ada, eve)
        assert eve.member is not None
        assert await eve.member.ended() == messages.FORBIDDEN
        with pytest.raises(Conflict, match="can only be read"):
            await room.submit(forged_updates.entry(9, 0, "a", "b"), "ada")
        bob = Client("bob")
        bob.join(other)
        bob.map["new"] = "edit"
        await settle(bob)
        assert bob.durable == 2  # its step 2, its edit
    await rooms.close()
    assert await journal.newest(STREAM) == EVENTS
    assert await journal.snapshot(STREAM) is None
    await journal.close()


async def test_a_list_of_graphs_shows_which_one_is_damaged(tmp_path: Path) -> None:
    editor = Editor(tmp_path / "data")
    editor.start()
    with editor.client() as http:
        made = [http.post("/api/graphs", json={"name": name}).json()["id"] for name in ("a", "b")]
        http.patch(f"/api/graphs/{made[0]}", json={"description": "later"})
    editor.kill()
    spoil(
        editor.data,
        "UPDATE event SET body = x'00' WHERE stream = ? AND seq = 2",
        f"graph/{made[0]}",
    )
    editor.start()
    with editor.client() as http:
        shown = {each["id"]: each for each in http.get("/api/graphs").json()}
        assert shown[made[0]]["damaged"] == 2
        assert "damaged" not in shown[made[1]]
        assert http.get(f"/api/graphs/{made[0]}/umrf").json()["graph_name"] == "a"
        refused = http.patch(f"/api/graphs/{made[0]}", json={"description": "again"})
        assert (refused.status_code, refused.json()["type"]) == (409, "conflict")
        assert http.get(f"/api/graphs/{made[0]}/problems?seq=2").status_code == 503
        assert http.patch(f"/api/graphs/{made[1]}", json={"description": "x"}).status_code == 200
        assert http.get("/api/actions").status_code == 200
    editor.end()
