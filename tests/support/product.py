"""The real product for tests: `action-assistant serve` on free ports with a data folder of its own."""

import os
import random
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import psutil

from support import warm
from support.command_line import ran

TOKEN = "test-token-" + "0123456789abcdef" * 2
COMMAND = (sys.executable, "-m", "action_assistant")
#: The installed program, as people and services start it.
PROGRAM = (str(Path(sys.executable).with_name("action-assistant")),)


def free_ports() -> int:
    """The first of two neighbouring ports that nobody listens on. Of those that the system hands out
    to whoever connects, any may be taken again before it is used."""
    while True:
        port = random.SystemRandom().randrange(10_000, 32_000, 2)
        with socket.socket() as one, socket.socket() as two:
            try:
                one.bind(("127.0.0.1", port))
                two.bind(("127.0.0.1", port + 1))
            except OSError:
                continue
            return port


class Product:
    """A running editor and runner. `kill` and `start` may be called in turn."""

    def __init__(
        self,
        data: Path,
        *flags: str,
        hosts: str = "",
        program: tuple[str, ...] = COMMAND,
        folder: Path | None = None,
    ) -> None:
        self.data = data
        self._program = program
        self._folder = folder  # the working folder
        self._flags = flags
        self._hosts = hosts
        self._scheme = "https" if "--tls" in flags else "http"
        self.port = free_ports()
        self.log = data.parent / f"{data.name}.log"
        self._process: warm.Process | None = None

    def add_flags(self, *flags: str) -> None:
        """Give the next start more flags, which may name its ports."""
        self._flags += flags

    @property
    def url(self) -> str:
        """The URL of the editor."""
        return f"{self._scheme}://127.0.0.1:{self.port}"

    @property
    def runner_url(self) -> str:
        """The URL of the runner."""
        return f"{self._scheme}://127.0.0.1:{self.port + 1}"

    @property
    def environment(self) -> dict[str, str]:
        """The environment in which commands find this server."""
        return {
            **os.environ,
            "ACTION_ASSISTANT_TOKEN": TOKEN,
            "ACTION_ASSISTANT_URL": self.url,
            "ACTION_ASSISTANT_HOSTS": self._hosts,
        }

    def start(self) -> None:
        """Start it and wait until both processes answer."""
        words = ["serve", "--data", str(self.data), "--port", str(self.port), "--no-open"]
        words += self._flags
        if self._program == COMMAND and self._folder is None:
            self._process = warm.start(words, self.environment, self.log)
        else:
            with self.log.open("ab") as log:
                self._process = subprocess.Popen(
                    [*self._program, *words],
                    env=self.environment,
                    cwd=self._folder,
                    stderr=log,
                    stdout=log,
                    start_new_session=True,
                )
        self.wait_until_ready()

    def wait_until_ready(self, seconds: float = 120) -> None:
        """Wait until both processes can do their work."""
        deadline = time.monotonic() + seconds
        for url in (self.url, self.runner_url):
            while not _ready(url):
                if time.monotonic() > deadline or self._process is None or self._process.poll():
                    raise AssertionError(f"not ready:\n{self.log.read_text()[-4000:]}")
                time.sleep(0.05)

    def process(self, name: str) -> psutil.Process:
        """The editor or the runner."""
        assert self._process is not None
        for child in psutil.Process(self._process.pid).children():
            if name in child.cmdline():
                return child
        raise AssertionError(f"no {name} is running")

    def kill(self) -> None:
        """kill -9 of everything at once. Nothing of it is there any more afterwards, nor holds a port."""
        assert self._process is not None
        children = psutil.Process(self._process.pid).children(recursive=True)
        os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        deadline = time.monotonic() + 20
        while any(map(is_alive, children)) and time.monotonic() < deadline:
            time.sleep(0.01)
        self._process = None

    def kill_serve(self) -> None:
        """kill -9 of the parent alone."""
        assert self._process is not None
        self._process.kill()
        self._process.wait()
        self._process = None

    def end(self) -> int:
        """Ask it to end; the exit code."""
        if self._process is None:
            return 0
        self._process.terminate()
        code = self._process.wait(20)
        self._process = None
        return code

    def cli(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run a command against this server: inside this process, unless another program or
        working folder was given."""
        if self._program == COMMAND and self._folder is None:
            return ran(*arguments, environ=self.environment)
        return self.process_of(*arguments)

    def process_of(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run a command against this server in a process of its own."""
        return subprocess.run(
            [*self._program, *arguments],
            env=self.environment,
            cwd=self._folder,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )

    def started(self, *arguments: str) -> "subprocess.Popen[str]":
        """Start a command against this server in a process of its own, without waiting for its end."""
        return subprocess.Popen(
            [*self._program, *arguments],
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def editor(self) -> httpx.Client:
        """A client of the editor with the token."""
        return _client(self.url)

    def runner(self) -> httpx.Client:
        """A client of the runner with the token."""
        return _client(self.runner_url)


@contextmanager
def frozen(process: psutil.Process) -> Iterator[None]:
    """Freeze a process inside the block."""
    process.suspend()
    try:
        yield
    finally:
        process.resume()


def _client(url: str) -> httpx.Client:
    return httpx.Client(
        base_url=url, headers={"authorization": f"Bearer {TOKEN}"}, trust_env=False, timeout=20
    )


def is_alive(process: psutil.Process) -> bool:
    """Return whether a process still holds anything; a zombie holds nothing."""
    try:
        return process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def _ready(url: str) -> bool:
    try:
        return (
            httpx.get(f"{url}/readyz", trust_env=False, timeout=2, verify=False).status_code == 200
        )
    except httpx.TransportError:
        return False


@contextmanager
def running(data: Path, *flags: str, hosts: str = "") -> Iterator[Product]:
    """A product that runs inside the block."""
    product = Product(data, *flags, hosts=hosts)
    try:
        product.start()
        yield product
    finally:
        if product.end() != 0:
            raise AssertionError(f"serve failed:\n{product.log.read_text()[-4000:]}")
