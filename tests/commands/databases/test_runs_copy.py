"""`runs copy`: runs in Postgres for a team's queries, once each, and the runner knows nothing of it."""

import asyncio
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import text

from action_assistant.journal.databases import ask_once, database_of
from journal.servers import Server
from runner.archives.test_retention import led
from runner.review.old_runs import opened, retention
from support.command_line import ran
from support.product import COMMAND, TOKEN, running
from support.used_server import live


def rows(url: str, question: str) -> list[tuple[Any, ...]]:
    return ask_once(url, lambda c: [tuple(row) for row in c.execute(text(question))])


def until(holds: Callable[[], Any]) -> None:
    deadline = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.1)


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A folder with runs, some of them in archives."""
    folder = tmp_path / "data"
    with running(folder) as product:
        asyncio.run(live(product, TOKEN))
    return folder


@pytest.mark.long
def test_every_event_is_there_once_however_often_it_is_copied(data: Path, postgres: Server) -> None:
    url = postgres.new_database()
    for _ in range(2):
        done = ran("runs", "copy", "--to", url, "--data", data)
        assert done.returncode == 0, done.stderr
    own = f"sqlite:///{data / 'runner.db'}"
    log = rows(own, "SELECT stream, seq, kind, body, position, chain FROM event ORDER BY position")
    copied = rows(
        url,
        "SELECT stream, seq, kind, body, position, chain FROM action_assistant_runs.event "
        "WHERE chain IS NOT NULL ORDER BY position",
    )
    assert copied == log
    runs = rows(own, "SELECT id, number, state, result, archived_as FROM run ORDER BY number")
    assert runs == rows(
        url,
        "SELECT id, number, state, result, archived_as FROM action_assistant_runs.run ORDER BY number",
    )
    archived = [each[0] for each in runs if each[4] is not None]
    assert archived
    with_events = rows(url, "SELECT DISTINCT run FROM action_assistant_runs.run_event")
    assert {each[0] for each in runs} == {each[0] for each in with_events}
    (asked,) = rows(
        url,
        "SELECT data->>'graph_name' FROM action_assistant_runs.run_event "
        f"WHERE run = '{archived[0]}' AND seq = 1",
    )
    assert asked[0].startswith("patrol")


@pytest.mark.long
def test_a_note_with_a_nul_keeps_no_run_from_being_copied(data: Path, postgres: Server) -> None:
    url = postgres.new_database()
    with running(data) as product, product.runner() as runner:
        run = runner.get("/api/runs").json()[0]["id"]
        marks = {"note": "a\0b", "labels": ["c\0d"]}
        runner.patch(f"/api/runs/{run}/marks", json=marks).raise_for_status()
    done = ran("runs", "copy", "--to", url, "--data", data)
    assert done.returncode == 0, done.stderr
    noted = f"SELECT note FROM action_assistant_runs.review WHERE run = '{run}'"
    assert rows(url, noted) == [("a\ufffdb",)]


@pytest.mark.long
def test_another_log_is_not_mixed_in(data: Path, tmp_path: Path, postgres: Server) -> None:
    url = postgres.new_database()
    assert ran("runs", "copy", "--to", url, "--data", data).returncode == 0
    change = text("UPDATE action_assistant_runs.event SET chain = '\\x00' WHERE chain IS NOT NULL")
    database_of(url).migrate(lambda c: c.execute(change))
    refused = ran("runs", "copy", "--to", url, "--data", data)
    assert refused.returncode == 2
    assert "is a copy of another log" in refused.stderr


@pytest.mark.long
def test_new_runs_are_copied_also_after_the_database_was_away(
    data: Path, tmp_path: Path, postgres: Server
) -> None:
    url = postgres.new_database()
    away = url.rsplit("/", 1)[0] + "/postgres"
    with running(data) as product, product.runner() as runner:
        log = (tmp_path / "copy.log").open("wb")
        copying = subprocess.Popen(
            [*COMMAND, "runs", "copy", "--to", url, "--data", str(data), "--follow"], stderr=log
        )
        try:
            until(lambda: b"events copied" in (tmp_path / "copy.log").read_bytes())
            end = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = '{}'"
            rows(away, end.format(url.rsplit("/", 1)[1]))
            robot = {"name": "Later", "domain": 77}
            runner.post("/api/robots", json=robot).raise_for_status()
            found = "SELECT name FROM action_assistant_runs.robot WHERE name = 'Later'"
            until(lambda: rows(url, found))
        finally:
            copying.terminate()
            copying.wait(20)
            log.close()


@pytest.mark.long
def test_a_target_that_runs_cannot_be_copied_to_is_refused_with_the_reason(data: Path) -> None:
    for to, told in (
        ("nonsense", "is not a URL"),
        ("sqlite:///x.db", "is a Postgres database"),
        ("postgresql://aa@127.0.0.1:1/x", "cannot be used"),
    ):
        refused = ran("runs", "copy", "--to", to, "--data", data)
        assert (refused.returncode, told in refused.stderr) == (2, True), refused.stderr


def test_an_archived_conducted_run_is_copied_with_its_pieces(
    tmp_path: Path, postgres: Server
) -> None:
    async def archived() -> tuple[Path, dict[str, int]]:
        data, known = await led(tmp_path)
        journal = await opened(data)
        assert (await retention(journal, data).sweep(30, None)).runs == 1
        await journal.close()
        return data, {each: len(events) for each, events in known.items()}

    data, known = asyncio.run(archived())
    url = postgres.new_database()
    done = ran("runs", "copy", "--to", url, "--data", data)
    assert done.returncode == 0, done.stderr
    counted = rows(url, "SELECT run, count(*) FROM action_assistant_runs.run_event GROUP BY run")
    assert dict(counted) == known
