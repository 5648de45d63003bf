"""Editors of one Postgres are restarted one after the other, also by a later version, while people edit: nothing is
lost or doubled. A version whose tables the others cannot use waits for their end."""

import asyncio
import contextlib
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path

import asyncpg  # type: ignore[import-untyped]
import httpx
import httpx_ws
import pytest

from action_assistant import paths
from action_assistant.editor.cluster.peers import Peers
from action_assistant.editor.rooms.remote_room import RemoteRoom
from action_assistant.errors import Overtaken
from action_assistant.journal.migrate import revisions_of
from action_assistant.schema.branches import BRANCHES
from editor.client import updates
from editor.cluster.several import OneOfSeveral, several, started
from editor.cluster.test_entrance import SEAL, OwnsNothing
from editor.cluster.test_several_editors import asked, lived_through
from journal.servers import Server
from support.waiting import wait_until

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


async def test_people_go_on_while_a_later_version_waits_for_somebody_who_reads_for_long(
    tmp_path: Path, postgres: Server
) -> None:
    later = later_version(tmp_path / "later", expands=True)
    database = postgres.new_database()
    with several(tmp_path, database, 2) as (one, two):
        graph = asked(one, "POST", "/api/graphs", json={"name": "task"})["id"]
        asked(one, "PATCH", f"/api/graphs/{graph}", json={"name": "mine"})
        two.end()
        backup = await asyncpg.connect(database)
        async with backup.transaction(isolation="repeatable_read", readonly=True):
            tables = ", ".join(BRANCHES["editor"].tables)
            await backup.execute(f"LOCK TABLE {tables} IN ACCESS SHARE MODE")  # as pg_dump does
            becomes(two, later)
            two.begin()
            with one.client() as client:
                while two.process.poll() is None:
                    renamed = {"name": f"{asyncio.get_running_loop().time()}"}
                    path = f"/api/graphs/{graph}"
                    answer = await asyncio.to_thread(client.patch, path, json=renamed)
                    assert answer.is_success, answer.text
        await backup.close()
        assert two.process.wait() != 0
        said = two.log.read_text()
        assert "has to change tables that somebody reads for long, such as a backup" in said
        assert "Cannot use" not in said
        two.begin()
        two.wait()
        name = database.rpartition("/")[2]
        there = postgres.ask("SELECT version_num FROM alembic_version", name)
        assert there != revisions_of("editor")[-1]


@contextlib.contextmanager
def two_and_an_earlier_one(folder: Path, database: str) -> Iterator[list[OneOfSeveral]]:
    """Two editors of this version and one of the version before."""
    editors = [OneOfSeveral(folder / "data", database, n) for n in range(3)]
    editors[2].program = [str(Path(__file__).with_name("earlier_version.py"))]
    with started(editors):
        yield editors


async def test_an_edit_of_the_server_is_stored_in_a_room_of_the_version_before(
    tmp_path: Path, postgres: Server
) -> None:
    with two_and_an_earlier_one(tmp_path, postgres.new_database()) as (*_, earlier):
        graph = asked(earlier, "POST", "/api/graphs", json={"name": "task"})["id"]
        asked(earlier, "PATCH", f"/api/graphs/{graph}", json={"name": "mine"})
        peers = Peers(OwnsNothing(f"http://{earlier.inner}"), SEAL)
        room = RemoteRoom(f"graph/{graph}", peers)
        before, _ = await room.now()
        one, two = updates(("a", "1"), ("b", "2"))

        async def compute(_: bytes, seq: int) -> bytes:
            assert seq == before
            return one

        assert await room.submit_in_turn("ann", compute) == before + 1

        async def compute_late(_: bytes, __: int) -> bytes:
            await room.submit(two, "ann")
            (late,) = updates(("c", "3"))
            return late

        with pytest.raises(Overtaken):
            await room.submit_in_turn("ann", compute_late)
        assert (await room.now()).seq == before + 2
        await peers.aclose()


async def test_nobody_stays_listed_where_the_version_before_took_a_graph(
    tmp_path: Path, postgres: Server
) -> None:
    with two_and_an_earlier_one(tmp_path, postgres.new_database()) as (crashes, other, earlier):
        graph = asked(crashes, "POST", "/api/graphs", json={"name": "crowded"})["id"]

        def listed() -> list[str]:
            return [
                person["name"]
                for each in asked(other, "GET", "/api/graphs")
                for person in each.get("people", ())
            ]

        was_listed = False
        with contextlib.suppress(httpx_ws.HTTPXWSException, httpx.TransportError, ExceptionGroup):
            async with crashes.socket(graph) as socket:
                await socket.send_bytes(bytes([1, 6, 1, 7, 1, 2]) + b"{}")  # presence: client 7, {}
                await wait_until(listed)
                was_listed = True
                crashes.kill()
        assert was_listed
        asked(earlier, "PATCH", f"/api/graphs/{graph}", json={"name": "taken"})
        await wait_until(lambda: not listed())
