"""A value that another one overwrote at once is in the history, with its author, as often as it was set."""

import random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pycrdt import Doc, Map
from sqlalchemy import delete

from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.graph_history import history_of
from action_assistant.editor.history.index_queries import between, overwritten_between
from action_assistant.editor.history.key_changes import observed, unpacked
from action_assistant.editor.log.graph_events import UPDATED, graph_stream
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.journal.events import Event
from action_assistant.journal.journal import Journal
from action_assistant.schema.editor_tables import key_change_head, overwritten_value
from action_assistant.umrf.difference import Field
from editor.history.random_edits import GRAPH, edited
from support.doses import examples


class Page:
    """A person with a document of their own, who goes away and comes back. The higher client wins."""

    def __init__(self, author: str, client: int) -> None:
        self.author = author
        self.doc: Doc[Any] = Doc(client_id=client)
        self.made: list[bytes] = []
        self.doc.observe(lambda event: self.made.append(event.update))

    def set(self, root: str, key: str, value: Any) -> None:
        """Give a key a value; None deletes it."""
        shared: Map[Any] = self.doc.get(root, type=Map)
        if value is not None:
            shared[key] = value
        elif key in shared:
            del shared[key]

    def value(self, root: str, key: str) -> Any:
        """Return the value that this person sees."""
        shared: Map[Any] = self.doc.get(root, type=Map)
        return shared.get(key)

    def hear(self, *updates: bytes) -> None:
        """Take updates of others."""
        own = len(self.made)
        for update in updates:
            self.doc.apply_update(update)
        del self.made[own:]


def _events(*updates: tuple[str, bytes]) -> list[Event]:
    return [
        Event(graph_stream(GRAPH), n, UPDATED, author, n * 1_000, body, n)
        for n, (author, body) in enumerate(updates, 1)
    ]


def _overwritten(events: list[Event], step: int = 1000) -> list[tuple[Any, ...]]:
    """Return the overwritten values, with the log observed in parts, each going on from a snapshot."""
    document, found = b"", []
    for start in range(0, len(events), step):
        seen = observed(document, events[start : start + step])
        assert seen is not None
        document = seen.document
        found += [
            (e.seq, e.author, e.root, e.key, unpacked(e.value), unpacked(e.stands))
            for e in seen.overwritten
        ]
    return found


@pytest.mark.parametrize("step", [1, 1000])
def test_a_value_that_returned_and_lost_is_found_with_its_author_and_the_value_that_stands(
    step: int,
) -> None:
    ada, mari = Page("ada", 1), Page("mari", 2)
    ada.set("meta", "description", "before")
    mari.hear(*ada.made)
    mari.set("meta", "description", "by Mari")
    ada.set("meta", "description", "by Ada")
    log = _events(("ada", ada.made[0]), ("mari", mari.made[0]), ("ada", ada.made[1]))
    lost = (3, "ada", "meta", "description", "by Ada", "by Mari")
    assert _overwritten(log, step) == [lost]


def test_the_value_of_who_stayed_is_overwritten_later_and_never_at_once() -> None:
    ada, mari = Page("ada", 2), Page("mari", 1)
    ada.set("meta", "description", "before")
    mari.hear(*ada.made)
    mari.set("meta", "description", "by Mari")
    ada.set("meta", "description", "by Ada")
    log = _events(("ada", ada.made[0]), ("mari", mari.made[0]), ("ada", ada.made[1]))
    assert _overwritten(log) == []


def test_a_value_that_met_a_deletion_is_found_too() -> None:
    ada, mari = Page("ada", 1), Page("mari", 2)
    mari.set("meta", "description", "by Mari")
    mari.set("meta", "description", None)
    ada.set("meta", "description", "by Ada")
    log = _events(("mari", mari.made[0]), ("mari", mari.made[1]), ("ada", ada.made[0]))
    assert _overwritten(log) == [(3, "ada", "meta", "description", "by Ada", None)]


_KEYS = st.sampled_from(
    [("meta", "description"), ("actions", "a"), ("actions", "a|in/x"), ("positions", "a")]
)
_VALUES = st.one_of(
    st.none(),
    st.text(max_size=8),
    st.booleans(),
    st.integers(-9, 9),
    st.floats(allow_nan=False, allow_infinity=False, width=32),
    st.lists(st.integers(0, 9), max_size=3),
    st.binary(max_size=4),
)
_STEPS = st.lists(
    st.tuples(st.sampled_from(["set", "set", "send", "hear"]), st.integers(0, 2), _KEYS, _VALUES),
    min_size=4,
    max_size=40,
)


