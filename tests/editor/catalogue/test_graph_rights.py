"""A rule that is stored counts, whatever fails while it is read again."""

import asyncio
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

import pytest

from action_assistant.editor.catalogue.folders import Folders
from action_assistant.editor.catalogue.graph_rights import GraphRights
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import NotFound, Unavailable
from action_assistant.journal.journal import Journal
from action_assistant.web.auth.graph_rules import OPEN, Rule
from action_assistant.web.auth.graph_seals import RulesFile
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Keys, Person

KEYS = Keys("t" * 40)
BEN = Identity(Person("ben", "Ben", "editor"))
MINE = Rule(("ann",), ())
GRAPH = "g1"
FOLDER = "f1"


@pytest.fixture
async def journal(tmp_path: Path) -> AsyncIterator[Journal]:
    """A journal with the tables of the editor."""
    url = f"sqlite:///{tmp_path / 'editor.db'}"
    journal = await Journal.open(url, branch="editor", fold=h.fold, at_once=True)
    yield journal
    await journal.close()


@pytest.fixture
async def rights(journal: Journal, rooms: Rooms, tmp_path: Path) -> GraphRights:
    found = GraphRights(journal, rooms, RulesFile(tmp_path, KEYS), KEYS)
    folder = h.FolderState(FOLDER, "Arms", None)
    await journal.append(h.FOLDERS, [h.draft(h.FOLDER_MADE, "ann", folder)])
    await found.refresh()
    return found


def failing(journal: Journal, monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Let the journal be read no more; return what lets it be read again."""

    async def fail(*_: Any) -> None:
        raise Unavailable("The journal cannot be read.")

    patch = pytest.MonkeyPatch()
    patch.setattr(journal, "query", fail)
    return patch.undo


async def counts(rights: GraphRights) -> None:
    """Wait until the rule of the folder counts."""
    async with asyncio.timeout(20):
        while rights.rule_in(FOLDER) != MINE:  # noqa: ASYNC110 - the other side is a database
            await asyncio.sleep(0.01)


async def test_a_stored_rule_that_cannot_be_read_again_lets_nobody_see_more(
    rights: GraphRights, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert rights.sees_folder(FOLDER, BEN)
    heal = failing(journal, monkeypatch)
    with pytest.raises(Unavailable):
        await rights.rule_for_folder(FOLDER, MINE, "ann")
    assert not rights.sees_folder(FOLDER, BEN)
    with pytest.raises(Unavailable):
        await rights.check("folder", FOLDER, BEN, edits=False)
    with pytest.raises(Unavailable):
        await rights.sight(BEN)
    heal()
    with pytest.raises(NotFound):
        await rights.check("folder", FOLDER, BEN, edits=False)


async def test_a_rule_counts_although_whoever_set_it_is_gone(
    rights: GraphRights, journal: Journal
) -> None:
    setting = asyncio.create_task(rights.rule_for_folder(FOLDER, MINE, "ann"))
    await asyncio.sleep(0)
    setting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await setting
    await counts(rights)
    assert await journal.newest(h.FOLDERS) == 2


async def test_a_rule_that_could_not_be_read_again_is_tried_again_for_open_rooms(
    rights: GraphRights, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    heal = failing(journal, monkeypatch)
    monkeypatch.setattr("action_assistant.editor.catalogue.graph_rights._AGAIN_S", 0.01)
    with pytest.raises(Unavailable):
        await rights.rule_for_folder(FOLDER, MINE, "ann")
    assert rights.rule_in(FOLDER) == OPEN
    heal()
    await counts(rights)


async def test_a_place_of_which_the_runner_could_not_be_told_is_an_error(
    rights: GraphRights, journal: Journal, tmp_path: Path
) -> None:
    made = h.draft(h.CREATED, "ann", h.GraphCreated("Fetch", ""))
    await journal.append(h.about_stream(GRAPH), [made])
    await rights.rule_for_folder(FOLDER, MINE, "ann")
    file = tmp_path / "graph-rules.json"
    file.unlink(missing_ok=True)
    file.mkdir()
    with pytest.raises(Unavailable, match="here and now"):
        await Folders(journal, rights).file(GRAPH, FOLDER, "ann")
    assert not await rights.may_see(GRAPH, BEN)
