"""`migrate --back` killed anywhere: what was, or what shall be, whole; and done by doing it again."""

import asyncio
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, NamedTuple

import pytest
from sqlalchemy import Connection, inspect, text

from action_assistant.journal.copies.before_upgrade import FOLDER, copies_in
from action_assistant.journal.databases import ask_once, database_of, migrate
from action_assistant.journal.events import Draft, nothing
from action_assistant.journal.journal import Journal
from action_assistant.journal.sqlite import inspected
from journal.servers import Server
from support.command_line import ran
from support.product import COMMAND
from support.rows import contents, fill, write_events

KILLS: Final = int(os.environ.get("TEST_BACK_KILLS", "1"))
OLD: Final = "editor_0005"
LOG: Final = frozenset({"event", "head"})
#: Does it once told to, and dies by its own hand before the step that its last argument names, if any.
CHILD: Final = """
import os, signal, sys
from pathlib import Path
from alembic import command
from action_assistant.commands.databases.migrate import go_back
from action_assistant.editor.log import database_location
from action_assistant.journal import postgres

data, copy, url, step = sys.argv[1:]
steps = 0

def seen(event, args):
    global steps
    named = {"open", "os.link", "os.rename", "os.remove", "os.mkdir", "sqlite3.connect"}
    if event in named and data in " ".join(map(str, args)):
        steps += 1
        if steps == int(step):
            os.kill(os.getpid(), signal.SIGKILL)

print("ready", flush=True)
sys.stdin.readline()
sys.addaudithook(seen)
go_back(Path(data), url or None, [Path(copy)])
print("done", steps, flush=True)
"""


class Upgraded(NamedTuple):
    """A folder whose graphs are of this version and have gone on, and its copy from before."""

    data: Path
    url: str
    copy: Path

    def now(self) -> dict[str, Any]:
        return ask_once(self.url or f"sqlite:///{self.data / 'editor.db'}", stored)


def stored(connection: Connection) -> dict[str, Any]:
    """Return all rows of all tables except `written_by`."""
    names = set(inspect(connection).get_table_names()) - {"written_by"}
    return contents(connection, sorted(names))


def upgraded(data: Path, url: str = "") -> Upgraded:
    data.mkdir()
    place = url or f"sqlite:///{data / 'editor.db'}"
    migrate(place, "editor", OLD)
    database_of(place).migrate(lambda c: (write_events(c, each=100), fill(c, LOG)))
    goes_on(data, place)
    (copy,) = copies_in(data / FOLDER)
    kept = data / copy.path.name  # of those in their folder, the last few stay
    return Upgraded(data, url, Path(shutil.copy(copy.path, kept)))


def goes_on(data: Path, url: str) -> None:
    async def append() -> None:
        journal = await Journal.open(url, branch="editor", fold=nothing, copies=data / FOLDER)
        try:
            for number in range(20):
                await journal.append(f"later/{number}", [Draft("it.happened.v1", "ann", b"{}")] * 9)
        finally:
            await journal.close()

    asyncio.run(append())


def with_a_log(there: Upgraded, data: Path) -> Upgraded:
    """Copy the data folder as a killed server leaves it: its last commits are in the write-ahead
    log."""
    shutil.copytree(there.data, data)
    there = there._replace(data=data, copy=data / there.copy.relative_to(there.data))
    path = data / "editor.db"
    left = {suffix: path.with_name(f"editor.db{suffix}") for suffix in ("", "-wal")}
    with closing(sqlite3.connect(path)) as database:
        database.execute("PRAGMA wal_autocheckpoint=0")
        database.execute("INSERT INTO person VALUES ('late', 'Late', 1)")
        database.commit()
        kept = {suffix: each.read_bytes() for suffix, each in left.items()}
    for suffix, each in left.items():
        each.write_bytes(kept[suffix])
    return there


