"""Editors of one Postgres are restarted one after the other, also by a later version, while people edit: nothing is
lost or doubled. A version whose tables the others cannot use waits for their end."""

import asyncio
import shutil
import signal
from pathlib import Path

import pytest

from action_assistant import paths
from action_assistant.journal.migrate import revisions_of
from action_assistant.schema.branches import BRANCHES
from editor.cluster.several import OneOfSeveral, several
from editor.cluster.test_several_editors import lived_through
from journal.servers import Server

_LATER = '''
"""Give each table a further column."""

import sqlalchemy as sa
from alembic import op

revision: str = "{later}"
down_revision: str | None = "{newest}"
branch_labels = depends_on = None
expands: bool = {expands}


def upgrade() -> None:
    """Go to this revision."""
    for table in {tables}:
        op.add_column(table, sa.Column("later", sa.Text))
'''


def later_version(folder: Path, *, expands: bool) -> Path:
    """Return the migrations of a later version, with one more script."""
    shutil.copytree(paths.migrations(), folder)
    newest = revisions_of("editor")[-1]
    number = int(newest.rpartition("_")[2]) + 1
    later = f"editor_{number:04}"
    tables = sorted(BRANCHES["editor"].tables)
    text = _LATER.format(later=later, newest=newest, expands=expands, tables=tables)
    (folder / "editor" / f"{later}_further_columns.py").write_text(text)
    return folder


def becomes(editor: OneOfSeveral, migrations: Path) -> None:
    """Let an editor be one of the later version from its next start."""
    editor.program = [str(Path(__file__).with_name("later_version.py")), str(migrations)]


async def again(editor: OneOfSeveral) -> None:
    """End an editor as an upgrade does, and start it."""
    assert await asyncio.to_thread(editor.end) in {0, -signal.SIGTERM}
    editor.begin()
    await asyncio.to_thread(editor.wait)


async def test_a_rolling_restart_loses_and_doubles_nothing(
    tmp_path: Path, postgres: Server
) -> None:
    database = postgres.new_database()
    with several(tmp_path, database, 3) as editors:

        async def happen() -> None:
            for each in editors:
                await again(each)

        await lived_through(editors, happen, database)


async def test_a_later_version_comes_in_one_editor_after_the_other(
    tmp_path: Path, postgres: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    later = later_version(tmp_path / "later", expands=True)
    database = postgres.new_database()
    with several(tmp_path, database, 3) as editors:

        async def happen() -> None:
            becomes(editors[0], later)
            await again(editors[0])
            await asyncio.to_thread(editors[1].end)
            editors[1].begin()  # by mistake still the version of before
            assert await asyncio.to_thread(editors[1].process.wait, 60) != 0
            assert "was made by a newer version of this program" in editors[1].log.read_text()
            becomes(editors[1], later)
            editors[1].begin()
            await asyncio.to_thread(editors[1].wait)
            becomes(editors[2], later)
            await again(editors[2])
            monkeypatch.setattr(paths, "migrations", lambda: later)

        await lived_through(editors, happen, database)


def test_tables_that_others_could_not_use_change_only_after_their_end(
    tmp_path: Path, postgres: Server
) -> None:
    later = later_version(tmp_path / "later", expands=False)
    database = postgres.new_database()
    name = database.rpartition("/")[2]
    with several(tmp_path, database, 2) as (one, two):
        two.end()
        becomes(two, later)
        two.begin()
        assert two.process.wait(60) != 0
        assert "other editors use them and could not go on: end those first." in two.log.read_text()
        there = postgres.ask("SELECT version_num FROM alembic_version", name)
        assert there == revisions_of("editor")[-1]
        with one.client() as client:
            assert client.post("/api/graphs", json={"name": "goes on"}).is_success
        one.end()
        two.begin()
        two.wait()
        assert postgres.ask("SELECT version_num FROM alembic_version", name) != there
