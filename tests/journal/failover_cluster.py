"""Two Postgres servers under Patroni, with etcd: a cluster that fails over, on loopback, never as root."""

import contextlib
import json
import shutil
import signal
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import psutil

from journal import servers
from support.product import free_ports

NODES: Final = ("one", "two")
_SCOPE: Final = "lab"
#: Patroni's times in seconds. Its own defaults are 30, 10 and 10; these make a test shorter.
_TIMES: Final = {"ttl": 8, "loop_wait": 1, "retry_timeout": 3}


def are_installed() -> bool:
    """Return whether Patroni, etcd and Postgres can be run."""
    return all(map(shutil.which, ("patroni", "etcd"))) and servers.binaries() is not None


class Node:
    """One Postgres server with the Patroni that leads it. `port`: that of Postgres; `rest`: the
    address at which Patroni answers."""

    def __init__(self, home: Path, name: str, etcd: int) -> None:
        self.name: Final = name
        self.port: Final = free_ports()
        self._home: Final = home
        self._rest_port: Final = free_ports()
        self.rest: Final = f"http://127.0.0.1:{self._rest_port}"
        self._patroni: subprocess.Popen[bytes] | None = None
        bin_ = servers.binaries()
        assert bin_ is not None
        access = {"username": "aa", "password": "aa"}
        settings = {
            "scope": _SCOPE,
            "name": name,
            "etcd3": {"host": f"127.0.0.1:{etcd}"},
            "restapi": {
                "listen": f"127.0.0.1:{self._rest_port}",
                "connect_address": f"127.0.0.1:{self._rest_port}",
            },
            "bootstrap": {
                "dcs": {**_TIMES, "synchronous_mode": True, "postgresql": {"use_pg_rewind": True}},
                "initdb": [{"encoding": "UTF8"}, {"locale": "C"}, "data-checksums", "no-sync"],
            },
            "postgresql": {
                "listen": f"127.0.0.1:{self.port}",
                "connect_address": f"127.0.0.1:{self.port}",
                "data_dir": str(home / name),
                "bin_dir": str(bin_),
                "pgpass": str(home / f"{name}.pgpass"),
                "authentication": dict.fromkeys(("superuser", "replication", "rewind"), access),
                "pg_hba": [
                    "host all all 127.0.0.1/32 trust",
                    "host replication all 127.0.0.1/32 trust",
                ],
                "parameters": {
                    "max_connections": 50,
                    "shared_buffers": "8MB",
                    "unix_socket_directories": "",
                    "wal_keep_size": "256MB",
                },
            },
        }
        self._file: Final = home / f"{name}.json"  # JSON is YAML
        self._file.write_text(json.dumps(settings))

    def start(self) -> None:
        """Start Patroni, which starts Postgres or makes it a copy of the primary."""
        with (self._home / f"{self.name}.log").open("ab") as log:
            self._patroni = _run(["patroni", str(self._file)], self._home, log)

    def processes(self) -> list[psutil.Process]:
        """Return the processes of Patroni and Postgres on this node."""
        found = []
        if self._patroni is not None and self._patroni.poll() is None:
            patroni = psutil.Process(self._patroni.pid)
            found += [patroni, *patroni.children(recursive=True)]
        with contextlib.suppress(OSError, psutil.NoSuchProcess, ValueError):
            number = (self._home / self.name / "postmaster.pid").read_text().splitlines()[0]
            first = psutil.Process(int(number))
            found += [first, *first.children(recursive=True)]
        return found

    def freeze_patroni(self) -> None:
        """Freeze Patroni on this node, and nothing else: it changes no settings of Postgres any more,
        and loses its place as leader."""
        assert self._patroni is not None
        self._patroni.send_signal(signal.SIGSTOP)

    def signal(self, number: signal.Signals) -> None:
        """Send a signal to every process of this node."""
        for each in self.processes():
            with contextlib.suppress(psutil.NoSuchProcess):
                each.send_signal(number)

    def kill(self) -> None:
        """End the node as if its computer had lost its power."""
        self.signal(signal.SIGSTOP)  # so that none is restarted by another meanwhile
        self.signal(signal.SIGKILL)
        if self._patroni is not None:
            self._patroni.wait()

    def state(self) -> dict[str, Any]:
        """Return what Patroni says of this node; empty if it does not answer."""
        return _asked(f"{self.rest}/patroni") or {}


