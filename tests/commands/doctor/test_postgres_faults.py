"""`doctor` on a Postgres server that is broken for real."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from action_assistant.editor.log import database_location
from journal import servers
from journal.servers import Server
from support.doctor import fault, faults, served_once
from support.product import free_ports


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    """A server of our own: its settings are what these tests alter."""
    if servers.binaries() is None:
        pytest.skip("Postgres is not installed (Debian: postgresql)")
    with servers.server() as one:
        yield one


@pytest.fixture(scope="module")
def url(server: Server) -> str:
    """The database of the folder."""
    return server.new_database()


@pytest.fixture(scope="module")
def served(server: Server, url: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that was served with it, instead of a file."""
    return served_once(tmp_path_factory.mktemp("postgres"), "--database", url)


def test_a_sound_one_has_nothing_wrong(data: Path) -> None:
    assert database_location.remembered(data) is not None
    assert faults(data) == []


def test_doctor_names_a_server_that_loses_confirmed_commits(data: Path, server: Server) -> None:
    server.sql("ALTER SYSTEM SET fsync = off")
    server.sql("SELECT pg_reload_conf()")
    try:
        found = until(data, "database-unsafe")
        assert "fsync is off" in found.message
        assert "postgresql.conf" in found.remedy
    finally:
        server.sql("ALTER SYSTEM RESET fsync")
        server.sql("SELECT pg_reload_conf()")
        while faults(data):
            time.sleep(0.1)


def until(data: Path, code: str):  # type: ignore[no-untyped-def]
    """Return the one fault that `doctor` finds once Postgres has read its settings."""
    deadline = time.monotonic() + 10
    while not (found := faults(data)) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert [each.code for each in found] == [code]
    return found[0]


def test_a_wrong_password_an_absent_database_and_an_unknown_host_are_told_apart(
    data: Path, server: Server, url: str
) -> None:
    server.sql("CREATE ROLE ann LOGIN PASSWORD 'right'")
    server.demand_password("ann")
    wrong = url.replace("aa@", "ann:hunter2@")
    found = fault(data, database=wrong)
    assert found.code == "database-password"
    assert "hunter2" not in str(found)
    assert "ACTION_ASSISTANT_DATABASE" in found.remedy
    found = fault(data, database=server.url("nothing"))
    assert found.code == "database-absent"
    found = fault(data, database="postgresql://aa@db.invalid/graphs")
    assert found.code == "database-host-unknown"
    assert "db.invalid" in found.message
    found = fault(data, database=f"postgresql://aa@127.0.0.1:{free_ports()}/graphs")
    assert found.code == "database-unreachable"


def test_graphs_that_were_in_it_and_are_not_any_more_are_named(
    data: Path, server: Server, url: str
) -> None:
    name = url.rpartition("/")[2]
    server.sql(f"ALTER DATABASE {name} RENAME TO kept")
    try:
        assert fault(data).code == "database-absent", "the remembered database is gone"
        server.sql(f"CREATE DATABASE {name}")
        found = fault(data)
        assert found.code == "database-lost"
        assert str(data) in found.message
        server.sql(f"DROP DATABASE {name}")
    finally:
        server.sql(f"ALTER DATABASE kept RENAME TO {name}")
    assert faults(data) == []


def test_newer_tables_of_another_program_and_damage_are_found_there_too(
    data: Path, server: Server, url: str
) -> None:
    name = url.rpartition("/")[2]
    server.sql("UPDATE alembic_version SET version_num = 'editor_9999'", name)
    assert fault(data).code == "schema-newer"
    server.sql("UPDATE alembic_version SET version_num = 'another'", name)
    assert fault(data).code == "database-foreign"
    newest = max(Path("migrations/editor").glob("editor_*.py")).stem
    revision = "_".join(newest.split("_")[:2])
    server.sql(f"UPDATE alembic_version SET version_num = '{revision}'", name)
    assert faults(data) == []
    server.sql("UPDATE event SET author = 'mallory' WHERE position = 3", name)
    assert fault(data).code == "events-damaged"
