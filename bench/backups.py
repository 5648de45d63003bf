"""Backup, rehearsal, restore, move and upgrade of a server that was used for long: size and time."""

import asyncio
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import msgspec
from pycrdt import Doc, Map
from table import Table, seconds

from action_assistant.editor.log import graph_events as h
from action_assistant.journal.databases import migrate
from action_assistant.journal.events import Addition, Draft
from action_assistant.journal.journal import Journal
from action_assistant.runner import projection
from action_assistant.runner.links.observations import NodeState
from action_assistant.runner.runs.events import (
    Author,
    Ended,
    Observed,
    Published,
    Requested,
    draft_of,
)
from action_assistant.runner.runs.recorder import stream_of

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from journal import servers

TITLE = "Backups, moves and upgrades"
_GRAPHS: Final = 200
_CHANGES: Final = 500  # of each graph
_RUNS: Final = 10_000
_SEEN: Final = 7  # states of each run
_ANN: Final = Author("ann", "Ann")
_COMMAND: Final = (sys.executable, "-m", "action_assistant")


def tables() -> Iterator[Table]:
    """One folder with 100,000 changes of graphs and 10,000 runs of 10 events."""
    with tempfile.TemporaryDirectory() as folder, servers.server() as postgres:
        data = Path(folder) / "data"
        data.mkdir()
        asyncio.run(_filled(data))
        yield Table(("what", "time", "MiB"), list(_rows(Path(folder), data, postgres)))


def _rows(folder: Path, data: Path, postgres: Any) -> Iterator[list[str]]:
    file, url = folder / "x.zip", postgres.new_database()
    journals = sum(path.stat().st_size for path in data.glob("*.db"))
    yield ["editor.db and runner.db", "", _mib(journals)]
    yield ["backup", _took("backup", file, "--data", data), _mib(file.stat().st_size)]
    yield ["restore --rehearse", _took("restore", "--rehearse", file, "--data", data), ""]
    yield ["restore into an empty folder", _took("restore", file, "--data", folder / "new"), ""]
    yield ["verify", _took("verify", "--data", data), ""]
    yield ["move to Postgres, compared", _took("move", "--to", url, "--data", data), ""]
    yield ["backup with Postgres", _took("backup", file, "--data", data), _mib(file.stat().st_size)]
    yield ["move back, compared", _took("move", "--to", "sqlite", "--data", data), ""]
    yield ["runs copy, from nothing", _took("runs", "copy", "--to", url, "--data", data), ""]
    for branch, before in (("editor", "editor_0007"), ("runner", "runner_0005")):
        _downgraded(f"sqlite:///{data / f'{branch}.db'}", branch, before)
    yield ["upgrade of both, with copies", _took("migrate", "--data", data), ""]


def _downgraded(url: str, branch: Any, revision: str) -> None:
    from alembic import command

    from action_assistant.journal.databases import database_of
    from action_assistant.journal.migrate import alembic_config

    migrate(url, branch)
    database_of(url).migrate(
        lambda c: command.downgrade(alembic_config(c, branch), f"{branch}@{revision}")
    )


def _took(*words: "str | Path") -> str:
    begun = time.monotonic()
    done = subprocess.run(
        [*_COMMAND, *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        env=_environment(),
    )
    if done.returncode and not re.search("^missing: the token", done.stdout, re.MULTILINE):
        raise SystemExit(f"{words}: {done.stdout}{done.stderr}")
    return seconds(time.monotonic() - begun)


def _environment() -> dict[str, str]:
    return {key: text for key, text in os.environ.items() if "ACTION_ASSISTANT" not in key}


def _mib(size: int) -> str:
    return f"{size / 2**20:.1f}"


async def _filled(data: Path) -> None:
    (data / "token").write_text("of a benchmark".ljust(43, "-") + "\n")
    editor = await Journal.open(f"sqlite:///{data / 'editor.db'}", branch="editor", fold=h.fold)
    for number in range(_GRAPHS):
        await _drawn(editor, f"g{number}")
    await editor.close()
    url = f"sqlite:///{data / 'runner.db'}"
    runner = await Journal.open(url, branch="runner", fold=projection.fold)
    for first in range(1, _RUNS + 1, 100):
        await runner.append_all([_run(n) for n in range(first, first + 100)])
    await runner.close()


async def _drawn(journal: Journal, graph: str) -> None:
    """A graph of fifty actions that were moved and renamed many times."""
    doc: Doc[Any] = Doc()
    updates: list[bytes] = []
    doc.observe(lambda event: updates.append(event.update))
    for n in range(_CHANGES):
        doc.get("actions", type=Map)[f"aid{n % 50}".ljust(12, "x")] = f"Work{n}"
    drafts = tuple(Draft(h.UPDATED, "ann", each) for each in updates)
    made = Draft(h.CREATED, "ann", msgspec.json.encode(h.GraphCreated(graph, "")))
    about = Addition(h.about_stream(graph), (made,))
    await journal.append_all([about, Addition(h.graph_stream(graph), drafts)])


def _run(number: int) -> Addition:
    at = 1_800_000_000_000_000 + number * 60_000_000
    asked = Requested(
        at=at,
        run=f"run-{number}",
        number=number,
        request_id=f"q{number}",
        author=_ANN,
        graph=f"g{number % _GRAPHS}",
        graph_name=f"g{number % _GRAPHS}",
        version="v1",
        digest=f"{number % 97:064x}",
        engine="simulator",
        simulated=True,
        actions={f"Work_{i}": f"a{i}" for i in range(12)},
        umrf="{}",
    )
    return Addition(stream_of(asked.run), tuple(draft_of(e, "ann") for e in [asked, *_course(at)]))


def _course(at: int) -> list[Any]:
    """Ten events of a run, with the first."""
    states = [
        Observed(at + n, (NodeState(at + n, "g", f"Work_{n}", "RUNNING"),)) for n in range(_SEEN)
    ]
    return [Published(at, "life"), *states, Ended(at + 9_000_000, "finished", "on_true")]
