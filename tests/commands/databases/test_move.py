"""`move`: to Postgres and back, equal before the switch; killed at any moment, one of both is the truth."""

import asyncio
import os
import random
import signal
import subprocess
import threading
import time
from pathlib import Path
from typing import Any, Final

import pytest
from sqlalchemy import select, text

from action_assistant.commands.backups.progress import Progress
from action_assistant.commands.databases.move import differences
from action_assistant.editor.log import database_location
from action_assistant.editor.log import graph_events as h
from action_assistant.journal.databases import ask_once, database_of
from action_assistant.journal.events import Draft
from action_assistant.journal.journal import Journal
from action_assistant.schema.editor_tables import editor_event
from journal.servers import Server
from support.command_line import ran, seconds_of
from support.product import COMMAND, Product, running

WRITERS: Final = int(os.environ.get("TEST_WRITERS", "4"))
KILLS: Final = int(os.environ.get("TEST_MOVE_KILLS", "2"))
SECONDS: Final = float(os.environ.get("TEST_WRITING_S", "1.5"))


def move(data: Path, to: str) -> "subprocess.CompletedProcess[str]":
    return ran("move", "--to", to, "--data", data)


def events(url: str) -> list[tuple[Any, ...]]:
    """Return all events with their chain."""
    chosen = select(editor_event).order_by(editor_event.c.position)
    return ask_once(url, lambda c: [tuple(row) for row in c.execute(chosen)])


def truth(data: Path) -> list[tuple[Any, ...]]:
    return events(database_location.of(data))


def made(data: Path, graphs: int = 40) -> Path:
    """A folder with graphs, which it holds itself."""
    data.mkdir()

    async def fill() -> None:
        url = f"sqlite:///{data / 'editor.db'}"
        journal = await Journal.open(url, branch="editor", fold=h.fold)
        for number in range(graphs):
            drafts = [Draft("it.happened.v1", "ann", bytes([n % 256]) * 900) for n in range(30)]
            await journal.append(f"other/{number}", drafts)
        await journal.close()

    asyncio.run(fill())
    return data


class Writers:
    """Several people who make and rename graphs, and the names that were confirmed to them."""

    def __init__(self, product: Product) -> None:
        self.confirmed: dict[str, str] = {}
        self._over = threading.Event()
        self._threads = [
            threading.Thread(target=self._write, args=(product, n)) for n in range(WRITERS)
        ]

    def write(self, seconds: float) -> dict[str, str]:
        for each in self._threads:
            each.start()
        time.sleep(seconds)
        self._over.set()
        for each in self._threads:
            each.join()
        return self.confirmed

    def _write(self, product: Product, number: int) -> None:
        with product.editor() as http:
            count = 0
            while not self._over.is_set():
                graph = http.post("/api/graphs", json={"name": f"g{number}"}).json()["id"]
                self.confirmed[graph] = f"g{number}"
                count += 1
                name = f"g{number}_{count}"
                if http.patch(f"/api/graphs/{graph}", json={"name": name}).status_code == 200:
                    self.confirmed[graph] = name


def written(product: Product) -> dict[str, str]:
    with product.editor() as http:
        return {each["id"]: each["name"] for each in http.get("/api/graphs").json()}


def wrote(data: Path, *flags: str) -> dict[str, str]:
    with running(data, *flags) as product:
        return Writers(product).write(SECONDS)


@pytest.mark.long
def test_there_and_back_nothing_is_lost_of_what_many_wrote(
    tmp_path: Path, postgres: Server
) -> None:
    data, url = tmp_path / "data", postgres.new_database()
    all_ = wrote(data)
    before = truth(data)
    there = move(data, url)
    assert there.returncode == 0, there.stderr
    assert f"{len(before)} events, each compared, and all tables alike" in there.stdout
    assert truth(data) == before == events(url)
    (aside,) = data.glob("before-move-*/editor.db")
    assert events(f"sqlite:///{aside}") == before

    refused = ran("editor", "--data", data, "--port", "1")
    assert (refused.returncode, "Start with --database" in refused.stderr) == (2, True)
    all_ |= wrote(data, "--database", url)
    before = truth(data)
    back = move(data, "sqlite")
    assert back.returncode == 0, back.stderr
    assert truth(data) == before == events(f"sqlite:///{data / 'editor.db'}")
    assert not (data / "editor.database").exists()
    all_ |= wrote(data)
    with running(data) as product:
        assert all_.items() <= written(product).items()
    # The other database holds an earlier state of the same log: it may be replaced.
    again = move(data, url)
    assert again.returncode == 0, again.stderr
    assert ran("verify", "--data", data).returncode == 0


