"""Servers to measure: ours as it is, and Hocuspocus with SQLite, which is the one to beat."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import psutil

FOLDER: Final = Path(__file__).parent
#: Where rivals are installed: outside of the repository, kept for the next time.
RIVALS: Final = Path(os.environ.get("BENCH_RIVALS", Path(tempfile.gettempdir()) / "rivals"))
PACKAGES: Final = ("@hocuspocus/server@4.7.0", "@hocuspocus/extension-sqlite@4.7.0")
TOKEN: Final = "token-of-a-benchmark-" + "0" * 32
_SERVER: Final = """
import { Server } from "@hocuspocus/server"
import { SQLite } from "@hocuspocus/extension-sqlite"
const database = `${process.env.DATA}/db.sqlite`
const server = new Server({
  port: Number(process.env.PORT), address: "127.0.0.1", quiet: true,
  extensions: [new SQLite({ database })],
})
await server.listen()
process.on("SIGTERM", async () => { await server.destroy(); process.exit(0) })
"""


class Peer:
    """A server with a data folder of its own. May be stopped and started again."""

    name = ""
    dialect = "plain"
    path = ""

    def __init__(self, data: Path) -> None:
        self.data = data
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port: int = free.getsockname()[1]
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def pid(self) -> int:
        """The id of its process."""
        assert self._process is not None
        return self._process.pid

    def command(self) -> list[str]:
        raise NotImplementedError

    def environment(self) -> dict[str, str]:
        return {}

    def rooms(self, count: int) -> list[str]:
        return [f"room-{n}" for n in range(count)]

    def headers(self) -> list[str]:
        return []

    def start(self) -> None:
        """Start, and wait until it listens."""
        with (self.data / "log").open("ab") as log:
            self._process = subprocess.Popen(
                self.command(),
                cwd=self.data,
                env={**os.environ, **self.environment()},
                stdout=log,
                stderr=log,
            )
        until = time.monotonic() + 60
        while time.monotonic() < until and self._process.poll() is None:
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", self.port)) == 0:
                    return
            time.sleep(0.05)
        raise RuntimeError(f"{self.name} did not start: {(self.data / 'log').read_text()[-2000:]}")

    def stop(self) -> None:
        """End it in order."""
        if self._process is not None:
            self._process.send_signal(signal.SIGTERM)
            self._process.wait(30)

    def under(self, operation: str, rooms: list[str], **more: Any) -> dict[str, Any]:
        """What clients find that do something here, once the server has done what a start leaves to do:
        ours makes its workers two seconds later."""
        assert self._process is not None
        _wait_for_rest(psutil.Process(self._process.pid))
        plan = {
            "port": self.port,
            "pid": self._process.pid,
            "dialect": self.dialect,
            "path": self.path,
            "rooms": rooms,
            "headers": self.headers(),
            "operation": operation,
            **more,
        }
        command = [sys.executable, str(FOLDER / "load.py"), json.dumps(plan)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=400, check=False)
        if done.returncode:
            raise RuntimeError(done.stderr[-2000:])
        found: dict[str, Any] = json.loads(done.stdout)
        return found


class Ours(Peer):
    """The editor as people run it, at full durability; only the limits on strangers are lifted."""

    name = "ours"
    path = "/api/graphs/{room}/room?acks=1"

    def command(self) -> list[str]:
        program = [sys.executable, "-m", "action_assistant", "editor"]
        return [*program, "--data", str(self.data), "--port", str(self.port)]

    def environment(self) -> dict[str, str]:
        return {"ACTION_ASSISTANT_TOKEN": TOKEN, "ACTION_ASSISTANT_LIMITS": "off"}

    def headers(self) -> list[str]:
        return [f"Authorization: Bearer {TOKEN}"]

    def rooms(self, count: int) -> list[str]:
        return [self._graph(n) for n in range(count)]

    def _graph(self, n: int) -> str:
        request = urllib.request.Request(
            f"http://127.0.0.1:{self.port}/api/graphs",
            data=json.dumps({"name": f"graph {n}"}).encode(),
            headers={"authorization": f"Bearer {TOKEN}", "content-type": "application/json"},
        )
        with urllib.request.urlopen(request) as answer:
            made: str = json.load(answer)["id"]
        return made


class Hocuspocus(Peer):
    """Hocuspocus as its documentation sets it up: stores some seconds later, all at once."""

    name = "Hocuspocus"
    dialect = "hocuspocus"
    path = "/"

    def command(self) -> list[str]:
        return [str(FOLDER.parent / "scripts" / "with-node"), "node", str(RIVALS / "server.mjs")]

    def environment(self) -> dict[str, str]:
        return {"PORT": str(self.port), "DATA": str(self.data)}

    @staticmethod
    def install() -> None:
        """Once, by npm."""
        if (RIVALS / "server.mjs").exists():
            return
        RIVALS.mkdir(parents=True, exist_ok=True)
        (RIVALS / "package.json").write_text('{"private": true}')
        npm = [str(FOLDER.parent / "scripts" / "with-node"), "npm", "install", "--no-audit"]
        subprocess.run([*npm, "--no-fund", "--silent", *PACKAGES], cwd=RIVALS, check=True)
        (RIVALS / "server.mjs").write_text(_SERVER)


def _wait_for_rest(server: psutil.Process) -> None:
    """Until it has done next to nothing for longer than anything is put off for (seconds)."""
    rested, used = 0.0, -1.0
    for _ in range(120):
        now = sum(sum(each.cpu_times()[:2]) for each in (server, *server.children(recursive=True)))
        rested = rested + 0.25 if now - used < 0.02 else 0.0
        if rested >= 2.5:
            return
        used = now
        time.sleep(0.25)
    raise RuntimeError(f"{server.pid} does not come to rest")


@contextmanager
def running(kind: type[Peer]) -> Iterator[Peer]:
    """A fresh one, until the block ends."""
    if kind is Hocuspocus:
        Hocuspocus.install()
    data = Path(tempfile.mkdtemp(prefix="bench-"))
    peer = kind(data)
    peer.start()
    try:
        yield peer
    finally:
        peer.stop()
        shutil.rmtree(data)
