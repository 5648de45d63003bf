"""The summary of a session names the same changes as a comparison of the graph before and after it."""

import random

import msgspec
import pytest

from action_assistant.editor.documents.document import read_maps
from action_assistant.editor.documents.values import ROOTS, ends_of
from action_assistant.editor.history import index_queries
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.change_summaries import (
    Changes,
    Stretch,
    differing,
    names,
    told,
)
from action_assistant.editor.history.key_changes import LoggedChange, owner_of
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.journal.journal import Journal
from action_assistant.umrf.difference import difference
from action_assistant.umrf.model import Graph
from editor.history.random_edits import GRAPH, PEOPLE, edited
from support.doses import examples

_ALL = 1_000_000


def _touched(changes: list[LoggedChange]) -> set[str]:
    owners = {owner_of(change.root, change.key) for change in changes}
    return owners | {end for o in owners if (ends := ends_of(o)) for end in ends[:2]}


@pytest.mark.parametrize("seed", range(examples(12) // 2))
async def test_the_summary_of_a_lone_editor_is_the_difference_of_the_whole_graphs(
    journal: Journal, rooms: Rooms, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("editor.history.random_edits.PEOPLE", PEOPLE[:1])
    monkeypatch.setattr("action_assistant.editor.history.change_summaries._SHOWN", 1000)
    held = await edited(rooms, seed, 40)
    index = ChangeIndex(journal)
    await index.upto(GRAPH)
    first = random.Random(seed).randrange(2, len(held))
    changes = await index.value(index_queries.between, GRAPH, first - 1, len(held), _ALL)
    base = await index.value(index_queries.at, GRAPH, first - 1, owners=_touched(changes))
    (found,) = told(base, changes, [Stretch("ada", first, len(held))])
    before, after = read_maps(held[first - 2]), read_maps(held[-1])
    sought = difference((0, before), (0, after))
    assert found.fields == sought.fields
    assert _by_key(found) == {change.aid: change for change in sought.actions}
    assert set(found.relations) == set(sought.relations)
    assert found.notes == sought.notes


def test_a_note_that_only_lies_elsewhere_was_moved() -> None:
    def graph(note: str) -> Graph:
        return read_maps({root: {} for root in ROOTS} | {"positions": {"g/n": note}})

    note = '{"kind":"note","at":[0,0],"size":[200,80],"text":"Steam","color":"grey"}'
    (moved,) = difference((0, graph(note)), (0, graph(note.replace("[0,0]", "[40,0]")))).notes
    assert (moved.change, moved.text, moved.moved) == ("changed", "Steam", True)
    for other in (note.replace("Steam", "Smoke"), note.replace("grey", "red"), "[1]"):
        (changed,) = difference((0, graph(note)), (0, graph(other))).notes
        assert not changed.moved
    (added,) = difference((0, graph(note)), (0, read_maps({root: {} for root in ROOTS}))).notes
    assert (added.change, added.moved) == ("removed", False)


def _by_key(changes: Changes) -> dict[str, object]:
    return {change.aid: change for change in changes.actions}


@pytest.mark.parametrize("seed", range(examples(12) // 2))
async def test_the_summary_of_each_person_names_only_their_own_changes(
    journal: Journal, rooms: Rooms, seed: int
) -> None:
    held = await edited(rooms, seed, 40)
    index = ChangeIndex(journal)
    await index.upto(GRAPH)
    changes = await index.value(index_queries.between, GRAPH, 1, len(held), _ALL)
    base = await index.value(index_queries.at, GRAPH, 1)
    found = told(base, changes, [Stretch(who, 2, len(held)) for who in PEOPLE])
    for who, mine in zip(PEOPLE, found, strict=True):
        touched = {owner_of(c.root, c.key) for c in changes if c.author == who}
        assert {change.aid for change in mine.actions} <= touched
        assert mine.comments == sum(each.startswith("c/") for each in touched)
        ends = {">".join(change.ends) for change in mine.relations}
        assert ends <= touched


async def test_a_long_sitting_is_told_in_part(journal: Journal, rooms: Rooms) -> None:
    held = await edited(rooms, 4, 400)
    index = ChangeIndex(journal)
    await index.upto(GRAPH)
    changes = await index.value(index_queries.between, GRAPH, 1, len(held), _ALL)
    (found,) = told(
        await index.value(index_queries.at, GRAPH, 1), changes, [Stretch("ada", 2, len(held))]
    )
    assert len(found.actions) == 30
    assert found.more > 0


@pytest.mark.parametrize("seed", range(examples(12) // 2))
async def test_two_moments_differ_as_the_graphs_of_their_replay_do(
    journal: Journal, rooms: Rooms, seed: int
) -> None:
    held = await edited(rooms, seed, 40)
    index = ChangeIndex(journal)
    await index.upto(GRAPH)
    first, last = sorted(random.Random(seed).sample(range(1, len(held) + 1), 2))
    found = await index.text(differing, GRAPH, first, last)
    sought = difference((first, read_maps(held[first - 1])), (last, read_maps(held[last - 1])))
    assert found == msgspec.json.encode(sought)


@pytest.mark.parametrize("seed", range(examples(12) // 2))
async def test_names_are_all_that_actions_had_from_a_moment_on(
    journal: Journal, rooms: Rooms, seed: int
) -> None:
    held = await edited(rooms, seed, 40)
    index = ChangeIndex(journal)
    await index.upto(GRAPH)
    first = random.Random(seed).randrange(1, len(held))
    later = await index.value(index_queries.between, GRAPH, first, len(held), _ALL)
    own, uses = names([*await index.value(index_queries.at, GRAPH, first), *later])
    graphs = [read_maps(maps) for maps in held[first - 1 :]]
    real = {each.name for graph in graphs for each in graph.actions if not each.missing}
    assert own == graphs[-1].name
    assert real - {""} <= set(uses)
