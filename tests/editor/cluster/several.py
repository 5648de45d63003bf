"""Several real editors on one real Postgres, with one data folder."""

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from sqlalchemy.dialects.postgresql import insert

from action_assistant.journal.chain import START
from action_assistant.journal.journal import Journal
from action_assistant.schema.editor_tables import editor_head
from editor.process import Editor
from support.product import TOKEN, free_ports


class OneOfSeveral(Editor):
    """One editor of several. `inner`: where the others reach it; `program`: the words by which the
    interpreter starts it."""

    def __init__(
        self, data: Path, database: str, number: int, host: str = "127.0.0.1", *flags: str
    ) -> None:
        self.inner = f"127.0.0.1:{free_ports()}"
        super().__init__(data, database, "--cluster-listen", self.inner, "--host", host, *flags)
        self._host = host
        self.log = data.parent / f"editor-{number}.log"
        self.database = database
        self.program = ["-m", "action_assistant"]

    @property
    def url(self) -> str:
        """Return the address at which it listens."""
        return f"http://{self._host}:{self.port}"

    def begin(self, **environ: str) -> None:
        """Start it without limits. `environ`: further variables of its environment."""
        given = {**os.environ, "ACTION_ASSISTANT_TOKEN": TOKEN, "ACTION_ASSISTANT_LIMITS": "off"}
        command = [sys.executable, *self.program, *self.words]
        with self.log.open("ab") as out:
            self._process = subprocess.Popen(command, env=given | environ, stdout=out, stderr=out)


@contextlib.contextmanager
def several(folder: Path, database: str, count: int) -> Iterator[list[OneOfSeveral]]:
    """Editors that run inside the block, as far as a test lets them."""
    editors = [OneOfSeveral(folder / "data", database, n) for n in range(count)]
    with started(editors):
        yield editors


@contextlib.contextmanager
def started(editors: list[OneOfSeveral]) -> Iterator[None]:
    """Let these editors run inside the block."""
    try:
        editors[0].start()
        for each in editors[1:]:
            each.begin()
        for each in editors[1:]:
            each.wait()
        yield
    finally:
        for each in editors:
            each.kill()


async def have_begun(journal: Journal, *streams: str) -> None:
    """Let these streams exist, without an event."""
    rows = [{"stream": each, "seq": 0, "chain": START, "epoch": 0} for each in streams]
    made = insert(editor_head).values(rows).on_conflict_do_nothing()
    await journal.derive(lambda connection: connection.execute(made))
