"""A large edit is applied in pieces: the loop has turns between them, and nobody sees one of them alone."""

import asyncio
from pathlib import Path
from typing import Any

import pytest
from pycrdt import Doc, Map

from action_assistant.editor.crdt import replica as replica_module
from action_assistant.editor.crdt.messages import Malformed
from action_assistant.editor.crdt.replica import Replica
from action_assistant.editor.crdt.updates.update_pieces import PIECE_BYTES
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import Overtaken, Refused
from action_assistant.journal.events import nothing
from action_assistant.journal.journal import Journal
from editor.client import STREAM, Client, settle


async def aside(work: Any, /, *args: Any) -> Any:
    """Work in a thread, as workers are beside the loop."""
    return await asyncio.to_thread(work, *args)


def large_update(entries: int = 12_000) -> bytes:
    """One edit of more than a MB."""
    doc: Doc[Any] = Doc()
    with doc.transaction():
        things = doc.get("things", type=Map)
        for n in range(entries):
            things[f"key {n}"] = "x" * 80
    update: bytes = doc.get_update()
    return update


@pytest.fixture
def applied(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The bytes of each call of the CRDT library that changes the document of a room."""
    sizes: list[int] = []
    ready, several = replica_module.apply_updates, Replica._apply

    def apply_updates(doc: Any, *updates: bytes) -> None:
        sizes.append(sum(map(len, updates)))
        ready(doc, *updates)

    def _apply(self: Replica, *updates: bytes) -> None:
        sizes.append(sum(map(len, updates)))
        several(self, *updates)

    monkeypatch.setattr(replica_module, "apply_updates", apply_updates)
    monkeypatch.setattr(Replica, "_apply", _apply)
    return sizes


async def test_a_large_edit_is_one_event_and_no_large_call(
    tmp_path: Path, applied: list[int]
) -> None:
    update = large_update()
    journal = await Journal.open(
        f"sqlite:///{tmp_path / 'editor.db'}", branch="editor", fold=nothing
    )
    try:
        rooms = Rooms(journal, linger=60, window=0, run_in_worker=aside, tried=aside)
        ada = Client("ada")
        async with rooms.enter(STREAM) as room:
            ada.join(room)
            await settle(ada)
            applied.clear()
            editing = asyncio.create_task(room.submit(update, "server"))
            seen = set[int]()
            while not editing.done():
                seen.add(len(ada.things))
                await asyncio.sleep(0)
            assert await editing == 1
            assert max(applied) < 2 * PIECE_BYTES
            assert len(applied) >= len(update) // PIECE_BYTES
            await settle(ada)
            assert seen == {0}
            assert len(ada.things) == 12_000
            ada.map["later"] = "1"
            await settle(ada)
        (first, second) = await journal.read(STREAM)
        assert first.body == update
        assert (second.author, second.seq) == ("ada", 2)
        await rooms.close()
    finally:
        await journal.close()


async def test_a_large_edit_that_others_overtook_is_not_even_tried(tmp_path: Path) -> None:
    journal = await Journal.open(
        f"sqlite:///{tmp_path / 'editor.db'}", branch="editor", fold=nothing
    )
    tried = list[object]()

    async def trial(work: Any, *args: Any) -> Any:
        tried.append(work)
        return await aside(work, *args)

    try:
        rooms = Rooms(journal, linger=60, window=0, run_in_worker=aside, tried=trial)
        ada = Client("ada")
        async with rooms.enter(STREAM) as room:
            ada.join(room)
            ada.map["a"] = "1"
            await settle(ada)
            with pytest.raises(Overtaken):
                await room.submit(large_update(), "server", 0)
            assert tried == []
            assert await room.submit(large_update(), "server", 1) == 2
        await rooms.close()
    finally:
        await journal.close()


async def test_a_piece_that_cannot_be_applied_leaves_the_document_as_the_log_has_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = await Journal.open(
        f"sqlite:///{tmp_path / 'editor.db'}", branch="editor", fold=nothing
    )
    try:
        rooms = Rooms(journal, linger=60, window=0, run_in_worker=aside, tried=aside)
        ada = Client("ada")
        async with rooms.enter(STREAM) as room:
            ada.join(room)
            ada.map["a"] = "1"
            await settle(ada)
            count, open_piece = 0, Replica.open_piece

            def failing(self: Replica, piece: bytes) -> float:
                nonlocal count
                count += 1
                if count == 5:
                    raise Malformed("as if")
                return open_piece(self, piece)

            monkeypatch.setattr(Replica, "open_piece", failing)
            with pytest.raises(Refused):
                await room.submit(large_update(), "server")
            monkeypatch.setattr(Replica, "open_piece", open_piece)
            things = (await room.quiet()).doc.get("things", type=Map).to_py()
            assert things == {"a": "1"}
            ada.map["b"] = "2"
            await settle(ada)
            assert room.seq == 2
        await rooms.close()
    finally:
        await journal.close()
