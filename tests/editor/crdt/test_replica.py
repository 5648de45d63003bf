"""A replica reports updates that only delete, and is freed afterwards."""

import weakref
from typing import Any

from pycrdt import Doc, Map

from action_assistant.editor.crdt.replica import Replica, UpdateEffect


def two_updates() -> tuple[bytes, bytes]:
    """A key, and that it was taken away."""
    made: list[bytes] = []
    doc: Doc[Any] = Doc()
    subscription = doc.observe(lambda event: made.append(event.update))
    things = doc.get("things", type=Map)
    things["a"] = "1"
    del things["a"]
    doc.unobserve(subscription)
    first, second = made
    return first, second


def test_a_deletion_is_news_once() -> None:
    replica = Replica()
    key, deletion = two_updates()
    said = [replica.take(update, "ada") for update in (key, deletion, deletion, key)]
    nothing = UpdateEffect.NOTHING
    assert said == [UpdateEffect.NEWS, UpdateEffect.NEWS, nothing, nothing]
    assert replica.doc.get("things", type=Map).to_py() == {}


def test_a_replica_is_freed_when_nobody_holds_it() -> None:
    replica = Replica()
    for update in two_updates():
        replica.take(update, "ada")
    alive = weakref.ref(replica.doc)
    del replica
    assert alive() is None
