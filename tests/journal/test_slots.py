"""Positions in slots, moments of a log as text, and an order of all events that keeps each stream's."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.journal.slots import SLOTS, Cursor, LogOrder, before_first, slot_of

NUMBERS = st.lists(st.integers(0, 2**46 - 2), max_size=SLOTS)


def test_slot_0_has_the_positions_that_a_log_of_one_writer_has() -> None:
    assert [slot_of(position) for position in (0, 1, 2**46)] == [0, 0, 1]
    assert slot_of(before_first(5) + 1) == 5
    assert str(Cursor().after(512)) == "512"
    assert Cursor.parse("512") == Cursor().after(512)
    assert before_first(SLOTS) <= 2**53  # numbers of JSON


@given(NUMBERS)
def test_a_moment_is_read_back_from_its_text(numbers: list[int]) -> None:
    cursor = Cursor.at([before_first(slot) + n for slot, n in enumerate(numbers)])
    assert Cursor.parse(str(cursor)) == cursor
    for slot, n in enumerate(numbers):
        assert cursor.end_in(slot) == before_first(slot) + n
        assert cursor.has(before_first(slot) + n)
        assert not cursor.has(before_first(slot) + n + 1)


@pytest.mark.parametrize(
    "text", ["", ".", "1.", "-1", "+1", "1,2", "٣", str(2**46), "1." * 64 + "1"]
)
def test_another_text_is_no_moment(text: str) -> None:
    with pytest.raises(ValueError):
        Cursor.parse(text)


def test_a_moment_never_goes_back() -> None:
    cursor = Cursor().after(7).after(before_first(3) + 2)
    assert str(cursor) == "7.0.0.2"
    assert cursor.after(5) == cursor == cursor.after(before_first(3) + 1)


@given(st.integers(0, 10_000), st.integers(1, 5), st.integers(1, 40))
def test_any_mix_of_slots_gets_an_order_that_keeps_every_stream(
    seed: int, slots: int, events: int
) -> None:
    dice = random.Random(seed)
    rows: dict[int, list[tuple[object, ...]]] = {slot: [] for slot in range(slots)}
    seqs: dict[str, int] = {}
    for _ in range(events):
        stream, slot = f"s{dice.randrange(3)}", dice.randrange(slots)
        seqs[stream] = seqs.get(stream, 0) + 1
        position = before_first(slot) + len(rows[slot]) + 1
        at = dice.randrange(3)  # clocks are wrong
        rows[slot].append((stream, seqs[stream], "it.happened.v1", "ada", at, b"", position))
    order = LogOrder(list(rows))
    found = []
    while (slot := order.needed) is not None:
        page, rows[slot] = rows[slot][:2], rows[slot][2:]
        order.add(slot, page)
        found += list(order.take())
    assert len(found) == events
    seen: dict[str, int] = {}
    ends: dict[int, int] = {}
    for row in found:
        stream, seq, position = str(row[0]), int(row[1]), int(row[6])
        assert seq == seen.get(stream, 0) + 1
        seen[stream] = seq
        assert position == ends.get(slot_of(position), before_first(slot_of(position))) + 1
        ends[slot_of(position)] = position