@pytest.mark.long
def test_a_nul_in_a_name_keeps_no_graphs_from_a_server(tmp_path: Path, postgres: Server) -> None:
    """JSON can say it, SQLite holds it, Postgres does not."""
    data, url = tmp_path / "data", postgres.new_database()
    with running(data) as product, product.editor() as editor:
        editor.post("/api/graphs", json={"name": "a\0b \\u0000"}).raise_for_status()
    there = move(data, url)
    assert there.returncode == 0, there.stderr
    with running(data, "--database", url) as product, product.editor() as editor:
        editor.post("/api/graphs", json={"name": "c\0d"}).raise_for_status()
        assert {"a\0b \\u0000", "c\0d"} <= set(written(product).values())
    rows = ask_once(url, lambda c: set(c.scalars(text("SELECT name FROM graph"))))
    assert {"a\ufffdb \\u0000", "c\ufffdd"} <= rows


def test_a_database_with_other_events_is_left_alone(tmp_path: Path, postgres: Server) -> None:
    url = postgres.new_database()
    assert move(made(tmp_path / "one", 2), url).returncode == 0
    other = made(tmp_path / "two", 3)
    refused = move(other, url)
    assert (refused.returncode, "holds events already" in refused.stderr) == (2, True)
    assert database_location.remembered(other) is None
    assert len(events(url)) == 60


@pytest.mark.long
def test_while_somebody_may_write_nothing_is_moved(tmp_path: Path, postgres: Server) -> None:
    data = tmp_path / "data"
    with running(data):
        refused = move(data, postgres.new_database())
    assert (refused.returncode, "in use by another process" in refused.stderr) == (2, True)
    assert database_location.remembered(data) is None


def test_tables_that_are_not_what_the_events_say_stop_it(tmp_path: Path, postgres: Server) -> None:
    data, url = made(tmp_path / "data", 2), postgres.new_database()
    stray = text("INSERT INTO person VALUES ('p', 'Nobody', 1)")
    database_of(f"sqlite:///{data / 'editor.db'}").migrate(lambda c: c.execute(stray))
    refused = move(data, url)
    assert refused.returncode == 2
    assert "person: 1 rows and 0" in refused.stderr
    assert database_location.remembered(data) is None
    assert ran("rebuild", "--data", data).returncode == 0
    moved = move(data, url)
    assert moved.returncode == 0, moved.stderr
    assert move(data, url).stdout.strip().endswith("are there already.")


@pytest.mark.parametrize(
    ("to", "told"),
    [
        ("sqlite:////tmp/x.db", "--to is `sqlite`"),
        ("nonsense", "is not a URL"),
        ("postgresql://aa@127.0.0.1:1/x", "Cannot use the database"),
    ],
)
def test_a_target_that_graphs_cannot_move_to_is_refused_with_the_reason(
    tmp_path: Path, to: str, told: str
) -> None:
    data = made(tmp_path / "data", 1)
    refused = move(data, to)
    assert (refused.returncode, told in refused.stderr) == (2, True)
    assert len(truth(data)) == 30


def test_every_row_counts_whatever_the_order(tmp_path: Path) -> None:
    one, other = made(tmp_path / "one", 2), made(tmp_path / "two", 2)
    urls = [f"sqlite:///{each / 'editor.db'}" for each in (one, other)]
    assert differences(urls[0], urls[0], Progress()) == []
    assert len(differences(*urls, Progress())) == 2  # times, and so chains


@pytest.mark.timeout(0)
@pytest.mark.long
def test_killed_at_any_moment_one_of_both_is_the_truth(tmp_path: Path, postgres: Server) -> None:
    data, url = made(tmp_path / "data"), postgres.new_database()
    before = truth(data)
    chance = random.Random(7)
    takes, switched = seconds_of("move", "--to", url, "--data", data), 0
    assert move(data, "sqlite").returncode == 0
    for _ in range(KILLS):
        to = url if database_location.remembered(data) is None else "sqlite"
        process = subprocess.Popen(
            [*COMMAND, "move", "--to", to, "--data", str(data)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        time.sleep(takes * chance.uniform(0.3, 1.1))
        process.send_signal(signal.SIGKILL)
        process.wait()
        was_there = database_location.remembered(data) is not None
        switched += was_there == (to == url)
        assert truth(data) == before
        goes_on = move(data, to)
        assert goes_on.returncode == 0, goes_on.stderr
        assert truth(data) == before
        assert not list(data.glob(".move-*"))
    assert KILLS < 10 or 0 < switched < KILLS
    assert ran("verify", "--data", data).returncode == 0
