"""Several real editors on one real Postgres, with one data folder."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
from sqlalchemy.dialects.postgresql import insert

from action_assistant.journal.chain import START
from action_assistant.journal.journal import Journal
from action_assistant.schema.editor_tables import editor_head
from editor.process import Editor
from support.product import TOKEN, free_ports


class OneOfSeveral(Editor):
    """One editor of several. It may be frozen, and killed while it is."""

    def __init__(
        self, data: Path, database: str, number: int, host: str = "127.0.0.1", *flags: str
    ) -> None:
        super().__init__(data, database)
        self._host = host
        self._flags = ["--host", host, *flags]
        self.program = ["-m", "action_assistant"]
        self.inner = f"127.0.0.1:{free_ports()}"
        self.log = data.parent / f"editor-{number}.log"
        self.database = database
        self._child: subprocess.Popen[bytes] | None = None

    @property
    def url(self) -> str:
        """Return the address at which it listens."""
        return f"http://{self._host}:{self.port}"

    def start(self) -> None:
        """Start it and wait until it answers."""
        self.begin()
        self.wait()

    def begin(self, **environ: str) -> None:
        """Start it."""
        words = ["editor", "--data", str(self.data), "--port", str(self.port)]
        words += ["--database", self.database, "--cluster-listen", self.inner, *self._flags]
        given = {**os.environ, "ACTION_ASSISTANT_TOKEN": TOKEN, **environ}
        given["ACTION_ASSISTANT_LIMITS"] = "off"
        with self.log.open("ab") as out:
            command = [sys.executable, *self.program, *words]
            self._child = subprocess.Popen(command, env=given, stdout=out, stderr=out)

    def wait(self) -> None:
        """Wait until it answers."""
        deadline = time.monotonic() + 120
        while True:
            with contextlib.suppress(httpx.TransportError):
                if httpx.get(f"{self.url}/readyz", trust_env=False).status_code == 200:
                    return
            if time.monotonic() > deadline or self.child.poll() is not None:
                raise AssertionError(f"not ready:\n{self.log.read_text()[-4000:]}")
            time.sleep(0.05)

    @property
    def child(self) -> "subprocess.Popen[bytes]":
        """Its process."""
        assert self._child is not None
        return self._child

    def send(self, number: signal.Signals) -> None:
        """Send it a signal."""
        self.child.send_signal(number)

    def kill(self) -> None:
        """kill -9."""
        self.child.kill()
        self.child.wait()

    def end(self) -> int:
        """Ask it to end, and return its exit code."""
        self.child.terminate()
        return self.child.wait(30)


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
            if each._child is not None and each._child.poll() is None:
                each.kill()


async def have_begun(journal: Journal, *streams: str) -> None:
    """Let these streams exist, without an event."""
    rows = [{"stream": each, "seq": 0, "chain": START, "epoch": 0} for each in streams]
    made = insert(editor_head).values(rows).on_conflict_do_nothing()
    await journal.derive(lambda connection: connection.execute(made))
