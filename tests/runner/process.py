"""The real runner process for tests, with a data folder of its own."""

import os
import signal
import socket
import subprocess
import time
from pathlib import Path
from typing import Any

import httpx
import msgspec
from websockets.sync.client import ClientConnection, connect

from action_assistant.runner.start.admission import StartRequest
from support import warm
from support.product import COMMAND, TOKEN

BEARER = {"authorization": f"Bearer {TOKEN}"}


class RunnerProcess:
    """A runner. `kill` and `start` may be called in turn."""

    def __init__(self, data: Path, *flags: str) -> None:
        self.data = data
        self._flags = flags
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port: int = free.getsockname()[1]
        self._log = data.parent / f"{data.name}.log"
        self._process: warm.Process | None = None

    @property
    def pid(self) -> int:
        """The id of the process."""
        assert self._process is not None
        return self._process.pid

    def start(self, *wrapper: str) -> "RunnerProcess":
        """Start it, through another program if need be, and wait until it is ready."""
        words = ["runner", "--data", str(self.data), "--port", str(self.port), *self._flags]
        environ = {**os.environ, "ACTION_ASSISTANT_TOKEN": TOKEN}
        if wrapper:
            command = [*wrapper, *COMMAND, *words]
            with self._log.open("ab") as log:
                self._process = subprocess.Popen(command, env=environ, stdout=log, stderr=log)
        else:
            self._process = warm.start(words, environ, self._log)
        deadline = time.monotonic() + 120
        while not self._ready():
            if time.monotonic() > deadline or self._process.poll() is not None:
                raise AssertionError(f"not ready:\n{self._log.read_text()[-4000:]}")
            time.sleep(0.05)
        return self

    def _ready(self) -> bool:
        try:
            url = f"http://127.0.0.1:{self.port}/readyz"
            return httpx.get(url, trust_env=False, timeout=2).status_code == 200
        except httpx.TransportError:
            return False

    def kill(self) -> None:
        """Kill the process with SIGKILL."""
        assert self._process is not None
        self._process.send_signal(signal.SIGKILL)
        self._process.wait()
        self._process = None

    def end(self) -> None:
        """Ask the process to end."""
        if self._process is not None:
            self._process.terminate()
            self._process.wait(20)
            self._process = None

    def client(self) -> httpx.Client:
        """A client with the token."""
        return httpx.Client(
            base_url=f"http://127.0.0.1:{self.port}", headers=BEARER, trust_env=False, timeout=60
        )

    def live(self) -> ClientConnection:
        """Open a live socket."""
        return connect(
            f"ws://127.0.0.1:{self.port}/api/live",
            additional_headers=BEARER,
            proxy=None,
            max_size=None,
        )


def body(asked: StartRequest) -> bytes:
    """A start as it goes over the wire."""
    fields = {
        name: value
        for name, value in msgspec.structs.asdict(asked).items()
        if value is not None and bytes(value if name == "script" else b"x")
    }
    return msgspec.json.encode(fields)


def started(client: httpx.Client, asked: StartRequest) -> dict[str, Any]:
    """Start a run and return it."""
    answer = client.post("/api/runs", content=body(asked))
    assert answer.status_code == 201, answer.text
    run: dict[str, Any] = answer.json()
    assert answer.headers["location"] == f"/api/runs/{run['id']}"
    return run


def over(client: httpx.Client, run: str, patience: float = 30) -> dict[str, Any]:
    """The run when it is over."""
    deadline = time.monotonic() + patience
    while True:
        found: dict[str, Any] = client.get(f"/api/runs/{run}").json()
        if found["ended_at"] is not None:
            return found
        assert time.monotonic() < deadline, found["state"]
        time.sleep(0.05)
