"""Migrations: the scripts make what `tables.py` says, there and back, from anywhere, with data."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, MetaData, inspect, select, text

from action_assistant import paths
from action_assistant.errors import CannotStart
from action_assistant.journal.database import Branch
from action_assistant.journal.databases import database_of, migrate
from action_assistant.journal.migrate import alembic_config, revisions_of
from action_assistant.schema.branches import BRANCHES, VERSIONS
from support.rows import contents, fill, filled_anew

branches = pytest.mark.parametrize("branch", ["editor", "runner"])
Step: TypeAlias = Callable[[Connection], Any]
Rows: TypeAlias = dict[str, list[dict[str, Any]]]


class Empty(NamedTuple):
    """A database without tables, and whose it is to be."""

    branch: Branch
    url: str

    def migrate(self, revision: str = "head") -> str:
        return migrate(self.url, self.branch, revision)

    def migrate_by_scripts(self) -> None:
        """Migrate to the newest revision, one script after the other."""
        for revision in steps(self):
            self.migrate(revision)
        assert self.migrate() == steps(self)[-1]

    def do(self, step: Step) -> Any:
        """Run a step in one transaction."""
        return database_of(self.url).migrate(step)


@pytest.fixture(params=["editor on SQLite", "editor on Postgres", "runner on SQLite"])
def empty(request: pytest.FixtureRequest, tmp_path: Path) -> Empty:
    """Each kind of database that there is."""
    match request.param.split(" on "):
        case [("editor" | "runner") as branch, "SQLite"]:
            return Empty(branch, f"sqlite:///{tmp_path / 'one.db'}")
        case ["editor", "Postgres"]:
            return Empty("editor", request.getfixturevalue("postgres").new_database())
        case other:
            raise AssertionError(other)


def schema(connection: Connection) -> dict[str, Any]:
    """Return a database's own description of its tables."""
    found = inspect(connection)
    return {
        name: {
            "columns": [
                (c["name"], str(c["type"]), c["nullable"]) for c in found.get_columns(name)
            ],
            "key": found.get_pk_constraint(name)["constrained_columns"],
            "unique": sorted(tuple(u["column_names"]) for u in found.get_unique_constraints(name)),
            "indexes": sorted(
                (str(i["name"]), tuple(i["column_names"]), i["unique"])
                for i in found.get_indexes(name)
            ),
        }
        for name in found.get_table_names()
        if name != "alembic_version"
    }


def steps(empty: Empty) -> list[str]:
    """Return all revisions, the oldest first."""
    script = empty.do(lambda c: ScriptDirectory.from_config(alembic_config(c, empty.branch)))
    found = script.iterate_revisions(f"{empty.branch}@head", "base")
    return [step.revision for step in found][::-1]


def test_a_migrated_database_equals_a_fresh_one(empty: Empty) -> None:
    empty.migrate_by_scripts()
    migrated = empty.do(definitions)
    empty.do(erase)
    assert empty.do(definitions) == ({}, [], [])
    assert empty.migrate() == steps(empty)[-1]
    assert migrated == empty.do(definitions)


def definitions(connection: Connection) -> tuple[dict[str, Any], list[str], list[str]]:
    """The tables, the revision that they are said to be at, and of SQLite each definition as it
    stands in the file, but for blanks."""
    if connection.dialect.name == "sqlite":
        rows = connection.execute(text("SELECT name, sql FROM sqlite_master ORDER BY name"))
        stored = [f"{name}: {' '.join((sql or '').split())}" for name, sql in rows]
    else:
        stored = []
    there = inspect(connection).has_table(VERSIONS.name)
    versions = connection.scalars(select(VERSIONS.c.version_num)) if there else ()
    return schema(connection), list(versions), stored


def erase(connection: Connection) -> None:
    """Every table, also Alembic's."""
    metadata = MetaData()
    metadata.reflect(connection)
    metadata.drop_all(connection)


@branches
def test_revisions_are_those_of_the_scripts(branch: Branch, tmp_path: Path) -> None:
    assert revisions_of(branch) == steps(Empty(branch, f"sqlite:///{tmp_path / 'one.db'}"))


