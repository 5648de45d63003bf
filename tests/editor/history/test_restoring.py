"""Ways back: a whole graph, one action of it, what one person did; nothing of others is lost by them."""

import random

import pytest

from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.documents.document import Maps, maps_of, new_aid
from action_assistant.editor.history import index_queries
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.restoring import EditsOfOne, Restoring
from action_assistant.editor.interchange.document_edits import difference
from action_assistant.editor.log.graph_events import graph_stream
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import BadInput, Conflict, NotFound
from action_assistant.journal.journal import Journal
from editor.history.random_edits import GRAPH, PEOPLE, Person, edited, plain
from support.doses import examples


@pytest.fixture
async def going_back(journal: Journal, rooms: Rooms) -> Restoring:
    """A service for going back, on a real journal."""
    return Restoring(journal, rooms, GraphReader(journal, rooms), ChangeIndex(journal))


async def _now(rooms: Rooms) -> Maps:
    async with rooms.enter(graph_stream(GRAPH)) as room:
        return maps_of((await room.quiet()).doc)


def _without_comments(maps: Maps) -> bytes:
    return plain({root: fields for root, fields in maps.items() if root != "comments"})


@pytest.mark.parametrize("seed", range(examples(12) // 2))
async def test_a_graph_goes_back_and_taking_that_back_leaves_no_trace(
    going_back: Restoring, rooms: Rooms, seed: int
) -> None:
    held = await edited(rooms, seed, 40)
    then = random.Random(seed).randrange(1, len(held))
    gone = await going_back.restore(GRAPH, "mari", then)
    assert _without_comments(await _now(rooms)) == _without_comments(held[then - 1])
    if gone.seq > len(held):
        edits = EditsOfOne("mari", gone.seq, gone.seq)
        assert (await going_back.revert(GRAPH, "mari", edits)).left == ()
    assert plain(await _now(rooms)) == plain(held[-1])


@pytest.mark.parametrize("seed", range(examples(12) // 2))
async def test_taking_back_the_last_sitting_leaves_no_trace(
    going_back: Restoring, rooms: Rooms, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("editor.history.random_edits.PEOPLE", PEOPLE[:1])
    held = await edited(rooms, seed, 40)
    first = random.Random(seed).randrange(2, len(held) + 1)
    edits = EditsOfOne("ada", first, len(held))
    if _without_comments(held[first - 2]) == _without_comments(held[-1]):
        return
    assert (await going_back.revert(GRAPH, "mari", edits)).left == ()
    assert _without_comments(await _now(rooms)) == _without_comments(held[first - 2])


@pytest.mark.parametrize("seed", range(examples(20) // 2))
async def test_taking_back_touches_nothing_that_others_set_last(
    going_back: Restoring, rooms: Rooms, journal: Journal, seed: int
) -> None:
    held = await edited(rooms, seed, 40)
    index = ChangeIndex(journal)
    await index.upto(GRAPH)
    last = await index.value(index_queries.at, GRAPH, len(held))
    edits = EditsOfOne("ada", 2, len(held))
    try:
        await going_back.revert(GRAPH, "mari", edits)
    except NotFound:
        return  # Ada did nothing
    now = await _now(rooms)
    for change in last:
        if change.author != "ada" and not _is_place(change.root, change.key):
            assert change.key in now[change.root], change
    assert now["comments"] == held[-1]["comments"]


def _is_place(root: str, key: str) -> bool:
    return root == "positions" and not key.startswith("g/")


async def _edit(rooms: Rooms, who: str, root: str, **values: object) -> int:
    def edit(doc: object) -> None:
        me = Person(who, random.Random(0))
        me.doc = doc  # type: ignore[assignment]
        for key, value in values.items():
            me.map(root)[key.replace("__", "|")] = value

    async with rooms.enter(graph_stream(GRAPH)) as room:
        state = (await room.now()).state
        return await room.submit(difference(state, edit), who)


async def test_things_that_others_built_on_stay_and_are_named(
    going_back: Restoring, rooms: Rooms
) -> None:
    dock, charge, lift = "Dock" * 3, "Char" * 3, "Lift" * 3
    await _edit(rooms, "ada", "meta", name="g")
    first = await _edit(rooms, "mari", "actions", **{dock: "Dock", charge: "Charge", lift: "Lift"})
    seq = await _edit(rooms, "mari", "actions", **{f"{lift}__in/up": '{"pvf_value":1}'})
    await _edit(rooms, "ada", "actions", **{f"{dock}__in/speed": '{"pvf_value":2}'})
    found = await going_back.revert(GRAPH, "hella", EditsOfOne("mari", first, seq))
    assert found.left == (dock,)
    now = await _now(rooms)
    assert now["actions"] == {dock: "Dock", f"{dock}|in/speed": '{"pvf_value":2}'}


async def test_an_action_with_an_arrow_of_others_stays(going_back: Restoring, rooms: Rooms) -> None:
    dock, charge = "Dock" * 3, "Char" * 3
    await _edit(rooms, "ada", "actions", **{dock: "Dock"})
    seq = await _edit(rooms, "mari", "actions", **{charge: "Charge"})
    await _edit(rooms, "ada", "relations", **{f"{dock}>{charge}__on_true": "run"})
    found = await going_back.revert(GRAPH, "ada", EditsOfOne("mari", seq, seq))
    assert found.left == (charge,)
    assert charge in (await _now(rooms))["actions"]


async def test_an_action_that_was_deleted_comes_back_with_its_arrows(
    going_back: Restoring, rooms: Rooms, journal: Journal
) -> None:
    dice = random.Random(5)
    ada = Person("ada", dice)
    dock, charge = new_aid(), new_aid()
    await _edit(rooms, "ada", "actions", **{dock: "Dock", charge: "Charge"})
    await _edit(rooms, "ada", "relations", **{f"{dock}>{charge}__on_true": "run"})
    seq = await _edit(rooms, "ada", "actions", **{f"{dock}__in/speed": '{"pvf_value":2}'})
    before = await _now(rooms)
    async with rooms.enter(graph_stream(GRAPH)) as room:
        ada.hear((await room.now()).state)
        for root in ("actions", "relations"):
            for key in [k for k in ada.map(root) if dock in k]:
                del ada.map(root)[key]
        await room.submit(ada.doc.get_update(), "ada")
    await _edit(rooms, "mari", "actions", **{charge: "Load"})
    assert dock not in (await _now(rooms))["actions"]
    await going_back.restore_one(GRAPH, "mari", seq, dock)
    before["actions"][charge] = "Load"
    assert plain(await _now(rooms)) == plain(before)


async def test_going_back_to_a_missing_thing_moment_or_edit_is_refused(
    going_back: Restoring, rooms: Rooms
) -> None:
    held = await edited(rooms, 1, 20)
    with pytest.raises(NotFound, match="nothing 'nobody'"):
        await going_back.restore_one(GRAPH, "ada", 3, "nobody")
    with pytest.raises(Conflict, match=f"changes 1 to {len(held)}"):
        await going_back.restore_one(GRAPH, "ada", len(held) + 1, "nobody")
    with pytest.raises(NotFound, match="changed nothing"):
        await going_back.revert(GRAPH, "ada", EditsOfOne("nobody", 2, 3))
    with pytest.raises(BadInput, match="began with"):
        await going_back.revert(GRAPH, "ada", EditsOfOne("ada", 1, 3))
