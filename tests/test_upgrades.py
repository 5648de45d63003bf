"""Upgrades: from each revision there was to this one with all that is stored, and back by the copy that
was made before; and from what the very first version wrote."""

import asyncio
import io
import lzma
import os
import re
import shutil
import signal
import subprocess
import tarfile
import time
from pathlib import Path
from typing import Any, Final, NamedTuple

import msgspec
import pytest
from sqlalchemy import Connection, inspect, text

from action_assistant.cli import main
from action_assistant.commands.databases.migrate import go_back
from action_assistant.errors import CannotStart
from action_assistant.journal import migrate as journal_migrate
from action_assistant.journal.copies import before_upgrade
from action_assistant.journal.copies.before_upgrade import FOLDER, copies_in
from action_assistant.journal.database import Branch
from action_assistant.journal.databases import database_of, migrate
from action_assistant.journal.events import nothing
from action_assistant.journal.journal import Journal
from action_assistant.journal.lock import own
from action_assistant.journal.migrate import last_writer, recognize, revisions_of
from action_assistant.journal.sqlite import inspected
from action_assistant.version import VERSION, described
from record_first import answers
from support.command_line import ran, seconds_of
from support.product import COMMAND, Product, running
from support.rows import contents, fill, write_events
from support.used_server import differences

ROOT: Final = Path(__file__).parents[1]
FIRST: Final = Path(__file__).parent / "data" / "folders" / "first"
#: The first version that ran.
COMMIT: Final = "4e338f0e"
LOG: Final = frozenset({"event", "head"})
#: Revisions for tests that look at the files alone.
OLD = "editor_0001", "runner_0001"


class Place(NamedTuple):
    """A data folder, one database of it, and whose that is."""

    data: Path
    branch: Branch
    url: str

    def asked(self, question: Any) -> Any:
        return asyncio.run(self._ask(question))

    async def _ask(self, question: Any) -> Any:
        database = database_of(self.url)
        try:
            return await database.at_one_moment(question)
        finally:
            await database.close()

    def opened(self) -> None:
        """Open the database as a server does, and prove every event."""

        async def look() -> None:
            journal = await Journal.open(
                self.url, branch=self.branch, fold=nothing, copies=self.data / FOLDER
            )
            try:
                assert await journal.verify() == []
            finally:
                await journal.close()

        asyncio.run(look())


#: The first and the last two revisions of each journal run in CI, the others only in long tests.
EACH = [
    pytest.param(place, each, marks=() if each in {all_of[0], *all_of[-2:]} else pytest.mark.long)
    for place, all_of in (
        ("editor on SQLite", revisions_of("editor")),
        ("editor on Postgres", revisions_of("editor")),
        ("runner on SQLite", revisions_of("runner")),
    )
    for each in all_of
]


@pytest.fixture
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Place:
    branch, _, kind = request.param.split(" ")
    url = f"sqlite:///{tmp_path / f'{branch}.db'}"
    if kind == "Postgres":
        url = request.getfixturevalue("postgres").new_database()
    return Place(tmp_path, branch, url)


def stored(connection: Connection) -> dict[str, Any]:
    """Return all rows of all tables except those that the program writes about itself."""
    own = {"alembic_version", "written_by"}
    return contents(connection, sorted(set(inspect(connection).get_table_names()) - own))


@pytest.mark.long
@pytest.mark.parametrize(("place", "revision"), EACH, indirect=["place"])
def test_every_revision_comes_to_this_one_and_back_by_its_copy(
    place: Place, revision: str, capsys: pytest.CaptureFixture[str]
) -> None:
    migrate(place.url, place.branch, revision)
    database_of(place.url).migrate(lambda c: (write_events(c), fill(c, LOG)))
    before = place.asked(stored)
    database = None if place.url.startswith("sqlite") else place.url
    verify = ["verify", "--data", str(place.data)]
    assert main(verify if database is None else [*verify, "--database", database]) == 0
    said = capsys.readouterr().out
    assert f"{place.branch}: 12 events, all of them sound" in said
    assert (f"its tables are of schema {revision}," in said) == (
        revision != revisions_of(place.branch)[-1]
    )
    assert (place.asked(recognize), place.asked(stored)) == ({revision}, before)
    assert not (place.data / FOLDER).exists()

    place.opened()
    after = place.asked(stored)
    for table, rows in before.items():
        for row, old in zip(after[table], rows, strict=True):
            assert old.items() <= row.items()
    copies = copies_in(place.data / FOLDER)
    writer = place.asked(last_writer)
    assert writer is not None
    assert (writer.version, writer.revision) == (VERSION, revisions_of(place.branch)[-1])
    if revision == revisions_of(place.branch)[-1]:
        assert copies == []
        return
    (copy,) = copies
    assert (copy.branch, copy.revision) == (place.branch, revision)
    assert copy.path.stat().st_mode & 0o777 == 0o600
    assert Place(place.data, place.branch, f"sqlite:///{copy.path}").asked(stored) == before

    assert go_back(place.data, database, [copy.path]) == 0
    assert f"as it was at schema {revision}, with 12 events" in capsys.readouterr().out
    assert place.asked(recognize) == {revision}
    assert place.asked(stored) == before
    (aside,) = place.data.glob("before-restore-*/*.db")
    assert inspected(aside) == (12, [])


