"""The scanner: reads whatever Yjs clients make, refuses what would hurt, knows what builds on what."""

import random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pycrdt import Array, Doc, Map, Text, get_update, merge_updates

from action_assistant.editor.crdt.messages import ByteReader, Malformed, number
from action_assistant.editor.crdt.updates.update_scan import DEEPEST, outline
from action_assistant.editor.documents import document
from action_assistant.editor.interchange import document_edits
from action_assistant.umrf.model import Action, Graph
from action_assistant.umrf.model import Parameter as UmrfParameter

values = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | st.floats(allow_nan=False)
    | st.text(max_size=20) | st.binary(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=12,
)  # fmt: skip


def made(doc: Doc[Any], edit: Any) -> list[bytes]:
    """The updates of an edit."""
    found: list[bytes] = []
    subscription = doc.observe(lambda event: found.append(event.update))
    edit()
    doc.unobserve(subscription)
    return found


@given(st.lists(st.tuples(st.sampled_from("abc"), values), min_size=1, max_size=12))
def test_every_update_of_a_document_is_read_to_its_end(changes: list[tuple[str, Any]]) -> None:
    doc: Doc[Any] = Doc()
    things, text = doc.get("things", type=Map), doc.get("text", type=Text)
    items = doc.get("items", type=Array)

    def edit() -> None:
        for key, value in changes:
            things[key] = value
            text.insert(0, f"é😀{key}")
            items.append(value)
        text.format(0, 2, {"bold": True})  # in bytes: half an "é" leaves a text without any
        things["nested"] = Map({"deep": Array([1])})
        del things["nested"]
        del items[0]

    updates = made(doc, edit)
    known: dict[int, int] = {}
    for update in updates:
        read = outline(update)
        assert read.ready(known)
        for client, start, end in read.brings:
            assert start == known.get(client, 0)
            known[client] = end
    state = ByteReader(doc.get_state())
    assert {state.number(): state.number() for _ in range(state.number())} == known
    for whole in (doc.get_update(), merge_updates(*updates), get_update(updates[-1], b"\x00")):
        outline(whole)
    assert outline(doc.get_update()).ready({})


def test_a_large_graph_is_within_the_bounds() -> None:
    actions = tuple(
        Action(
            key=document.new_aid(),
            name=f"Act{n}",
            inputs=tuple(UmrfParameter(f"p{i}", '{"pvf_type": "number"}') for i in range(10)),
        )
        for n in range(1000)
    )
    read = outline(document_edits.first(Graph(name="large", actions=actions)))
    assert read.ready({})


@given(st.integers(0, 5), st.integers(0, 5))
def test_an_update_that_lacks_an_earlier_one_is_not_ready(first: int, second: int) -> None:
    doc: Doc[Any] = Doc()
    things = doc.get("things", type=Map)

    def edit() -> None:
        for n in range(6):
            things["a"] = n

    updates = made(doc, edit)
    known: dict[int, int] = {}
    for client, _, end in outline(updates[first]).brings:
        known[client] = end
    assert outline(updates[second]).ready(known) == (second <= first + 1)


def test_a_deletion_needs_what_it_deletes() -> None:
    doc: Doc[Any] = Doc()
    things = doc.get("things", type=Map)
    (write,) = made(doc, lambda: things.update({"a": 1}))
    (erase,) = made(doc, lambda: things.pop("a"))
    (client, _, end), *_ = outline(write).brings
    assert not outline(erase).ready({})
    assert outline(erase).ready({client: end})


def nested(depth: int) -> bytes:
    """An update whose only value is arrays in arrays."""
    any_ = b"\x75\x01" * depth + b"\x7e"
    return b"\x01\x01\x07\x00\x28\x01\x01m\x01k\x01" + any_ + b"\x00"


def test_nesting_is_bounded_and_costs_nothing() -> None:
    outline(nested(DEEPEST - 1))
    doc: Doc[Any] = Doc()
    doc.apply_update(nested(DEEPEST - 1))
    for depth in (DEEPEST + 1, 1000, 30_000, 300_000):
        with pytest.raises(Malformed, match="nested"):
            outline(nested(depth))


@pytest.mark.parametrize(
    "update",
    [
        bytes.fromhex("8be0cc71"),
        b"\x01" + number(2**40) + b"\x07\x00",
        b"\x01\x01\x07\x00\x28\x01\x01m\x01k" + number(2**40),
        b"\x01\x01\x07\x00\x28\x01\x01m\x01k\x01\x75" + number(2**40),
        b"",
        b"\x00",
        b"\x00\x00\x00",
    ],
)
def test_counts_that_the_bytes_cannot_hold_are_refused(update: bytes) -> None:
    with pytest.raises(Malformed):
        outline(update)


def test_an_accepted_update_never_makes_the_library_do_worse_than_refuse() -> None:
    doc: Doc[Any] = Doc()
    things, text = doc.get("things", type=Map), doc.get("text", type=Text)

    def edit() -> None:
        for n in range(20):
            things[f"k{n % 4}"] = [n, {"a": "é"}, None]
            text.insert(0, "é😀")
        del things["k1"]

    bases = [*made(doc, edit), doc.get_update()]
    chance = random.Random(7)
    passed = 0
    for _ in range(6000):
        forged = bytearray(chance.choice(bases))
        for _ in range(chance.randint(1, 3)):
            forged[chance.randrange(len(forged))] = chance.randrange(256)
        try:
            outline(bytes(forged))
        except Malformed:
            continue
        passed += 1
        try:
            Doc[Any]().apply_update(bytes(forged))
        except ValueError:
            continue
    assert passed > 500
