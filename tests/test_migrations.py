"""Migrations: the scripts make what `tables.py` says, there and back, from anywhere."""

import sqlite3
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import MetaData, inspect

from action_assistant import places
from action_assistant.errors import CannotStart
from action_assistant.journal.migrate import (
    BRANCHES,
    Branch,
    config_for,
    migrate,
)
from action_assistant.journal.sqlite import sqlite_engine

branches = pytest.mark.parametrize("branch", ["editor", "runner"])


def schema(path: Path) -> dict[str, Any]:
    """Everything that a database says about its tables."""
    engine = sqlite_engine(path, wait=1)
    found = inspect(engine)
    tables = {
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
    engine.dispose()
    return tables


@branches
def test_a_migrated_database_equals_a_fresh_one(branch: Branch, tmp_path: Path) -> None:
    migrate(f"sqlite:///{tmp_path / 'migrated.db'}", branch)
    engine = sqlite_engine(tmp_path / "fresh.db", wait=1)
    with engine.begin() as connection:
        BRANCHES[branch].create_all(connection)
    engine.dispose()
    assert schema(tmp_path / "migrated.db") == schema(tmp_path / "fresh.db")


@branches
def test_alembic_finds_nothing_to_add(branch: Branch, tmp_path: Path) -> None:
    migrate(f"sqlite:///{tmp_path / 'migrated.db'}", branch)
    engine = sqlite_engine(tmp_path / "migrated.db", wait=1)
    with engine.begin() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, BRANCHES[branch]) == []
    engine.dispose()


@branches
def test_every_step_can_be_taken_back_and_again(branch: Branch, tmp_path: Path) -> None:
    path = tmp_path / "steps.db"
    migrate(f"sqlite:///{path}", branch)
    wanted = schema(path)
    engine = sqlite_engine(path, wait=1)
    with engine.begin() as connection:
        command.downgrade(config_for(connection, branch), f"{branch}@base")
    assert schema(path) == {}
    with engine.begin() as connection:
        script = ScriptDirectory.from_config(config_for(connection, branch))
        steps = [s.revision for s in script.iterate_revisions(f"{branch}@head", "base")]
    engine.dispose()
    for revision in reversed(steps):
        migrate(f"sqlite:///{path}", branch, revision)
    assert schema(path) == wanted


@branches
def test_migrating_twice_changes_nothing(branch: Branch, tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'twice.db'}"
    assert migrate(url, branch) == migrate(url, branch)


def test_a_database_of_a_newer_version_is_refused_and_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "editor.db"
    migrate(f"sqlite:///{path}", "editor")
    with sqlite3.connect(path) as connection:
        connection.execute("UPDATE alembic_version SET version_num = 'editor_9999'")
    connection.close()
    before = schema(path)
    with pytest.raises(CannotStart, match=r"newer version .*editor_9999"):
        migrate(f"sqlite:///{path}", "editor")
    assert schema(path) == before


def test_the_other_process_s_database_is_refused(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'runner.db'}"
    migrate(url, "runner")
    with pytest.raises(CannotStart, match="is not the editor's"):
        migrate(url, "editor")


def test_scripts_are_found_also_where_the_path_is_unusual(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    strange = tmp_path / "100% a:b;c d"
    strange.mkdir()
    (strange / "migrations").symlink_to(places.migrations())
    monkeypatch.setattr(places, "migrations", lambda: strange / "migrations")
    assert migrate(f"sqlite:///{tmp_path / 'editor.db'}", "editor") == "editor_0002"


@branches
def test_every_table_name_is_said_once(branch: Branch) -> None:
    metadata: MetaData = BRANCHES[branch]
    assert {"event", "head", "snapshot"} <= set(metadata.tables)
