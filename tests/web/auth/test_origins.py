"""The connection of a person, as the bodies of events keep it."""

from typing import Any

import msgspec
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.web.auth.caller import (
    Caller,
    Origin,
    acting_for,
    origin_in,
    set_caller,
    stamped,
    without_origin,
)

TEXT = st.text(max_size=20)
ORIGINS = st.builds(Origin, TEXT, TEXT, TEXT, TEXT)
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | TEXT,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXT, inner, max_size=3),
    max_leaves=8,
)
BODIES = st.dictionaries(TEXT.filter(lambda key: key != "from"), VALUES, max_size=4)


@given(BODIES, ORIGINS)
def test_a_body_gains_the_origin_and_loses_nothing(body: dict[str, Any], origin: Origin) -> None:
    plain = msgspec.json.encode(body)
    with acting_for("ada", origin):
        kept = stamped(plain, "ada")
    assert origin_in(kept) == origin
    assert {k: v for k, v in msgspec.json.decode(kept).items() if k != "from"} == body
    assert msgspec.json.decode(without_origin(kept)) == body
    assert list(msgspec.json.decode(kept)) == [*body, "from"]


def test_an_empty_body_becomes_one_with_an_origin() -> None:
    with acting_for("ada", Origin("Ada", "s1", address="10.0.0.7")):
        kept = stamped(b"", "ada")
    assert kept == b'{"from":{"name":"Ada","session":"s1","address":"10.0.0.7"}}'


def test_only_the_person_who_acts_is_named() -> None:
    with acting_for("ada", Origin("Ada", "s1")):
        assert stamped(b'{"a":1}', "ben") == b'{"a":1}'
        assert stamped(b'{"a":1}', "") == b'{"a":1}'
    assert stamped(b'{"a":1}', "ada") == b'{"a":1}'
    set_caller(Caller("ada"))
    assert stamped(b'{"a":1}', "ada") == b'{"a":1}'
    set_caller(None)


def test_a_body_of_another_form_stays_as_it_is() -> None:
    with acting_for("ada", Origin("Ada", "s1")):
        assert stamped(b"\x00\x01", "ada") == b"\x00\x01"
    assert origin_in(b"\x00\x01") is None
    assert origin_in(b'["from"]') is None
    assert without_origin(b'{"a":"\\"from\\":"}') == b'{"a":"\\"from\\":"}'


@given(TEXT)
def test_a_text_that_looks_like_an_origin_is_none(text: str) -> None:
    body = msgspec.json.encode({"note": f'"from":{{"session":"{text}"}}'})
    assert origin_in(body) is None
    assert without_origin(body) == body