@given(steps=_STEPS, clients=st.permutations([5, 6, 7]), step=st.sampled_from([1, 3, 1000]))
def test_every_value_set_offline_stood_or_is_listed_as_overwritten(
    steps: list[Any], clients: list[int], step: int
) -> None:
    """People set keys while they are away. An update that is sent sets a key to what its author saw then: the
    server shows that value after it, or it is told as overwritten at once, with what the server shows."""
    people = [Page(name, client) for name, client in zip("abc", clients, strict=True)]
    server: Doc[Any] = Doc()
    intended: list[list[tuple[str, str, Any]]] = [[] for _ in people]
    sent = [0, 0, 0]
    log: list[tuple[str, bytes]] = []
    sought: list[tuple[Any, ...]] = []
    for what, n, (root, key), value in [
        *steps,
        *[("send", n, ("", ""), None) for n in range(3)] * 40,
    ]:
        me = people[n]
        if what == "set":
            me.set(root, key, value)
            intended[n] += [(root, key, value)] * (len(me.made) - len(intended[n]))
        elif what == "hear":
            me.hear(*(body for _, body in log))
        elif sent[n] < len(me.made):
            update, (of, its, was) = me.made[sent[n]], intended[n][sent[n]]
            sent[n] += 1
            log.append((me.author, update))
            server.apply_update(update)
            shared: Map[Any] = server.get(of, type=Map)
            stands = shared.get(its)
            if was is not None and (
                stands != was or isinstance(stands, bool) != isinstance(was, bool)
            ):
                sought.append((len(log), me.author, of, its, was, stands))
    if log:
        assert _overwritten(_events(*log), step) == sought


@pytest.mark.parametrize("seed", range(examples(8) // 2))
async def test_values_that_people_lose_while_they_edit_a_graph_are_found(
    journal: Journal, rooms: Rooms, seed: int
) -> None:
    """A value listed as overwritten is not the one that the graph showed before or after, also
    where updates overtake each other and set many keys."""
    held = await edited(rooms, seed, 60)
    events = await journal.read(graph_stream(GRAPH))
    found = _overwritten(events, 1 + random.Random(seed).randrange(9))
    for seq, _, root, key, value, stands in found:
        assert value not in (held[seq - 1][root].get(key), None)
        assert stands == held[seq - 1][root].get(key)
    assert found == _overwritten(events)


async def test_an_index_from_before_such_values_were_kept_is_made_anew(
    journal: Journal, rooms: Rooms
) -> None:
    ada, mari = Page("ada", 1), Page("mari", 2)
    mari.set("meta", "description", "by Mari")
    ada.set("meta", "description", "by Ada")
    async with rooms.enter(graph_stream(GRAPH)) as room:
        await room.submit(mari.made[0], "mari")
        await room.submit(ada.made[0], "ada")
    index = ChangeIndex(journal)
    assert await index.upto(GRAPH) == 2
    found = await index.value(overwritten_between, GRAPH, 0, 9, 9)
    assert [(each.seq, each.author) for each in found] == [(2, "ada")]
    changes = await index.value(between, GRAPH, 0, 9, 9)
    older = key_change_head.update().values(form=None)
    await journal.derive(lambda connection: connection.execute(older))
    await journal.derive(lambda connection: connection.execute(delete(overwritten_value)))
    assert await index.head(GRAPH) == 0
    assert GRAPH in await index._behind()
    assert await index.upto(GRAPH) == 2
    assert await index.value(overwritten_between, GRAPH, 0, 9, 9) == found
    assert await index.value(between, GRAPH, 0, 9, 9) == changes


async def test_a_field_of_an_action_that_was_deleted_meanwhile_is_told_by_its_last_name(
    journal: Journal, rooms: Rooms
) -> None:
    ada, mari, aid = Page("ada", 1), Page("mari", 2), "a" * 12
    ada.set("actions", aid, "Look")
    mari.hear(*ada.made)
    mari.set("actions", f"{aid}|description", "by Mari")
    mari.set("actions", f"{aid}|description", None)
    mari.set("actions", aid, None)
    ada.set("actions", f"{aid}|description", "by Ada")
    async with rooms.enter(graph_stream(GRAPH)) as room:
        for author, update in [("ada", ada.made[0]), *(("mari", u) for u in mari.made)]:
            await room.submit(update, author)
        await room.submit(ada.made[1], "ada")
    index = ChangeIndex(journal)
    assert await index.upto(GRAPH) == 5
    newest = (await index.value(history_of, GRAPH, 9, None))[0]
    assert newest.changes is not None
    assert newest.changes.overwritten is not None
    (action,) = newest.changes.overwritten.actions
    assert (action.name, action.fields) == ("Look_0", (Field("description", "by Ada", ""),))