def of_the_first(data: Path) -> Any:
    """The folder that the first version left; what it said about that."""
    with tarfile.open(
        fileobj=io.BytesIO(lzma.decompress((FIRST / "sqlite.tar.xz").read_bytes()))
    ) as tar:
        tar.extractall(data, filter="data")
    return msgspec.json.decode(lzma.decompress((FIRST / "sqlite.json.xz").read_bytes()))


def said_by(product: Product) -> dict[str, Any]:
    with product.editor() as editor, product.runner() as runner:
        return answers(editor, runner)


@pytest.mark.long
def test_data_of_the_first_version_come_to_this_one_and_back(tmp_path: Path) -> None:
    data = tmp_path / "data"
    then = of_the_first(data)
    before = {
        branch: Place(data, branch, f"sqlite:///{data / f'{branch}.db'}").asked(stored)  # type: ignore[arg-type]
        for branch in ("editor", "runner")
    }
    with running(data) as product:
        assert list(differences(then, said_by(product))) == []
    copies = [copy.path for copy in copies_in(data / FOLDER)]
    assert sorted(path.name.split("-")[0] for path in copies) == sorted(OLD)
    listed = ran("migrate", "--back", "--data", data)
    assert [str(path) in listed.stdout for path in copies] == [True, True]
    back = ran("migrate", "--back", *copies, "--data", data)
    assert back.returncode == 0, back.stderr
    for branch, rows in before.items():
        place = Place(data, branch, f"sqlite:///{data / f'{branch}.db'}")  # type: ignore[arg-type]
        assert place.asked(stored) == rows
    with running(data) as product:
        assert list(differences(then, said_by(product))) == []


@pytest.mark.long
def test_the_first_version_itself_goes_on_where_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    packed = tmp_path / "then.tar"
    commit = subprocess.run(
        ["git", "archive", "--output", packed, COMMIT, "server", "migrations", "pyproject.toml"],
        cwd=ROOT,
        check=False,
    )
    if commit.returncode:
        pytest.skip("the first version is not in this clone")
    with tarfile.open(packed) as tar:
        tar.extractall(tmp_path / "then", filter="data")
    data = tmp_path / "data"
    then = of_the_first(data)
    with running(data) as product, product.editor() as editor:
        graph = editor.post("/api/graphs", json={"name": "of today"}).json()["id"]
    copies = [copy.path for copy in copies_in(data / FOLDER)]
    assert ran("migrate", "--back", *copies, "--data", data).returncode == 0
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "then" / "server"))
    with running(data) as product, product.editor() as editor:
        assert list(differences(then, said_by(product))) == []
        assert editor.get(f"/api/graphs/{graph}").status_code == 404
        editor.post("/api/graphs", json={"name": "of then"}).raise_for_status()


def test_a_newer_database_says_who_made_it_and_what_can_be_done(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'editor.db'}"
    migrate(url, "editor")
    newer = (
        "UPDATE alembic_version SET version_num = 'editor_9999'",
        "INSERT INTO written_by VALUES (9e18, '9.1.0', '1a2b3c4d5e6f', 'editor_9999')",
    )
    database_of(url).migrate(lambda c: [c.execute(text(each)) for each in newer])
    refused = ran("editor", "--data", tmp_path, "--port", "1")
    assert refused.returncode == 2
    told = refused.stderr.replace("\n", " ")
    assert "newer version of this program, 9.1.0 (commit 1a2b3c4d) (schema editor_9999)" in told
    assert f"this is version {described()}, which knows up to editor_" in told
    assert "Install 9.1.0 or newer" in told
    assert "migrate --back" in told


def old(folder: Path, url: str = "") -> Place:
    """A journal of an earlier version, with events."""
    folder.mkdir(exist_ok=True)
    place = Place(folder, "editor", url or f"sqlite:///{folder / 'editor.db'}")
    migrate(place.url, "editor", "editor_0005")
    database_of(place.url).migrate(write_events)
    return place


def test_the_last_few_copies_stay(tmp_path: Path) -> None:
    place = old(tmp_path)
    folder = tmp_path / FOLDER
    folder.mkdir()
    for day in range(1, 6):
        shutil.copy(tmp_path / "editor.db", folder / f"editor_0005-2026010{day}-120000.db")
        shutil.copy(tmp_path / "editor.db", folder / f"runner_0001-2026010{day}-120000.db")
    place.opened()
    left = [copy.path.name for copy in copies_in(folder)]
    assert [name[:20] for name in left if name.startswith("editor")][1:] == [
        "editor_0005-20260105",
        "editor_0005-20260104",
    ]
    assert len(left) == 3 + 5


