"""Characters of two clocks: nothing comes between the two, however a document was opened."""

from collections.abc import Callable
from typing import Any

import pytest
from pycrdt import Doc, Text

from action_assistant.editor.crdt.loading import fold, fold_sound
from action_assistant.editor.crdt.messages import Malformed, number, text
from action_assistant.editor.crdt.replica import EventColumns, Replica, ReplicaState, UpdateEffect
from action_assistant.editor.crdt.updates.paired_texts import MOST_BYTES
from action_assistant.editor.log.graph_events import UPDATED


def written(words: str, *, client: int = 7, clock: int = 0) -> bytes:
    """A text of a client, at the beginning of a root."""
    head = b"\x01\x01" + number(client) + number(clock)
    return head + b"\x04\x01" + text(b"text") + text(words.encode()) + b"\x00"


def deleted(start: int, count: int, *, client: int = 7) -> bytes:
    return b"\x00\x01" + number(client) + b"\x01" + number(start) + number(count)


def beside(kind: int, *ids: int, by: int = 9) -> bytes:
    """A letter beside these clocks of client 7."""
    neighbours = b"".join(b"\x07" + number(clock) for clock in ids)
    return b"\x01\x01" + number(by) + b"\x00" + bytes((kind,)) + neighbours + b"\x01x\x00"


#: Updates of a document with "x😀y" by client 7, whose clocks 1 and 2 are one character.
WITHIN = {
    "deletes its beginning": deleted(1, 1),
    "deletes from before it": deleted(0, 2),
    "deletes its end": deleted(2, 2),
    "stands after its beginning": beside(0x84, 1),
    "stands before its end": beside(0x44, 2),
    "stands between": beside(0xC4, 1, 2),
}
BESIDE = {
    "deletes it": deleted(1, 2),
    "deletes what is before it": deleted(0, 1),
    "deletes all": deleted(0, 4),
    "stands after it": beside(0x84, 2),
    "stands before it": beside(0x44, 1),
}


def live() -> Replica:
    replica = Replica()
    replica.take(written("x😀y"), "ada")
    return replica


def read_again(kept: bytes) -> Replica:
    replica = ReplicaState.replica(kept)
    assert replica is not None
    return replica


def events() -> EventColumns:
    return EventColumns(1, [UPDATED], ["ada"], [written("x😀y")])


def replayed() -> Replica:
    folded = fold(b"", events(), learn=True)
    assert folded is not None
    return read_again(folded.document)


def replayed_by_a_worker() -> Replica:
    folded = fold_sound(b"", events())
    assert folded is not None
    return read_again(folded.document)


def of_an_older_snapshot() -> Replica:
    replica = live()
    kept = ReplicaState(
        "with what waits", replica.owners, replica.nesting.spans, replica.doc.get_update()
    )
    replica = Replica()
    replica.begin(kept)
    return replica


OPENED: list[Callable[[], Replica]] = [
    live,
    replayed,
    replayed_by_a_worker,
    of_an_older_snapshot,
    lambda: read_again(ReplicaState.of(live())),
]


@pytest.mark.parametrize("opened", OPENED)
@pytest.mark.parametrize("name", WITHIN)
def test_no_item_is_inserted_between_the_two_clocks_of_a_character(
    opened: Callable[[], Replica], name: str
) -> None:
    replica = opened()
    before = replica.doc.get_update()
    with pytest.raises(Malformed, match="within one character"):
        replica.take(WITHIN[name], "eve")
    assert replica.doc.get_update() == before


@pytest.mark.parametrize("name", BESIDE)
def test_beside_it_all_is_as_ever(name: str) -> None:
    assert live().take(BESIDE[name], "bob") is UpdateEffect.NEWS


def test_an_update_may_not_part_what_it_brings() -> None:
    own = written("😀")[:-1] + b"\x01\x07\x01\x01\x01"
    with pytest.raises(Malformed, match="within one character"):
        Replica().take(own, "eve")


def test_a_text_is_not_begun_within_a_character() -> None:
    replica = Replica()
    replica.take(written("x"), "eve")
    with pytest.raises(Malformed, match="within one character"):
        replica.take(written("😀"), "eve")


def test_a_waiting_update_is_checked_when_it_is_released() -> None:
    replica = Replica()
    assert replica.take(deleted(1, 1), "eve") is UpdateEffect.WAITS
    assert replica.take(written("x😀y"), "ada") is UpdateEffect.NEWS
    assert replica.released() == []
    assert not replica.waits
    assert replica.doc.get_update() == live().doc.get_update()


def test_nobody_says_where_the_characters_of_others_are() -> None:
    replica = Replica()
    replica.take(written("xabcy"), "ada")
    both = b"\x02" + written("😀", client=9)[1:-1] + written("x😀y")[1:-1] + b"\x00"
    assert replica.take(both, "eve") is UpdateEffect.NEWS
    assert replica.take(deleted(1, 1), "ada") is UpdateEffect.NEWS


def test_the_memory_for_paired_texts_is_bounded() -> None:
    replica, clock = Replica(), 0
    words = "😀" * 100_000
    for _ in range(MOST_BYTES // (4 * len(words) + 1000)):
        replica.take(written(words, clock=clock), "eve")
        clock += 2 * len(words)
    with pytest.raises(Malformed, match="more text"):
        replica.take(written(words, clock=clock), "eve")
    assert replica.take(written("plain", clock=clock), "eve") is UpdateEffect.NEWS


def test_honest_edits_of_texts_are_accepted() -> None:
    doc, replica = Doc[Any](), Replica()
    words = doc.get("text", type=Text)
    subscription = doc.observe(lambda event: replica.take(event.update, "ada"))
    for place in range(20):
        words.insert(place // 2 * 4, "😀")
    del words[4:8]
    words.insert(4, "é")
    words.format(0, 4, {"bold": True})
    doc.unobserve(subscription)
    assert str(replica.doc.get("text", type=Text)) == str(words)
