"""A large file and the graph that is made of it are stored one after the other: others' edits wait for each commit."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from action_assistant.editor.app import open_services
from action_assistant.editor.log import graph_events as h
from action_assistant.errors import Unavailable
from action_assistant.journal.events import Addition, Event
from action_assistant.journal.journal import Journal
from action_assistant.settings import EditorSettings
from editor.api.test_api import NAV

LARGE = json.dumps({**NAV, "description": "x" * 300_000}).encode()


def commits_of(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The bytes of each commit of events from now on."""
    sizes: list[int] = []
    append_all = Journal.append_all

    async def noted(self: Journal, additions: Sequence[Addition]) -> list[int]:
        sizes.append(sum(len(draft.body) for each in additions for draft in each.drafts))
        return await append_all(self, additions)

    monkeypatch.setattr(Journal, "append_all", noted)
    return sizes


async def test_a_large_file_is_not_in_the_commit_of_its_graph(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = EditorSettings(data=tmp_path, database=f"sqlite:///{tmp_path / 'editor.db'}")
    async with open_services(settings) as services:
        sizes = commits_of(monkeypatch)
        made, _ = await services.catalogue.bring(LARGE, "ada")
        assert len(sizes) == 2
        assert max(sizes) < sum(sizes) - len(LARGE) / 2
        stored: list[Event] = await services.journal.read(h.about_stream(made.id))
        assert [each.kind for each in stored] == [h.IMPORTED, h.CREATED]
        assert stored[0].body == LARGE
        history: list[Any] = json.loads(await services.history.of(made.id, limit=9, before=None))
        assert [(each["kind"], each["seq"]) for each in history] == [("imported", 1)]


async def test_a_file_whose_graph_cannot_be_stored_leaves_no_trace(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = EditorSettings(data=tmp_path, database=f"sqlite:///{tmp_path / 'editor.db'}")
    async with open_services(settings) as services:
        before = {each.id for each in await services.catalogue.all()}
        append_all = Journal.append_all

        async def full(self: Journal, additions: Sequence[Addition]) -> list[int]:
            if len(additions) > 1:
                raise Unavailable("disk full")
            return await append_all(self, additions)

        monkeypatch.setattr(Journal, "append_all", full)
        with pytest.raises(Unavailable):
            await services.catalogue.bring(LARGE, "ada")
        assert {each.id for each in await services.catalogue.all()} == before
        monkeypatch.setattr(Journal, "append_all", append_all)
        made, _ = await services.catalogue.bring(LARGE, "ada")
        assert {each.id for each in await services.catalogue.all()} - before == {made.id}
