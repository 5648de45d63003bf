"""The short cut for small updates: what it reads, it reads as the scanner does."""

import os
import random
from typing import Any, Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pycrdt import Doc, Map, Text

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.messages import ByteReader, Edit, Malformed
from action_assistant.editor.crdt.updates.small_update import small_outline
from action_assistant.editor.crdt.updates.update_outline import UpdateOutline
from action_assistant.editor.crdt.updates.update_scan import outline, scanned
from editor.crdt.test_scan import made, values
from editor.crdt.test_scan_fuzz import base, mutated
from support.doses import examples

MUTANTS: Final = int(os.environ.get("TEST_MUTANTS", "20000"))
keys = st.text(max_size=140) | st.sampled_from(["a", "a|b", "ü|"])


def said(update: bytes) -> UpdateOutline | None:
    """Return the scanner's outline; None for an update that it refuses."""
    try:
        return scanned(update)
    except Malformed:
        return None


def agree(update: bytes) -> bool:
    """Return whether the short cut read this update. Fails where the scanner reads it otherwise."""
    read = small_outline(update)
    assert read is None or read == said(update), update.hex()
    return read is not None


@settings(max_examples=examples(100), deadline=None)
@given(
    st.lists(
        st.tuples(st.sampled_from(["actions", "positions", "ß" * 60]), keys, values), max_size=8
    ),
    st.sampled_from([1, 127, 128, 2**31, 2**53 - 1]),
)
def test_the_short_cut_agrees_with_the_scanner_on_edits_of_people(
    changes: list[tuple[str, str, Any]], client: int
) -> None:
    doc: Doc[Any] = Doc(client_id=client)
    text = doc.get("text", type=Text)

    def edit() -> None:
        for root, key, value in changes:
            things = doc.get(root, type=Map)
            things[key] = value
            text.insert(len(str(text).encode()) // 2 if str(text).isascii() else 0, key)
            if len(key) % 3 == 0:
                del things[key]

    for update in (*made(doc, edit), doc.get_update()):
        agree(update)


@pytest.mark.slow
def test_the_short_cut_agrees_with_the_scanner_on_forged_updates() -> None:
    chance = random.Random(int(os.environ.get("TEST_SEED", "12")))
    _, updates = base()
    updates += drags()
    found = sum(
        agree(mutated(chance, chance.choice(updates), chance.choice(updates)))
        for _ in range(MUTANTS)
    )
    assert found > MUTANTS / 50


def test_every_byte_of_a_small_update_matters_to_both() -> None:
    for update in drags():
        assert agree(update)
        for place in range(len(update)):
            for value in range(256):
                agree(update[:place] + bytes((value,)) + update[place + 1 :])
            agree(update[:place])
            agree(update + update[place : place + 1])


def drags() -> list[bytes]:
    """Return updates as pages send them most: a first value, a new value, several at once, a
    deletion."""
    doc: Doc[Any] = Doc(client_id=2**30 + 7)
    things = doc.get("positions", type=Map)

    def edit() -> None:
        things["a"] = [1.5, 2.0]
        things["a"] = {"x": [None, True, "é"], "y": 2**40}
        with doc.transaction():
            things["a"], things["b"] = "text", 3
        del things["a"]

    return made(doc, edit)


def test_edits_of_people_take_the_short_cut() -> None:
    for update in drags():
        assert small_outline(update) == scanned(update) == outline(update)


spans = st.tuples(st.integers(1, 3), st.integers(0, 9), st.integers(0, 9))


@given(
    st.lists(spans, max_size=3),
    st.dictionaries(st.integers(1, 3), st.integers(0, 12)),
    st.dictionaries(st.integers(1, 3), st.integers(0, 12)),
)
def test_ready_is_what_lacks_nothing(
    brings: list[tuple[int, int, int]], needs: dict[int, int], known: dict[int, int]
) -> None:
    have = {client: set(range(known.get(client, 0))) for client in range(1, 4)}
    complete = True
    for client, start, length in brings:
        complete = complete and set(range(start)) <= have[client]
        have[client] |= set(range(start, start + length))
    complete = complete and all(set(range(clock)) <= have[c] for c, clock in needs.items())
    read = UpdateOutline(tuple((c, start, start + n) for c, start, n in brings), needs)
    assert read.ready(known) == complete


@given(st.binary(max_size=200), st.integers(0, 300), st.binary(max_size=3))
def test_a_message_is_read_alike_on_the_short_way(update: bytes, size: int, rest: bytes) -> None:
    told = messages.number(size if size > 200 else len(update))
    message = b"\0\2" + told + update + rest
    reader = ByteReader(message)
    reader.skip(2)
    try:
        expected = reader.text()
    except Malformed:
        with pytest.raises(Malformed):
            messages.parse(message)
    else:
        assert messages.parse(message) == Edit(expected)
