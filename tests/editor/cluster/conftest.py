"""Two real editors, of which a file says who owns which graph. Each has a database of its own, so what one
answers about a graph of the other was relayed."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from editor.process import Editor
from journal.servers import Server
from support.product import TOKEN, free_ports


class ClusterEditor(Editor):
    """One of the two editors. `inner`: where the other one reaches it."""

    def __init__(self, data: Path, database: str, owners: Path) -> None:
        super().__init__(data)
        self._url = database
        self.inner = f"http://127.0.0.1:{free_ports()}"
        self._owners = owners
        self._child: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start it and wait until it answers."""
        inner = self.inner.rpartition(":")[2]
        script = Path(__file__).with_name("fixed_owners.py")
        words = [str(script), str(self.data), self._url, str(self.port), inner]
        with self.log.open("ab") as out:
            self._child = subprocess.Popen(
                [sys.executable, *words, str(self._owners)],
                env={**os.environ, "ACTION_ASSISTANT_TOKEN": TOKEN},
                stdout=out,
                stderr=out,
            )
        deadline = time.monotonic() + 120
        while True:
            with contextlib.suppress(httpx.TransportError):
                if httpx.get(f"{self.url}/readyz", trust_env=False).status_code == 200:
                    return
            if time.monotonic() > deadline or self._child.poll() is not None:
                raise AssertionError(f"not ready:\n{self.log.read_text()[-4000:]}")
            time.sleep(0.05)

    def send(self, number: signal.Signals) -> None:
        """Send it a signal."""
        assert self._child is not None
        self._child.send_signal(number)

    def kill(self) -> None:
        """kill -9, whatever it is doing."""
        self.send(signal.SIGKILL)
        assert self._child is not None
        self._child.wait()


class Pair:
    """Both editors. All graphs are `there`'s, until a test says otherwise."""

    def __init__(self, folder: Path, postgres: Server) -> None:
        self._file = folder / "owners.json"
        self.here = ClusterEditor(folder / "here", postgres.new_database(), self._file)
        self.there = ClusterEditor(folder / "there", postgres.new_database(), self._file)
        self._owners: dict[str, str] = {}
        self.give("*", self.there)

    def give(self, stream: str, editor: ClusterEditor) -> None:
        """Make an editor the owner of a stream."""
        self._owners[stream] = editor.inner
        fresh = self._file.with_suffix(".new")
        fresh.write_text(json.dumps(self._owners))
        fresh.replace(self._file)

    def new_graph(self) -> str:
        """Return the id of a new graph in the database of `there`."""
        with self.there.client() as client:
            made: str = client.post("/api/graphs", json={"name": "task"}).json()["id"]
        return made


@contextlib.contextmanager
def running_pair(folder: Path, postgres: Server) -> Iterator[Pair]:
    """Both editors, which run inside the block, as far as the test lets them."""
    pair = Pair(folder, postgres)
    try:
        pair.here.start()
        pair.there.start()
        yield pair
    finally:
        for editor in (pair.here, pair.there):
            with contextlib.suppress(AssertionError):
                editor.kill()


@pytest.fixture(scope="session")
def pair(tmp_path_factory: pytest.TempPathFactory, postgres: Server) -> Iterator[Pair]:
    """Two editors that tests share."""
    with running_pair(tmp_path_factory.mktemp("pair"), postgres) as pair:
        yield pair
