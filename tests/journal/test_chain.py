"""The chain of a stream checked column by column says what it says event by event."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.journal.chain import START, StoredColumns, link, linked
from action_assistant.journal.events import Event

NUMBERS = st.integers(-(2**63), 2**63 - 1)
TEXTS = st.sampled_from(["", "ada", "graph.updated.v1", "é", "ab", "a"])
EVENTS = st.lists(st.tuples(TEXTS, TEXTS, NUMBERS, st.binary(max_size=300), NUMBERS), min_size=1)


def columns_of(told: list[tuple[str, str, int, bytes, int]]) -> StoredColumns:
    """These events of the stream `s`, in their chain."""
    before, rows = START, list[tuple[Any, ...]]()
    for seq, (kind, author, at, body, position) in enumerate(told, 1):
        before = link(before, Event("s", seq, kind, author, at, body, position))
        rows.append((seq, kind, author, at, body, position, before))
    return StoredColumns(*zip(*rows, strict=True))


@given(EVENTS, st.data())
def test_written_events_are_in_the_chain_from_any_starting_point(
    told: list[Any], data: st.DataObject
) -> None:
    whole = columns_of(told)
    assert linked(START, "s", whole) == len(told)
    assert linked(START, "another", whole) == 0
    cut = data.draw(st.integers(0, len(told) - 1))
    before = whole.chains[cut - 1] if cut else START
    rest = StoredColumns(*(column[cut:] for column in whole))
    assert linked(before, "s", rest) == len(told) - cut


@pytest.mark.parametrize("name", StoredColumns._fields)
@given(told=EVENTS, data=st.data())
def test_a_change_of_any_value_shows_at_its_event(
    name: str, told: list[Any], data: st.DataObject
) -> None:
    whole = columns_of(told)
    place = data.draw(st.integers(0, len(told) - 1))
    column: list[Any] = list(getattr(whole, name))
    match column[place]:
        case str(text):
            column[place] = f"{text}."
        case int(number):
            column[place] = number ^ 1
        case other:
            column[place] = other + b"\0"
    assert linked(START, "s", whole._replace(**{name: column})) == place