class Cluster:
    """A primary and a synchronous replica, and the etcd that keeps who is the primary."""

    def __init__(self, home: Path) -> None:
        self.home: Final = home
        self._etcd_port: Final = free_ports()
        self.nodes: Final = tuple(Node(home, name, self._etcd_port) for name in NODES)
        self._etcd: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start everything, and wait for a primary with a synchronous replica."""
        client = f"http://127.0.0.1:{self._etcd_port}"
        peer = f"http://127.0.0.1:{free_ports()}"
        with (self.home / "etcd.log").open("ab") as log:
            self._etcd = _run(
                [
                    "etcd",
                    "--data-dir",
                    str(self.home / "etcd"),
                    "--unsafe-no-fsync",
                    "--listen-client-urls",
                    client,
                    "--advertise-client-urls",
                    client,
                    "--listen-peer-urls",
                    peer,
                    "--initial-advertise-peer-urls",
                    peer,
                    "--initial-cluster",
                    f"default={peer}",
                ],
                self.home,
                log,
            )
        self.nodes[0].start()
        self.primary()
        self.nodes[1].start()
        self.wait_for_replica()

    def close(self) -> None:
        """End every process."""
        for node in self.nodes:
            node.signal(signal.SIGCONT)
            node.kill()
        if self._etcd is not None:
            self._etcd.kill()
            self._etcd.wait()

    @property
    def rest(self) -> list[str]:
        """Return the addresses at which Patroni answers."""
        return [node.rest for node in self.nodes]

    def url(self, database: str) -> str:
        """Return the URL of a database on whichever node is the primary."""
        hosts = "&".join(f"host=127.0.0.1:{node.port}" for node in self.nodes)
        return f"postgresql://aa@/{database}?{hosts}"

    def new_database(self, name: str) -> str:
        """Create a database, and return its URL."""
        self.sql(f"CREATE DATABASE {name}")
        return self.url(name)

    def sql(self, text: str, database: str = "postgres", node: Node | None = None) -> str:
        """Run SQL on a node, or else on the primary, and return what it prints."""
        return servers.answer((node or self.primary()).port, text, database)

    def configure(self, **settings: Any) -> None:
        """Change Patroni's settings of the whole cluster; None removes one."""
        request = urllib.request.Request(
            f"{self.primary().rest}/config", json.dumps(settings).encode(), method="PATCH"
        )
        urllib.request.urlopen(request, timeout=10).close()

    def primary(self, but: Node | None = None) -> Node:
        """Return the primary that is not `but`, as soon as there is one."""
        until = time.monotonic() + 60
        while time.monotonic() < until:
            for node in self.nodes:
                state = node.state() if node is not but else {}
                if state.get("role") in {"master", "primary"} and state.get("state") == "running":
                    return node
            time.sleep(0.1)
        raise AssertionError(f"no primary: {self.said()}")

    def wait_for_replica(self) -> None:
        """Wait until Patroni would promote a replica, and every commit waits for that one."""
        until = time.monotonic() + 90
        while not any(
            each.get("role") == "sync_standby"
            for each in (_asked(f"{self.primary().rest}/cluster") or {}).get("members", [])
        ):
            assert time.monotonic() < until, self.said()
            time.sleep(0.2)

    def said(self) -> str:
        """Return the ends of the logs."""
        return "\n".join(path.read_text()[-3000:] for path in sorted(self.home.glob("*.log")))


@contextlib.contextmanager
def cluster() -> Iterator[Cluster]:
    """A cluster that runs, and is gone afterwards."""
    home = servers.own_folder("aa-cluster-")
    one = Cluster(home)
    try:
        one.start()
        yield one
    finally:
        one.close()
        shutil.rmtree(home)


def _run(command: list[str], home: Path, log: Any) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        command,
        cwd=home,
        env=servers.environment(home),
        stdin=subprocess.DEVNULL,
        stdout=log,
        stderr=log,
        **servers.nobody(),
    )


def _asked(url: str) -> dict[str, Any] | None:
    try:
        with urllib.request.urlopen(url, timeout=2) as answer:
            found: dict[str, Any] = json.load(answer)
            return found
    except urllib.error.HTTPError as error:
        with contextlib.suppress(ValueError):
            return json.load(error)
        return None
    except (OSError, ValueError):
        return None
