"""An update that the CRDT library applies otherwise than it reports is refused, or its document
is given up."""

import pytest

from action_assistant.editor.crdt.applying import Panicked
from action_assistant.editor.crdt.messages import Malformed
from action_assistant.editor.crdt.replica import Replica, UpdateEffect


def structs(client: int, clock: int, *each: bytes) -> bytes:
    return bytes((len(each), client, clock)) + b"".join(each)


def update(*clients: bytes) -> bytes:
    return bytes((len(clients),)) + b"".join(clients) + b"\x00"


COLLECTED = b"\x00\x02"  # two clocks of which nothing else is left
WORD = b"\x04\x01\x01t\x03abc"


def test_an_item_does_not_go_on_from_what_was_collected() -> None:
    replica = Replica()
    assert replica.take(update(structs(7, 0, COLLECTED)), "eve") is UpdateEffect.NEWS
    before = replica.doc.get_update()
    with pytest.raises(Malformed, match="collected"):
        replica.take(update(structs(7, 1, WORD)), "eve")
    assert replica.doc.get_update() == before


def test_a_known_update_may_come_again_with_later_edits() -> None:
    replica = Replica()
    replica.take(update(structs(7, 0, COLLECTED)), "eve")
    again = update(structs(7, 0, COLLECTED, WORD))
    assert replica.take(again, "eve") is UpdateEffect.NEWS
    longer = update(structs(7, 2, b"\x04\x01\x01t\x05abcde"))
    assert replica.take(longer, "eve") is UpdateEffect.NEWS


def test_structs_of_two_clients_that_wait_for_each_other_leave_a_document_to_be_given_up() -> None:
    after_other = b"\x84\x08\x00\x01a", b"\x84\x09\x00\x01b"
    with pytest.raises(Panicked, match="wait for each other"):
        Replica().take(update(structs(9, 0, after_other[0]), structs(8, 0, after_other[1])), "eve")


def test_an_update_that_was_applied_in_part_leaves_a_document_to_be_given_up() -> None:
    inside_a_word = b"\x27\x00\x07\x00\x01k\x01"
    with pytest.raises(Panicked, match="partly applied"):
        Replica().take(update(structs(7, 0, b"\x04\x01\x01t\x01a", inside_a_word)), "eve")


def test_an_update_that_was_not_applied_at_all_leaves_the_document_as_it_was() -> None:
    replica = Replica()
    replica.take(update(structs(7, 0, WORD)), "ada")
    with pytest.raises(Malformed):
        replica.take(update(structs(8, 0, b"\x28\x01\x01a\x01\xff\x01\x7e")), "eve")
