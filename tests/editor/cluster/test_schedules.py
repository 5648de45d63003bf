"""Real editors' journals and owners on a real Postgres, frozen, killed, cut and restarted at random moments: nothing
that was acknowledged is lost, nothing is doubled or damaged, no slot has gaps, and no owner writes after another."""

import asyncio
import multiprocessing
import os
import random
import signal
import time
from collections import Counter
from pathlib import Path
from typing import Final

import pytest

from action_assistant.editor.cluster.owners import Here
from action_assistant.editor.cluster.shared_owners import SharedOwners
from action_assistant.errors import CannotStart, Conflict, Unavailable
from action_assistant.journal.events import Addition, Draft, Event, nothing
from action_assistant.journal.journal import Journal
from action_assistant.journal.slots import Cursor, before_first, slot_of
from editor.cluster.several import have_begun
from journal.servers import Server
from support.waiting import until

SCHEDULES: Final = int(os.environ.get("SOAK_SCHEDULES", "1"))
_STREAMS: Final = ("graph/a", "graph/b", "graph/c")
_SHARED: Final = "audit"
_FAULTS: Final = 6
_FORK: Final = multiprocessing.get_context("fork")


class Writer:
    """Appends to the streams that its editor owns, as rooms do, and writes down what was acknowledged."""

    def __init__(self, journal: Journal, owners: SharedOwners, name: str, out: Path) -> None:
        self._journal = journal
        self._owners = owners
        self._name = name
        self._out = out.open("a")
        self._dice = random.Random(name)
        self._ends: dict[str, tuple[int, int]] = {}  # epoch and seq
        self._count = 0
        owners.when_lost(lambda stream: self._ends.pop(stream, None))

    async def write(self, ended: asyncio.Event) -> None:
        """Go on until the end."""
        while not ended.is_set():
            stream = self._dice.choice(_STREAMS)
            try:
                owner = await self._owners.owner(stream)
                if isinstance(owner, Here) and owner.epoch is not None:
                    await self._append(stream, owner.epoch)
                    if self._dice.random() < 0.02:
                        self._ends.pop(stream, None)
                        await self._owners.give_up(stream)
            except (Conflict, Unavailable):  # the room ends
                self._ends.pop(stream, None)
                self._owners.check_again(stream)
            await asyncio.sleep(self._dice.uniform(0, 0.02))

    async def _append(self, stream: str, epoch: int) -> None:
        if self._ends.get(stream, (0, 0))[0] != epoch:
            self._ends[stream] = epoch, await self._journal.newest(stream)
        seq = self._ends[stream][1]
        self._count += 1
        body = f"{self._name}/{self._count} {epoch}"
        draft = Draft("thing.happened.v1", self._name, body.encode())
        also = [Addition(_SHARED, (draft,))] if self._dice.random() < 0.3 else []
        (newest, *_) = await self._journal.append_all(
            [Addition(stream, (draft,), seq, epoch), *also]
        )
        self._ends[stream] = epoch, newest
        self._out.write(f"{stream} {newest} {body}\n")
        self._out.flush()


def live(url: str, name: str, out: Path) -> None:
    """Be an editor, in a process of its own."""

    async def be() -> None:
        ended = asyncio.Event()
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, ended.set)
        while not ended.is_set():
            try:
                journal = await Journal.open(url, branch="editor", fold=nothing, several=True)
            except CannotStart:
                await asyncio.sleep(0.1)
                continue
            try:
                await have_begun(journal, *_STREAMS)
                async with SharedOwners.joined(journal, url, f"http://{name}") as owners:
                    await Writer(journal, owners, name, out).write(ended)
            except Unavailable:  # the server went away before it had joined
                await asyncio.sleep(0.1)
            finally:
                await journal.close()

    asyncio.run(be())


class Editor:
    """One life after another of an editor."""

    def __init__(self, url: str, n: int, folder: Path) -> None:
        self._url = url
        self._n = n
        self._lives = 0
        self.out = folder / f"acknowledged-{n}"
        self.out.touch()  # on a busy machine one may end before it joins
        self.begin()

    def begin(self) -> None:
        """Start a process."""
        self._lives += 1
        name = f"e{self._n}.{self._lives}"
        self.process = _FORK.Process(target=live, args=(self._url, name, self.out))
        self.process.start()

    def send(self, number: signal.Signals) -> None:
        """Send a signal."""
        assert self.process.pid is not None
        os.kill(self.process.pid, number)


