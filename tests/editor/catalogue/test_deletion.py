"""A graph whose deletion may have failed: its room does not vouch for it any more."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from action_assistant.editor.app import open_services
from action_assistant.editor.log.graph_events import graph_stream
from action_assistant.errors import Unavailable
from action_assistant.settings import EditorSettings
from editor.client import Client


async def test_a_deletion_that_is_not_stored_sends_nobody_away_and_the_tables_tell(
    tmp_path: Path,
) -> None:
    file = tmp_path / "editor.db"
    settings = EditorSettings(data=tmp_path, database=f"sqlite:///{file}")
    async with open_services(settings) as services:
        graph = (await services.catalogue.create(b'{"name": "task"}', "ada"))[0].id
        stream, ada = graph_stream(graph), Client()
        async with services.rooms.enter(stream) as room:
            ada.join(room)
            assert services.rooms.is_joined(stream)
            with closing(sqlite3.connect(file, isolation_level=None)) as foreign:
                foreign.execute("BEGIN IMMEDIATE")  # nothing can be written
                with pytest.raises(Unavailable):
                    await services.catalogue.delete(graph, "ada")
                foreign.execute("ROLLBACK")
            assert ada.member is not None
            assert not ada.member.closed
            assert not services.rooms.is_joined(stream)
            assert await services.catalogue.require(graph) == "graph"
            ada.leave()
