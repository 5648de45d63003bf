"""Two real editors, of which a file says who owns which graph. Each has a database of its own, so
what one answers about a graph of the other was relayed."""

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from editor.process import Editor
from journal.servers import Server
from support.product import TOKEN, free_ports


class ClusterEditor(Editor):
    """One of the two editors. `inner`: where the other one reaches it."""

    def __init__(self, data: Path, database: str, owners: Path) -> None:
        super().__init__(data, database)
        port = free_ports()
        self.inner = f"http://127.0.0.1:{port}"
        script = Path(__file__).with_name("fixed_owners.py")
        words = (script, data, database, self.port, port, owners)
        self._command = [sys.executable, *map(str, words)]

    def begin(self, **environ: str) -> None:
        """Start it. `environ`: further variables of its environment."""
        given = {**os.environ, "ACTION_ASSISTANT_TOKEN": TOKEN, **environ}
        with self.log.open("ab") as out:
            self._process = subprocess.Popen(self._command, env=given, stdout=out, stderr=out)


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
            editor.kill()


@pytest.fixture(scope="session")
def pair(tmp_path_factory: pytest.TempPathFactory, postgres: Server) -> Iterator[Pair]:
    """Two editors that tests share."""
    with running_pair(tmp_path_factory.mktemp("pair"), postgres) as pair:
        yield pair