@pytest.mark.turns
@branches
def test_alembic_is_loaded_only_where_a_script_has_to_run(branch: Branch, tmp_path: Path) -> None:
    def loaded(name: str) -> str:
        url = f"sqlite:///{tmp_path / name}"
        code = (
            "import sys; from action_assistant.journal.journal import Journal\n"
            f"Journal.prepare({url!r}, {branch!r}); print('alembic' in sys.modules)"
        )
        shown = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        )
        return shown.stdout.strip()

    migrate(f"sqlite:///{tmp_path / 'old.db'}", branch, f"{branch}_0001")
    assert [loaded("new.db"), loaded("new.db"), loaded("old.db"), loaded("old.db")] == [
        "False",
        "False",
        "True",
        "False",
    ]


@pytest.mark.parametrize("by_scripts", [False, True])
def test_alembic_finds_nothing_to_add(empty: Empty, by_scripts: bool) -> None:
    if by_scripts:
        empty.migrate_by_scripts()
    else:
        empty.migrate()

    def compare(connection: Connection) -> Any:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        return compare_metadata(context, BRANCHES[empty.branch])

    assert empty.do(compare) == []


@pytest.mark.turns
def test_every_step_can_be_taken_back_and_again(empty: Empty) -> None:
    empty.migrate()
    wanted = empty.do(schema)
    empty.do(lambda c: command.downgrade(alembic_config(c, empty.branch), f"{empty.branch}@base"))
    assert empty.do(schema) == {}
    for revision in steps(empty):
        empty.migrate(revision)
    assert empty.do(schema) == wanted


def survive(stored: Rows, found: Rows) -> None:
    """See that rows of an earlier revision are there, as far as their columns still are."""
    for table, rows in stored.items():
        for row, old in zip(found[table], rows, strict=True):
            kept = old.keys() & row.keys()
            assert {name: row[name] for name in kept} == {name: old[name] for name in kept}


@pytest.mark.turns
def test_rows_of_every_revision_survive_the_next_step(empty: Empty) -> None:
    stored: Rows = {}
    for revision in steps(empty):
        empty.migrate(revision)
        found, filled = empty.do(filled_anew)
        survive(stored, found)
        stored = filled


@pytest.mark.long
def test_rows_of_every_earlier_revision_survive_the_migration(empty: Empty) -> None:
    for revision in steps(empty):
        empty.migrate(revision)
        stored = empty.do(fill)
        empty.migrate()
        survive(stored, empty.do(lambda c: contents(c, list(stored))))  # noqa: B023 - called at once
        empty.do(
            lambda c: command.downgrade(alembic_config(c, empty.branch), f"{empty.branch}@base")
        )


def test_migrating_twice_changes_nothing(empty: Empty) -> None:
    assert empty.migrate() == empty.migrate()


def test_a_database_of_a_newer_version_is_refused_and_left_alone(empty: Empty) -> None:
    empty.migrate()
    newer = f"{empty.branch}_9999"
    empty.do(lambda c: c.execute(text(f"UPDATE alembic_version SET version_num = '{newer}'")))
    before = empty.do(schema)
    with pytest.raises(CannotStart, match=rf"newer version .*{newer}"):
        empty.migrate()
    assert empty.do(schema) == before


def test_the_other_process_s_database_is_refused(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'runner.db'}"
    migrate(url, "runner")
    with pytest.raises(CannotStart, match="is not the editor's"):
        migrate(url, "editor")


def test_scripts_are_found_also_where_the_path_is_unusual(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    newest = migrate(f"sqlite:///{tmp_path / 'usual.db'}", "editor")
    strange = tmp_path / "100% a:b;c d"
    strange.mkdir()
    (strange / "migrations").symlink_to(paths.migrations())
    monkeypatch.setattr(paths, "migrations", lambda: strange / "migrations")
    assert migrate(f"sqlite:///{tmp_path / 'editor.db'}", "editor") == newest


@branches
def test_every_table_name_is_said_once(branch: Branch) -> None:
    metadata: MetaData = BRANCHES[branch]
    assert {"event", "head", "snapshot"} <= set(metadata.tables)
