"""A Postgres server for tests: its own cluster in a temporary folder, on loopback, never as root."""

import contextlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import psutil

from support.product import free_ports

_NOBODY: Final = 65534
_SETTINGS: Final = {
    "listen_addresses": "127.0.0.1",
    "unix_socket_directories": "",
    "max_connections": "100",
    "shared_buffers": "8MB",
    "fsync": "on",
    "synchronous_commit": "on",
}


def nobody() -> dict[str, Any]:
    """Return the arguments of a process that must not be root's."""
    root = os.geteuid() == 0
    return {"user": _NOBODY, "group": _NOBODY, "extra_groups": []} if root else {}


def environment(home: Path) -> dict[str, str]:
    """Return the environment of a process whose home is a folder of the test."""
    return {"PATH": os.environ["PATH"], "LC_ALL": "C", "HOME": str(home)}


def own_folder(prefix: str) -> Path:
    """Make a folder that such a process may write."""
    folder = Path(tempfile.mkdtemp(prefix=prefix))
    if os.geteuid() == 0:
        os.chown(folder, _NOBODY, _NOBODY)
    return folder


def binaries() -> Path | None:
    """Return the folder of Postgres's programs; None when it is not installed."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=_version)
    if found:
        return found[-1].parent
    on_path = shutil.which("initdb")
    return Path(on_path).resolve().parent if on_path else None


def _version(initdb: Path) -> float:
    return float(initdb.parent.parent.name)


class Server:
    """A cluster that can be started, stopped, and killed."""

    def __init__(self, folder: Path, bin_: Path) -> None:
        self._bin = bin_
        self._home = folder
        self._databases = 0
        self._data = folder / "data"
        self.port: int = free_ports()
        self.run("initdb", "-D", str(self._data), "-U", "aa", "-A", "trust", "-E", "UTF8",
                  "--locale=C", "--no-instructions", "--no-sync")  # fmt: skip
        lines = "".join(f"{name} = '{value}'\n" for name, value in _SETTINGS.items())
        with (self._data / "postgresql.conf").open("a") as file:
            file.write(f"{lines}port = {self.port}\n")

    def url(self, database: str, port: int | None = None) -> str:
        """Return the URL of a database of this server."""
        return f"postgresql://aa@127.0.0.1:{port or self.port}/{database}"

    def new_database(self) -> str:
        """The URL of an empty database."""
        self._databases += 1
        self.sql(f"CREATE DATABASE test_{self._databases}")
        return self.url(f"test_{self._databases}")

    def start(self) -> None:
        """Start, and wait until it answers."""
        self._ctl("start", "-l", str(self._home / "log"))

    def stop(self, mode: str = "immediate") -> None:
        """Stop; `immediate` is what a crash of the server is."""
        self._ctl("stop", "-m", mode)

    def processes(self) -> list[psutil.Process]:
        """Return all processes of this server, to be frozen or killed."""
        number = (self._data / "postmaster.pid").read_text().splitlines()[0]
        first = psutil.Process(int(number))
        return [first, *first.children(recursive=True)]

    def ask(self, text: str, database: str = "postgres") -> str:
        """Return what SQL answers."""
        return answer(self.port, text, database)

    def sql(self, text: str, database: str = "postgres") -> None:
        """Run SQL as the owner."""
        self.run("psql", "-q", "-v", "ON_ERROR_STOP=1", "-h", "127.0.0.1", "-p", str(self.port),
                  "-U", "aa", "-d", database, "-c", text)  # fmt: skip

    @property
    def binaries(self) -> Path:
        """The folder of this server's programs."""
        return self._bin

    @property
    def home(self) -> Path:
        """A folder that this server can read."""
        return self._home

    def load(self, dump: Path) -> str:
        """The URL of a new database with what a dump holds."""
        url = self.new_database()
        self.run("psql", "-q", "-v", "ON_ERROR_STOP=1", "-h", "127.0.0.1", "-p", str(self.port),
                  "-U", "aa", "-d", url.rpartition("/")[2], "-f", str(dump))  # fmt: skip
        return url

    def demand_password(self, role: str) -> None:
        """Let a role in by its password only; others need none."""
        rules = self._data / "pg_hba.conf"
        rules.write_text(f"host all {role} 127.0.0.1/32 scram-sha-256\n{rules.read_text()}")
        self._ctl("reload")

    def _ctl(self, command: str, *options: str) -> None:
        self.run("pg_ctl", command, "-w", "-s", "-t", "60", "-D", str(self._data), *options)

    def run(self, program: str, *arguments: str) -> None:
        """Run a program of Postgres as the user of this server."""
        subprocess.run(
            [str(self._bin / program), *arguments],
            check=True,
            cwd=self._home,
            env=environment(self._home),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            timeout=90,
            **nobody(),
        )


class Replica:
    """A server that copies another one, and can take over from it."""

    def __init__(self, primary: Server) -> None:
        self._primary = primary
        self._data = primary.home / "replica"
        self.port: int = free_ports()
        primary.run("pg_basebackup", "-D", str(self._data), "-R", "-h", "127.0.0.1",
                    "-p", str(primary.port), "-U", "aa", "-c", "fast")  # fmt: skip
        with (self._data / "postgresql.conf").open("a") as file:
            file.write(f"port = {self.port}\n")
        self._ctl("start", "-l", str(primary.home / "replica.log"))

    def ask(self, text: str, database: str = "postgres") -> str:
        """Return what SQL answers."""
        return answer(self.port, text, database)

    def promote(self) -> None:
        """Let it take over."""
        self._ctl("promote")

    def freeze(self) -> None:
        """Freeze all its processes."""
        for each in self._processes():
            each.suspend()

    def thaw(self) -> None:
        """Let all its processes go on."""
        for each in self._processes():
            each.resume()

    def stop(self) -> None:
        """Stop it at once."""
        self.thaw()
        self._ctl("stop", "-m", "immediate")

    def _processes(self) -> list[psutil.Process]:
        number = (self._data / "postmaster.pid").read_text().splitlines()[0]
        first = psutil.Process(int(number))
        return [first, *first.children(recursive=True)]

    def _ctl(self, command: str, *options: str) -> None:
        self._primary.run(
            "pg_ctl", command, "-w", "-s", "-t", "60", "-D", str(self._data), *options
        )


def answer(port: int, text: str, database: str = "postgres") -> str:
    """Return what the server at a port answers to SQL."""
    bin_ = binaries()
    assert bin_ is not None
    where = ["-h", "127.0.0.1", "-p", str(port), "-U", "aa", "-d", database]
    return subprocess.run(
        [str(bin_ / "psql"), "-qAt", "-v", "ON_ERROR_STOP=1", *where, "-c", text],
        check=True,
        capture_output=True,
        text=True,
        timeout=60,
    ).stdout.strip()


@contextlib.contextmanager
def server() -> Iterator[Server]:
    """A server that runs, and is gone afterwards."""
    bin_ = binaries()
    assert bin_ is not None
    folder = own_folder("aa-postgres-")
    try:
        one = Server(folder, bin_)
        one.start()
        try:
            yield one
        finally:
            with contextlib.suppress(subprocess.CalledProcessError):
                one.stop()  # may be stopped already
    finally:
        shutil.rmtree(folder)