class Child:
    """One that goes back, in a process of its own."""

    def __init__(self, there: Upgraded, step: int = 0) -> None:
        arguments = [there.data, there.copy, there.url, step]
        self.process = subprocess.Popen(
            [sys.executable, "-c", CHILD, *map(str, arguments)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        assert self.process.stdout is not None
        assert self.process.stdout.readline() == b"ready\n"

    def go(self, kill_after: float | None = None) -> int:
        """Return how many steps the command took; 0 when it was killed."""
        pipe = self.process.stdin
        assert pipe is not None
        pipe.write(b"\n")
        pipe.flush()
        if kill_after is not None:
            time.sleep(kill_after)
            self.process.send_signal(signal.SIGKILL)
        said, _ = self.process.communicate(timeout=60)
        return int(said.rsplit(b"done", 1)[1]) if b"done" in said else 0


def check(there: Upgraded, before: dict[str, Any], after: dict[str, Any]) -> str:
    """Whole, and whole again once it is repeated; what it was."""
    now = there.now()
    assert now in (before, after)
    options = ["--database", there.url] if there.url else []
    again = ran("migrate", "--back", there.copy, "--data", there.data, *options)
    assert again.returncode == 0, again.stderr
    assert there.now() == after
    assert not list(there.data.glob(".*.part*"))
    asides = [each for each in there.data.glob("before-restore-*/*.db") if inspected(each)[1] == []]
    assert before in [ask_once(f"sqlite:///{each}", stored) for each in asides]
    return "before" if now == before else "after"


@pytest.mark.long
@pytest.mark.timeout(0)
def test_killed_anywhere_a_file_is_as_it_was_or_as_it_shall_be(tmp_path: Path) -> None:
    first = upgraded(tmp_path / "data")
    after = ask_once(f"sqlite:///{first.copy}", stored)
    timed = with_a_log(first, tmp_path / "timed")
    before, child = timed.now(), Child(timed)
    begun = time.monotonic()
    steps = child.go()
    takes, chance, found = time.monotonic() - begun, random.Random(8), []
    assert steps > 10
    for number in range(KILLS):
        at_step = 1 + number * steps // KILLS
        for step, moment in ((at_step, None), (0, takes * chance.uniform(0.0, 1.0))):
            there = with_a_log(first, tmp_path / "killed")
            Child(there, step).go(moment)
            found.append(check(there, before, after))
            shutil.rmtree(there.data)
    sys.stdout.write(f"{len(found)} kills in {steps} steps: {found.count('before')} as before\n")
    assert KILLS < 10 or len(set(found)) > 1


@pytest.mark.long
@pytest.mark.timeout(0)
def test_killed_anywhere_a_server_has_what_was_or_what_shall_be(
    tmp_path: Path, postgres: Server
) -> None:
    there = upgraded(tmp_path / "data", postgres.new_database())
    after = ask_once(f"sqlite:///{there.copy}", stored)
    child = Child(there)
    begun = time.monotonic()
    assert child.go()
    takes, chance, found = time.monotonic() - begun, random.Random(9), []
    for _ in range(max(1, KILLS // 5)):
        goes_on(there.data, there.url)
        before = there.now()
        Child(there).go(takes * chance.uniform(0.1, 1.0))
        found.append(check(there, before, after))
    sys.stdout.write(f"{len(found)} kills: {found.count('before')} as before\n")


def refused(there: Upgraded, *more: "str | Path") -> str:
    """Return the message of `migrate --back`, which has to change nothing."""
    before = set(there.data.glob("*[!ml]"))  # without -shm and -wal of what was only read
    done = ran("migrate", "--back", there.copy, "--data", there.data, *more)
    assert done.returncode == 2, done.stdout + done.stderr
    assert set(there.data.glob("*[!ml]")) == before
    return done.stderr.replace("\n", " ")


@pytest.mark.parametrize("begin", ["BEGIN", "BEGIN EXCLUSIVE"])
def test_while_somebody_else_has_the_file_open_nothing_is_put_back(
    tmp_path: Path, begin: str
) -> None:
    """Rows in the write-ahead log would be lost if the file were replaced."""
    there = upgraded(tmp_path / "data")
    path, late = there.data / "editor.db", "INSERT INTO person VALUES (?, 'Late', 1)"
    with closing(sqlite3.connect(path, isolation_level=None)) as writer:
        writer.execute(late, ("one",))
        with closing(sqlite3.connect(path, isolation_level=None)) as other:
            other.execute(begin)
            other.execute("SELECT count(*) FROM event").fetchone()
            if begin == "BEGIN":
                writer.execute(late, ("two",))
            assert "Somebody else has" in refused(there)
    with closing(sqlite3.connect(path)) as database:
        assert ("one",) in database.execute("SELECT id FROM person").fetchall()


def test_two_copies_of_one_journal_are_too_many(tmp_path: Path) -> None:
    there = upgraded(tmp_path / "data")
    another = shutil.copy(there.copy, there.copy.with_name(f"{OLD}-20250101-000000.db"))
    assert "one copy of each journal" in refused(there, "--back", there.copy, another)


def test_a_full_disk_leaves_no_part_of_a_copy(tmp_path: Path) -> None:
    there = upgraded(tmp_path / "data")
    back = ["migrate", "--back", str(there.copy), "--data", str(there.data)]
    blocks = there.copy.stat().st_size // 1024  # of 512 bytes: half of it
    done = subprocess.run(
        ["sh", "-c", f'ulimit -f {blocks}; exec "$@"', "sh", *COMMAND, *back],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, "Cannot write to" in done.stderr) == (2, True), done.stderr
    assert not list(there.data.glob(".*.part"))


@pytest.mark.long
@pytest.mark.parametrize("scheme", ["sqlite", "sqlite+pysqlite"])
def test_a_file_that_is_elsewhere_is_put_back_too(tmp_path: Path, scheme: str) -> None:
    there = upgraded(tmp_path / "data")
    after = ask_once(f"sqlite:///{there.copy}", stored)
    disk = Path("/dev/shm")
    with TemporaryDirectory(dir=disk if disk.is_dir() else tmp_path) as folder:
        moved = shutil.move(there.data / "editor.db", folder)
        url = f"{scheme}:///{moved}"
        back = ["migrate", "--back", str(there.copy), "--data", str(there.data)]
        done = subprocess.run([*COMMAND, *back, "--database", url], check=False, timeout=60)
        assert done.returncode == 0
        assert ask_once(url, stored) == after


@pytest.mark.long
def test_an_older_version_puts_nothing_back_on_a_server(tmp_path: Path, postgres: Server) -> None:
    """The older version does not know all tables that it would have to remove."""
    there = upgraded(tmp_path / "data", postgres.new_database())
    newer = text("UPDATE alembic_version SET version_num = 'editor_9999'")
    database_of(there.url).migrate(lambda c: c.execute(newer))
    assert "by the version that made their tables" in refused(there, "--database", there.url)
