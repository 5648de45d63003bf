"""The short way to apply updates does what the library's own does."""

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pycrdt import Doc, Map

from action_assistant.editor.crdt.applying import apply_updates, applying
from action_assistant.editor.crdt.messages import Malformed
from support.doses import examples

changes = st.lists(
    st.tuples(st.sampled_from("abc"), st.none() | st.text(max_size=20) | st.integers(0, 9)),
    max_size=20,
)


def updates(changed: list[tuple[str, Any]]) -> list[bytes]:
    """Each change as an update: a key set, or taken away."""
    made: list[bytes] = []
    doc: Doc[Any] = Doc()
    things = doc.get("things", type=Map)
    subscription = doc.observe(lambda event: made.append(event.update))
    for key, value in changed:
        if value is not None:
            things[key] = value
        elif key in things:
            del things[key]
    doc.unobserve(subscription)
    return made


def watched() -> tuple[Doc[Any], list[Any]]:
    """A document, and what its observers hear."""
    doc: Doc[Any] = Doc()
    heard: list[Any] = []
    doc.observe(lambda event: heard.append(event.update))
    doc.get("things", type=Map).observe(lambda event: heard.append(dict(event.keys)))
    return doc, heard


@settings(max_examples=examples(100), deadline=None)
@given(changes, st.randoms(use_true_random=False))
def test_the_short_way_makes_the_same_document_and_events_for_observers(
    changed: list[tuple[str, Any]], chance: Any
) -> None:
    made = updates(changed)
    made += made[: chance.randrange(len(made) + 1)]  # some come twice
    (short, heard), (usual, told) = watched(), watched()
    for update in made:
        apply_updates(short, update)
        usual.apply_update(update)
        assert short.get_update() == usual.get_update()
    assert heard == told


@settings(max_examples=examples(50), deadline=None)
@given(changes)
def test_many_together_are_one_transaction_as_with_the_library(
    changed: list[tuple[str, Any]],
) -> None:
    made = updates(changed)
    (short, heard), (usual, told) = watched(), watched()
    apply_updates(short, *made)
    with usual.transaction():
        for update in made:
            usual.apply_update(update)
    assert short.get_update() == usual.get_update()
    assert heard == told


@pytest.mark.parametrize("broken", [b"", b"\x01", b"\x01\x01\xff", b"\x00\x01\x05"])
def test_an_unreadable_update_is_refused_and_the_document_goes_on(broken: bytes) -> None:
    doc, _ = watched()
    (update,) = updates([("a", "1")])
    with pytest.raises(Malformed), applying():
        apply_updates(doc, broken)
    apply_updates(doc, update)
    with doc.transaction():  # none was left open
        doc.get("things", type=Map)["b"] = "2"
    assert doc.get("things", type=Map).to_py() == {"a": "1", "b": "2"}