def test_a_copy_has_no_files_beside_it_not_even_of_one_that_was_killed(tmp_path: Path) -> None:
    place = old(tmp_path)
    folder = tmp_path / FOLDER
    folder.mkdir()
    for suffix in ("", "-wal", "-shm"):
        (folder / f".editor_0004-20260101-120000.db.part{suffix}").touch()
    (folder / ".runner_0001-20260101-120000.db.part").touch()
    place.opened()
    (copy,) = copies_in(folder)
    assert inspected(copy.path)[1] == []
    left = sorted(each.name for each in folder.iterdir())
    assert left == [".runner_0001-20260101-120000.db.part", copy.path.name], (
        "the runner's is its own"
    )


def test_an_upgrade_that_fails_at_each_start_takes_no_older_copy_away(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place, folder = old(tmp_path), tmp_path / FOLDER
    folder.mkdir()
    for number in (3, 4):
        shutil.copy(
            tmp_path / "editor.db", folder / f"editor_000{number}-2026010{number}-120000.db"
        )

    def fails(*_: object) -> str:
        raise RuntimeError

    monkeypatch.setattr(journal_migrate, "_upgraded", fails)
    for _ in range(4):
        with pytest.raises(RuntimeError):
            place.opened()
    left = [copy.revision for copy in copies_in(folder)]
    assert left == ["editor_0005"] * 3 + ["editor_0004", "editor_0003"]


def test_tables_do_not_change_under_a_version_that_runs(tmp_path: Path) -> None:
    place = old(tmp_path)
    lock = own(tmp_path / "editor.db")
    try:
        refused = ran("migrate", "--data", tmp_path)
    finally:
        os.close(lock)
    assert (refused.returncode, "in use by another process" in refused.stderr) == (2, True)
    assert place.asked(recognize) == {"editor_0005"}


def test_without_room_for_a_copy_nothing_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = old(tmp_path)
    monkeypatch.setattr(before_upgrade, "ROOM", 1 << 60)
    with pytest.raises(CannotStart, match=r"needs \d+ MiB.*Nothing was changed.*--without-copy"):
        place.opened()
    assert place.asked(recognize) == {"editor_0005"}
    assert list((tmp_path / FOLDER).iterdir()) == []
    done = ran("migrate", "--data", tmp_path, "--without-copy")
    assert done.returncode == 0, done.stderr
    assert place.asked(recognize) == {revisions_of("editor")[-1]}


def test_damage_that_was_there_is_in_the_copy_and_is_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    place = old(tmp_path)
    database_of(place.url).migrate(
        lambda c: c.execute(text("UPDATE event SET author = 'eve' WHERE position = 5"))
    )
    with pytest.raises(AssertionError):
        place.opened()
    assert "the journal was damaged before" in caplog.text
    (copy,) = copies_in(tmp_path / FOLDER)
    with pytest.raises(CannotStart, match="is damaged"):
        go_back(tmp_path, None, [copy.path])


@pytest.mark.long
def test_events_since_the_upgrade_are_counted_and_kept_aside(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old(tmp_path).opened()
    with running(tmp_path) as product, product.editor() as editor:
        editor.post("/api/graphs", json={"name": "later"}).raise_for_status()
        with pytest.raises(CannotStart, match="in use by another process"):
            go_back(tmp_path, None, [copies_in(tmp_path / FOLDER)[0].path])
    assert go_back(tmp_path, None, [copies_in(tmp_path / FOLDER)[0].path]) == 0
    assert re.search(r"\d+ events that came after are not in it", capsys.readouterr().out)
    (aside,) = tmp_path.glob("before-restore-*/editor.db")
    assert inspected(aside)[0] > 12


def test_a_file_that_is_no_copy_is_not_put_back(tmp_path: Path) -> None:
    old(tmp_path)
    with pytest.raises(CannotStart, match="is no copy from before an upgrade"):
        go_back(tmp_path, None, [tmp_path / "editor.db"])
    assert go_back(tmp_path, None, []) == 1


KILLS: Final = int(os.environ.get("TEST_MIGRATION_KILLS", "3"))


@pytest.mark.timeout(0)
def test_killed_at_any_moment_of_a_migration_nothing_is_lost(tmp_path: Path) -> None:
    whole = old(tmp_path / "whole")
    rows = whole.asked(stored)
    data = tmp_path / "timed"
    shutil.copytree(whole.data, data)
    takes = seconds_of("migrate", "--data", data)
    seen = set()
    for number in range(KILLS):
        data = tmp_path / f"killed{number}"
        shutil.copytree(whole.data, data)
        process = subprocess.Popen(
            [*COMMAND, "migrate", "--data", str(data)], stderr=subprocess.DEVNULL
        )
        time.sleep(takes * (0.4 + 0.6 * number / max(1, KILLS - 1)))
        process.send_signal(signal.SIGKILL)
        process.wait()
        place = Place(data, "editor", f"sqlite:///{data / 'editor.db'}")
        (at,) = place.asked(recognize)
        seen.add(at)
        assert at in {"editor_0005", revisions_of("editor")[-1]}
        if at != "editor_0005":
            (copy,) = copies_in(data / FOLDER)
            assert Place(data, "editor", f"sqlite:///{copy.path}").asked(stored) == rows
        place.opened()
        after = place.asked(stored)
        for name, before in rows.items():
            for row, one in zip(after[name], before, strict=True):
                assert one.items() <= row.items()
    assert seen
