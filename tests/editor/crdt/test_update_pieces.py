"""A large document that is applied in pieces is the document, and no piece waits for a later one."""

import asyncio
import random
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pycrdt import Array, Doc, Map, Text

from action_assistant.editor.crdt import loading
from action_assistant.editor.crdt.applying import clocks
from action_assistant.editor.crdt.replica import Replica
from action_assistant.editor.crdt.updates.update_pieces import PIECE_BYTES, pieces_of
from action_assistant.editor.crdt.updates.update_scan import stored_outline
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.journal.events import Draft, nothing
from action_assistant.journal.journal import Journal
from editor.client import STREAM
from editor.random_updates import random_update


def change(chance: random.Random, doc: Doc[Any]) -> None:
    """Do something to a document that others change, too."""
    things = doc.get("things", type=Map)
    key = f"k{chance.randrange(8)}"
    match chance.randrange(6):
        case 0:
            things[key] = chance.choice(["a", 1.5, {"x": [1, None]}, "😀" * 3])
        case 1 if key in things:
            del things[key]
        case 2:
            things[key] = Map({"inside": "1", "list": Array(["a", "b"])})
        case 3 if isinstance(things.get(key), Map):
            things[key]["more"] = "2"
        case 4:
            text = doc.get("text", type=Text)
            text.insert(chance.randint(0, len(text)), chance.choice(["ab", "cdef"]))
        case _:
            text = doc.get("text", type=Text)
            if len(text) > 2:
                start = chance.randrange(len(text) - 1)
                del text[start : start + 2]


def written(seed: int, steps: int) -> bytes:
    """The document of three people who write, and hear of each other now and then."""
    chance = random.Random(seed)
    docs: list[Doc[Any]] = [Doc(client_id=n + 1) for n in range(3)]
    for _ in range(steps):
        change(chance, chance.choice(docs))
        if chance.random() < 0.3:
            one, other = chance.sample(docs, 2)
            other.apply_update(one.get_update(other.get_state()))
    for one in docs[1:]:
        docs[0].apply_update(one.get_update(docs[0].get_state()))
    update: bytes = docs[0].get_update()
    return update


def check_pieces(whole: bytes, size: int) -> int:
    """Apply an update in pieces; how many there were."""
    pieces = pieces_of(whole, size)
    expected: Doc[Any] = Doc()
    expected.apply_update(whole)
    doc: Doc[Any] = Doc()
    for piece in pieces:
        doc.apply_update(piece)
        reached = clocks(doc.get_state())  # nothing waits: what the piece brings is there at once
        assert all(reached[client] >= end for client, _, end in stored_outline(piece).brings)
    assert clocks(doc.get_state()) == clocks(expected.get_state())
    # The deletions are equal, too; the library may keep deleted things in another form.
    assert doc.get_update(doc.get_state()) == expected.get_update(expected.get_state())
    assert doc.get("things", type=Map).to_py() == expected.get("things", type=Map).to_py()
    assert str(doc.get("text", type=Text)) == str(expected.get("text", type=Text))
    return len(pieces)


@settings(deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 120), st.integers(1, 200))
@example(1, 120, 1)
def test_a_document_of_several_people_is_the_same_in_pieces(
    seed: int, steps: int, size: int
) -> None:
    check_pieces(written(seed, steps), size)


def test_a_large_document_of_several_people_has_many_pieces() -> None:
    assert check_pieces(written(5, 400), 64) > 20


def test_a_small_update_is_left_alone() -> None:
    whole = written(1, 20)
    assert pieces_of(whole) == [whole]


@pytest.mark.parametrize("seed", range(200))
def test_an_update_that_cannot_be_split_is_left_alone(seed: int) -> None:
    chance = random.Random(seed)
    update = random_update(chance, 7, 3, {5: 4}, most=8)
    for damaged in (update, update[:-1], b"\x02" + update[1:]):
        pieces = pieces_of(damaged, 1)
        assert pieces == [damaged] or b"".join(pieces)  # never an error


async def test_a_large_room_is_opened_with_turns_of_the_loop_between_its_pieces(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    doc: Doc[Any] = Doc()
    with doc.transaction():
        things = doc.get("things", type=Map)
        for n in range(12_000):
            things[f"key {n}"] = "x" * 100
    largest, turns = 0, 0
    apply = Replica._apply

    def noted(self: Replica, *updates: bytes) -> None:
        nonlocal largest
        largest = max(largest, *map(len, updates))
        apply(self, *updates)

    async def aside(work: Any, /, *args: Any) -> Any:
        return await asyncio.to_thread(work, *args)

    def turn() -> None:
        nonlocal turns
        turns += 1
        asyncio.get_running_loop().call_soon(turn)

    journal = await Journal.open(
        f"sqlite:///{tmp_path / 'editor.db'}", branch="editor", fold=nothing
    )
    try:
        await journal.append(STREAM, [Draft("graph.updated.v1", "ada", doc.get_update())])
        rooms = Rooms(journal, window=0)
        async with rooms.enter(STREAM):  # makes a snapshot when it is let go
            pass
        await rooms.close()
        monkeypatch.setattr(Replica, "_apply", noted)
        turn()
        begun = turns
        loaded = await loading.load(journal, STREAM, run_in_worker=aside)
        assert loaded.replica.state() == doc.get_update()
        assert largest < 2 * PIECE_BYTES
        assert turns - begun >= len(doc.get_update()) // PIECE_BYTES
    finally:
        await journal.close()
