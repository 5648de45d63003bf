"""Page and room notice when they show different things although each believes to be up to date."""

from typing import Any

import pytest
from pycrdt import Doc, Map

from action_assistant.editor.crdt import messages
from action_assistant.editor.documents import document
from action_assistant.editor.documents.fingerprint import Fingerprint, fingerprint
from action_assistant.editor.rooms.open_rooms import Rooms
from editor import forged_updates
from editor.client import Client, settle

STREAM = "graph/g"


def test_the_fingerprint_is_what_the_page_makes() -> None:
    shown = {
        "meta": {"name": "Größe 😀", "schema": 1},
        "actions": {"abc": "Go", "abc|missing": False, "abc|order": -0.0},
        "positions": {"abc": [1.5, -2]},
        "comments": {"t/1": None},
    }
    assert fingerprint(shown) == Fingerprint(7, 10955581501)
    assert fingerprint({}) == Fingerprint(0, 0)


@pytest.mark.parametrize(
    "other",
    [
        {"meta": {"name": "b"}},
        {"meta": {"nama": "a"}},
        {"actions": {"name": "a"}},
        {"meta": {"name": True}},
        {"meta": {"name": 1.0}},
        {"meta": {"name": "a", "more": "a"}},
        {},
    ],
)
def test_different_documents_have_different_fingerprints(
    other: dict[str, dict[str, object]],
) -> None:
    assert fingerprint(other) != fingerprint({"meta": {"name": "a"}})


def compare(client: Client, doc: Doc[Any]) -> None:
    found = fingerprint(document.maps_of(doc))
    client.deliver(messages.compared(client.seq, found.entries, found.total))


async def test_a_page_that_shows_something_else_is_told_and_it_is_reported(rooms: Rooms) -> None:
    ada, eve = Client("ada"), Client("eve")
    async with rooms.enter(STREAM) as room:
        for client in (ada, eve):
            client.join(room)
        ada.doc.get("meta", type=Map)["name"] = "task"
        await settle(ada, eve)
        for client in (ada, eve):
            compare(client, client.doc)
            await room.quiet()
            await settle(client)
        assert ada.told == eve.told == fingerprint(document.maps_of(ada.doc))
        assert room.comparisons.divergences == 0
        # Another document received something that the room does not have.
        other: Doc[Any] = Doc()
        other.apply_update(forged_updates.entry(ada.doc.client_id, 0, "name", "other", root="meta"))
        assert other.get_state() == ada.doc.get_state()
        compare(eve, other)
        await room.quiet()
        await settle(eve)
        assert room.comparisons.divergences == 1
        assert eve.told == fingerprint(document.maps_of(ada.doc))


async def test_a_comparison_of_another_moment_says_nothing(rooms: Rooms) -> None:
    ada, bob = Client("ada"), Client("bob")
    async with rooms.enter(STREAM) as room:
        for client in (ada, bob):
            client.join(room)
        await settle(ada, bob)
        ada.doc.get("meta", type=Map)["name"] = "task"
        ada.speak()
        await room.quiet()
        compare(bob, bob.doc)  # has not heard of it yet
        await settle(ada, bob)
        assert room.comparisons.divergences == 0
        assert bob.told is None
