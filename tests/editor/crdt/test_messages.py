"""Messages of a room's socket: what was written is read, what is cut short is refused."""

import contextlib

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pycrdt import Decoder, YMessageType, YSyncMessageType, create_update_message

from action_assistant.editor.crdt import messages as wire
from action_assistant.editor.crdt.messages import (
    ByteReader,
    Edit,
    Malformed,
    Presence,
    PresenceEntry,
    Question,
)

data = st.binary(max_size=300)
entries = st.lists(
    st.builds(PresenceEntry, st.integers(0, 2**53), st.integers(0, 2**40), st.binary(max_size=50))
)


@given(st.integers(0, 2**64 - 1))
@example(127)
@example(128)
@example(2**14 - 1)
@example(2**14)
def test_a_number_survives(value: int) -> None:
    assert ByteReader(wire.number(value)).number() == value


@given(data, entries)
def test_messages_survive(content: bytes, said: list[PresenceEntry]) -> None:
    assert wire.parse(wire.question(content)) == Question(content)
    assert wire.parse(wire.answer(content)) == Edit(content)
    assert wire.parse(wire.change(content)) == Edit(content)
    assert wire.parse(wire.presence(said)) == Presence(tuple(said))


@given(data)
def test_we_write_what_the_library_writes(content: bytes) -> None:
    assert wire.change(content) == create_update_message(content)
    assert wire.change(content)[:2] == bytes((YMessageType.SYNC, YSyncMessageType.SYNC_UPDATE))


@given(st.integers(0, 2**40), st.integers(0, 2**40))
def test_an_acknowledgement_is_three_numbers(messages: int, seq: int) -> None:
    decoder = Decoder(wire.acks(messages, seq))
    assert [decoder.read_var_uint() for _ in range(3)] == [100, messages, seq]


@given(data)
def test_any_bytes_are_a_message_or_malformed(content: bytes) -> None:
    with contextlib.suppress(Malformed):
        wire.parse(content)


one_word = st.builds(
    lambda said, size: wire.presence(said)[: size or None],
    st.lists(
        st.builds(
            PresenceEntry, st.integers(0, 2**40), st.integers(0, 2**40), st.binary(max_size=9)
        ),
        max_size=2,
    ),
    st.integers(-3, 30),
)


@given(one_word | data.map(lambda content: b"\x01" + content), st.binary(max_size=3))
def test_the_short_way_reads_one_presence_entry_as_the_long_way_does(
    cut: bytes, more: bytes
) -> None:
    quick = wire._one_entry(cut + more) if cut else None
    if quick is not None:
        assert (quick,) == tuple(wire._entries(ByteReader(cut[1:] + more).text()))


def test_one_presence_entry_is_read_by_the_short_way() -> None:
    said = PresenceEntry(2**32 - 1, 300, b'{"cursor":[1,2]}')
    assert wire._one_entry(wire.presence([said])) == said


@given(st.sampled_from([wire.question, wire.answer, wire.change]), st.binary(min_size=1))
def test_a_message_that_was_cut_is_malformed(write: object, content: bytes) -> None:
    frame = write(content)  # type: ignore[operator]
    for end in range(len(frame)):
        with pytest.raises(Malformed):
            wire.parse(frame[:end])


def test_kinds_that_we_do_not_know_are_passed_over() -> None:
    assert wire.parse(b"\x02\x00") is None
    assert wire.parse(b"\x79abc") is None


def test_a_count_that_the_bytes_cannot_hold_costs_nothing() -> None:
    with pytest.raises(Malformed):
        wire.parse(b"\x01\x06" + b"\xff" * 5 + b"\x0f")


def test_more_entries_than_a_room_has_sockets_are_not_looked_at() -> None:
    entry = PresenceEntry(1, 1, b"{}")
    most = wire.presence([entry] * wire.MOST_ENTRIES)
    assert wire.parse(most) == Presence((entry,) * wire.MOST_ENTRIES)
    with pytest.raises(Malformed, match="entries"):
        wire.parse(wire.presence([entry] * (wire.MOST_ENTRIES + 1)))
