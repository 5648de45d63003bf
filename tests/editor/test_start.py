"""The editor starts, or says why it cannot."""

import sqlite3
import subprocess
from pathlib import Path

import pytest
from sqlalchemy import select

from action_assistant.editor.app import open_services
from action_assistant.editor.catalogue import server_edits
from action_assistant.schema import editor_tables
from action_assistant.settings import EditorSettings
from action_assistant.web.auth.keys import Person
from editor.process import Editor, running
from support.product import COMMAND, free_ports


@pytest.fixture
def settings(tmp_path: Path) -> EditorSettings:
    return EditorSettings(data=tmp_path, database=f"sqlite:///{tmp_path / 'editor.db'}")


@pytest.fixture
def stopped(tmp_path: Path) -> Path:
    """The data folder of an editor that has ended."""
    with running(tmp_path / "data") as editor:
        return editor.data


def started(data: Path) -> "subprocess.CompletedProcess[str]":
    """An editor that is expected to give up."""
    command = [*COMMAND, "editor", "--data", str(data), "--port", str(free_ports())]
    return subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)


def test_a_database_of_a_newer_version_is_one_clear_sentence(stopped: Path) -> None:
    with sqlite3.connect(stopped / "editor.db") as database:
        database.execute("UPDATE alembic_version SET version_num = 'editor_9999'")
    database.close()
    ended = started(stopped)
    assert ended.returncode == 2
    assert "newer version" in ended.stderr
    assert len(ended.stderr.strip().splitlines()) == 1


def test_a_database_in_use_is_one_clear_sentence(tmp_path: Path) -> None:
    with running(tmp_path / "data") as editor:
        ended = started(editor.data)
    assert ended.returncode == 2
    assert "in use by another process" in ended.stderr
    assert len(ended.stderr.strip().splitlines()) == 1


def test_a_damaged_database_is_one_clear_sentence(stopped: Path) -> None:
    (stopped / "editor.db").write_bytes(b"oh no" * 1000)
    ended = started(stopped)
    assert ended.returncode == 2
    assert "not a database" in ended.stderr
    assert len(ended.stderr.strip().splitlines()) == 1


def test_a_restart_changes_nothing(tmp_path: Path) -> None:
    editor = Editor(tmp_path / "data")
    editor.start()
    with editor.client() as http:
        made = http.post("/api/graphs", json={"name": "kept"}).json()["id"]
        http.patch(f"/api/graphs/{made}", json={"description": "so"})
        version = http.post(f"/api/graphs/{made}/versions", json={}).json()
        before = http.get("/api/graphs").json()
    editor.kill()
    editor.start()
    with editor.client() as http:
        assert http.get("/api/graphs").json() == before
        assert http.get(f"/api/versions/{version['id']}").json() == version
    editor.end()


async def test_tables_made_again_from_the_log_are_the_same(settings: EditorSettings) -> None:
    async with open_services(settings) as services:
        made, _ = await services.catalogue.create(b'{"name": "one"}', "ada")
        other, _ = await services.catalogue.create(b'{"name": "two"}', "ada")
        await services.people.seen(Person("ada", "Ada"))
        await services.people.seen(Person("ada", "Ada L."))
        await services.catalogue.describe(made.id, "ada", name="renamed", description=None)
        await services.versions.publish(made.id, Person("ada", "Ada L."), label="v1")
        await services.catalogue.delete(other.id, "ada")
        await services.catalogue.delete(made.id, "ada")
        await services.catalogue.recover(made.id, "ada")
        queries = [
            select(table).order_by(table.c.id)
            for table in (editor_tables.graph, editor_tables.version, editor_tables.person)
        ]
        before = [await services.journal.query(query) for query in queries]
        await services.journal.rebuild()
        after = [await services.journal.query(query) for query in queries]
        assert before == after
        assert [row.name for row in before[0] if row.id == made.id] == ["renamed"]
        assert len(before[1]) == len(before[2]) == 1


async def test_examples_come_once(settings: EditorSettings) -> None:
    async with open_services(settings) as services:
        first = [view.id for view in await services.catalogue.all()]
        assert len(first) >= 3
        for graph in first:
            await services.catalogue.delete(graph, "ada")
    async with open_services(settings) as services:
        assert await services.catalogue.all() == []


async def test_a_name_that_changed_just_before_the_end_is_noticed_later(
    settings: EditorSettings,
) -> None:
    async with open_services(settings) as services:
        made, _ = await services.catalogue.create(b'{"name": "old"}', "ada")
        async with services.rooms.enter(f"graph/{made.id}") as room:
            await server_edits.rename(room, "ada", name="new", description=None)
    async with open_services(settings) as services:
        assert (await services.catalogue.get(made.id)).name == "new"
        rows = await services.journal.query(
            select(editor_tables.graph).where(editor_tables.graph.c.id == made.id)
        )
        assert rows[0].name == "new"