def disturb(editors: list[Editor], postgres: Server, name: str, dice: random.Random) -> str:
    """Let one thing go wrong, and mend it."""
    editor = dice.choice(editors)
    match dice.randrange(6):
        case 0 | 1:
            editor.send(signal.SIGSTOP)
            time.sleep(dice.choice((0.5, 3.0)))
            editor.send(signal.SIGCONT)
            return "frozen"
        case 2:
            editor.send(signal.SIGKILL)
            editor.process.join()
            editor.begin()
            return "killed"
        case 3 | 4:
            postgres.sql(
                "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE pid <> pg_backend_pid()"
                " AND datname = current_database() ORDER BY random() LIMIT 3",
                name,
            )
            return "cut"
        case _:
            postgres.stop()
            time.sleep(dice.uniform(0, 1))
            postgres.start()
            return "restarted"


def epoch_of(body: str) -> int:
    """Return the epoch in which an event was appended."""
    return int(body.split()[1])


def acknowledged(editors: list[Editor]) -> list[list[str]]:
    """Return stream, number and body of each event that was acknowledged so far."""
    texts = [each.out.read_text() for each in editors if each.out.exists()]
    lines = [line for text in texts for line in text.splitlines(keepends=True)]
    return [line.rstrip("\n").split(" ", 2) for line in lines if line.endswith("\n")]


async def whole(url: str) -> tuple[list[Event], object]:
    """Return all events, and what a check of the log finds."""
    journal = await Journal.open(url, branch="editor", fold=nothing, several=True)
    stored: list[Event] = []
    seen = Cursor()
    while page := await journal.read_since(seen):
        stored += page
        for event in page:
            seen = seen.after(event.position)
    damages = await journal.verify()
    await journal.close()
    return stored, damages


@pytest.mark.parametrize("seed", range(SCHEDULES))
def test_editors_that_freeze_die_and_are_cut_lose_double_and_damage_nothing(
    postgres: Server, tmp_path: Path, seed: int
) -> None:
    dice = random.Random(seed)
    url = postgres.new_database()
    name = url.rpartition("/")[2]
    Journal.prepare(url, "editor", several=True)
    editors = [Editor(url, n, tmp_path) for n in range(3)]
    faults: Counter[str] = Counter()
    try:
        until("an editor did not begin", lambda: all(acknowledged([each]) for each in editors), 120)
        for _ in range(_FAULTS):
            faults[disturb(editors, postgres, name, dice)] += 1
            time.sleep(dice.uniform(0.2, 1.5))
        so_far = len(acknowledged(editors))
        until("not all goes on", lambda: len(acknowledged(editors)) > so_far + 20, 120)
        until(
            "nothing changed hands",
            lambda: any(epoch_of(each[2]) > 1 for each in acknowledged(editors)),
        )
        for editor in editors:
            editor.send(signal.SIGTERM)
        for editor in editors:
            editor.process.join(60)
            assert editor.process.exitcode == 0
    finally:
        for editor in editors:
            editor.process.kill()
    stored, damages = asyncio.run(whole(url))
    assert damages == []
    graphs = [each for each in stored if each.stream != _SHARED]
    written = Counter((each.stream, each.seq, each.body.decode()) for each in graphs)
    told = acknowledged(editors)
    assert [line for line in told if (line[0], int(line[1]), line[2]) not in written] == []  # lost
    bodies = Counter(each.body for each in graphs)
    assert [body for body, count in bodies.items() if count > 1] == []  # doubled
    epochs: dict[str, int] = {}
    for event in graphs:
        epoch = epoch_of(event.body.decode())
        assert epoch >= epochs.get(event.stream, 0)
        epochs[event.stream] = epoch
    for slot in {slot_of(each.position) for each in stored}:
        mine = sorted(each.position for each in stored if slot_of(each.position) == slot)
        assert mine == [before_first(slot) + n for n in range(1, len(mine) + 1)]  # no gaps
    print(  # noqa: T201 - a figure of the soak
        f"seed {seed}: {len(stored)} events, {len(told)} acknowledged, {sum(epochs.values())} taken over,"
        f" {dict(faults)}"
    )
