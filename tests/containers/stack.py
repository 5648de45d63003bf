"""docker-compose.yml, driven by podman-compose in a folder as people have it after cloning."""

import json
import os
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

import httpx

from containers.engine import FOLDER, ROOT, environment, inspect, podman, run

PROJECT: Final = "temoto-action-assistant"
PROFILES: Final = ("simulator", "robot", "proxy", "backups")
#: Services whose `ipc: host` podman-compose does not read, so it is passed to podman.
_WITH_ROBOTS: Final = frozenset({"runner", "robot"})
_WITHOUT_HEALTH_CHECK: Final = frozenset({"robot", "proxy", "backups"})
_PATIENCE_S: Final = 120.0


class Stack:
    """Services of one compose file. `settings` are what people write into .env."""

    def __init__(self, folder: Path, settings: dict[str, str], more: str = "") -> None:
        self.folder = folder
        folder.mkdir(parents=True)
        for name in ("docker-compose.yml", "docs/proxy/compose.Caddyfile"):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
        if settings:
            lines = [f"{name}={value}" for name, value in settings.items()]
            (folder / ".env").write_text("\n".join([*lines, ""]))
        self._files = ["docker-compose.yml"]
        if more:
            (folder / "docker-compose.override.yml").write_text(more)
            self._files.append("docker-compose.override.yml")

    def compose(
        self, *words: str, podman_run: str = "", **more: Any
    ) -> "subprocess.CompletedProcess[str]":
        """`docker compose …`, of all profiles."""
        files = [word for name in self._files for word in ("--file", name)]
        profiles = [word for name in PROFILES for word in ("--profile", name)]
        also = [f"--podman-run-args={podman_run}"] if podman_run else []
        return run("podman-compose", *also, *files, *profiles, *words, cwd=self.folder, **more)

    def up(self, *services: str) -> None:
        """Start them, and wait until they are ready."""
        with health_checks():
            robots = [each for each in services if each in _WITH_ROBOTS]
            others = [each for each in services if each not in _WITH_ROBOTS]
            for some, run_with in ((others, ""), (robots, "--ipc=host")):
                if some:
                    self.compose("up", "--detach", "--no-build", *some, podman_run=run_with)
            for service in services:
                if service not in _WITHOUT_HEALTH_CHECK:
                    self.wait(service)

    def wait(self, service: str, number: int = 1) -> None:
        """Wait until the health check of a service succeeds."""
        deadline = time.monotonic() + _PATIENCE_S
        while not self.is_healthy(service, number):
            if time.monotonic() > deadline:
                raise AssertionError(f"{service} is not healthy:\n{self.log(service)}")
            time.sleep(0.5)

    def is_healthy(self, service: str, number: int = 1) -> bool:
        """Run the health check of a service, and return whether it succeeds."""
        name = self.container(service, number)
        return run("podman", "healthcheck", "run", name, check=False).returncode == 0

    def container(self, service: str, number: int = 1) -> str:
        """Its name. `number`: which of several, from 1."""
        return f"{PROJECT}_{service}_{number}"

    def execute(self, service: str, *words: str) -> "subprocess.CompletedProcess[str]":
        """`docker compose exec SERVICE …`, whatever it answers."""
        return run("podman", "exec", self.container(service), *words, check=False)

    def said(self, service: str, *words: str) -> str:
        """Return the output of one of our commands in a container, which has to succeed."""
        answer = self.execute(service, "action-assistant", *words)
        assert answer.returncode == 0, (
            f"{words}: {answer.returncode} {answer.stdout}{answer.stderr}"
        )
        return answer.stdout

    def token(self, service: str = "editor") -> str:
        """Return the owner's token from the printed link."""
        return self.said(service, "link").split()[0].partition("#t=")[2]

    def log(self, service: str) -> str:
        """The end of what it said."""
        answer = run("podman", "logs", "--tail", "12", self.container(service), check=False)
        return answer.stdout + answer.stderr

    def processes(self, service: str) -> list[tuple[int, str]]:
        """Return the processes of a container, by the machine's process ids, with their
        arguments."""
        top = podman("top", self.container(service), "hpid", "args").splitlines()[1:]
        return [(int(line.split(None, 1)[0]), line.split(None, 1)[1]) for line in top]

    def kill(self, service: str) -> None:
        """kill -9 of the process of ours, past the engine, as the machine kills when memory ends."""
        own = [
            pid for pid, words in self.processes(service) if f"action-assistant {service}" in words
        ]
        assert own, self.processes(service)
        for pid in own:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    def down(self, *, volumes: bool = True) -> None:
        """End it; with what it kept."""
        self.compose("down", check=False)
        if volumes:  # podman-compose leaves one that several services share
            podman("volume", "rm", "--all", "--force")


@contextmanager
def health_checks() -> Iterator[None]:
    """Ask every container for its health each second, as systemd's timers do elsewhere."""
    done = threading.Event()

    def ask() -> None:
        while not done.wait(1.0):
            for name in podman("ps", "--format", "{{.Names}}").split():
                run("podman", "healthcheck", "run", name, check=False)

    asking = threading.Thread(target=ask, daemon=True)
    asking.start()
    try:
        yield
    finally:
        done.set()
        asking.join()


@contextmanager
def running(
    name: str, *services: str, settings: dict[str, str] | None = None, more: str = ""
) -> Iterator[Stack]:
    """These services, in a project folder of their own; nothing of them is there afterwards."""
    folder = FOLDER / "projects" / name
    shutil.rmtree(folder, ignore_errors=True)
    stack = Stack(folder, settings or {}, more)
    stack.down()
    try:
        stack.up(*services)
        yield stack
    finally:
        stack.down()


def state(name: str) -> dict[str, Any]:
    """Return the state of a container."""
    return dict(inspect(name, "container"))


def client(url: str, token: str, **more: Any) -> httpx.Client:
    """A program with the token."""
    headers = {"authorization": f"Bearer {token}"}
    return httpx.Client(base_url=url, headers=headers, trust_env=False, timeout=30, **more)


def command(
    words: list[str], url: str, token: str, **more: str
) -> "subprocess.CompletedProcess[str]":
    """Our command line, from the machine, against an address."""
    program = str(ROOT / ".venv" / "bin" / "action-assistant")
    return subprocess.run(
        [program, *words, "--server", url],
        env=environment() | {"ACTION_ASSISTANT_TOKEN": token} | more,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def findings(text: str) -> dict[str, str]:
    """Return the errors of `doctor --json`, by code."""
    return {
        each["code"]: each["message"] for each in json.loads(text) if each["severity"] == "error"
    }
