"""Three editors as docker-compose.yml starts them, behind its proxy, without containers: each takes an address of its
own, and what a killed one had open is changed at another one."""

import contextlib
import os
import re
import shutil
import socket
import ssl
import subprocess
import sys
from functools import partial
from pathlib import Path

import httpx
import pytest
import yaml

from editor.process import BEARER
from journal.servers import Server
from support.product import TOKEN, free_ports
from support.waiting import until

ROOT = Path(__file__).parents[3]
CADDY = shutil.which("caddy", path=f"{os.environ['PATH']}:/usr/local/bin") or ""
COUNT = 3

pytestmark = pytest.mark.skipif(not CADDY, reason="caddy is not installed")


class Installation:
    """The services `editor` and `proxy`, as processes of this machine."""

    def __init__(self, folder: Path, database: str) -> None:
        self._folder = folder
        self._port = _port_of_editors()
        self._public = free_ports()
        self.url = f"https://localhost:{self._public}"
        (folder / "data").mkdir()
        self._env = {
            **os.environ,
            "EDITORS": str(COUNT),
            "ACTION_ASSISTANT_DATA": str(folder / "data"),
            "ACTION_ASSISTANT_DATABASE": database,
            "ACTION_ASSISTANT_PORT": str(self._port),
            "ACTION_ASSISTANT_PUBLIC_URL": self.url,
            "ACTION_ASSISTANT_TOKEN": TOKEN,
        }

    def _image(self, number: int) -> Path:
        """Return what an image does, with a folder /tmp of its own."""
        own = self._folder / f"tmp-{number}"
        own.mkdir(exist_ok=True)
        script = (ROOT / "scripts" / "image").read_text()
        program = "/opt/action-assistant/bin/action-assistant"
        assert program in script
        script = script.replace("/tmp/", f"{own}/")  # first: the interpreter may be in /tmp, too
        (own / "image").write_text(script.replace(program, f"{sys.executable} -m action_assistant"))
        return own / "image"

    def begin(self, number: int) -> "subprocess.Popen[bytes]":
        """Start one editor."""
        with self._log(number).open("wb") as log:
            words = ["sh", str(self._image(number)), "run", "editor"]
            return subprocess.Popen(words, env=self._env, stdout=log, stderr=log)

    def _log(self, number: int) -> Path:
        return self._folder / f"editor-{number}.log"

    def log(self, number: int) -> str:
        """Return what an editor has written."""
        return self._log(number).read_text()

    def is_healthy(self, number: int) -> bool:
        """Return whether an editor says that it is ready, as its health check asks."""
        words = ["sh", str(self._image(number)), "healthy", "editor"]
        return (
            subprocess.run(words, env=self._env, capture_output=True, check=False).returncode == 0
        )

    def address(self, number: int) -> str:
        """Return the address that an editor has taken."""
        return (self._folder / f"tmp-{number}" / "editor-address").read_text().strip()

    def proxy(self) -> "subprocess.Popen[bytes]":
        """Start the proxy."""
        service = yaml.safe_load((ROOT / "docker-compose.yml").read_text())["services"]["proxy"]
        text = (ROOT / "docs" / "proxy" / "compose.Caddyfile").read_text()
        file = self._folder / "Caddyfile"
        file.write_text(text.replace("admin off", f"admin off\n\thttp_port {self._public + 1}"))
        command = (
            service["command"][-1].replace("$$", "$").replace("/etc/caddy/Caddyfile", str(file))
        )
        command = re.sub(r"\bcaddy run", f"{CADDY} run", command)
        env = {
            name: re.sub(r"\$\{\w+:-(.*)\}", r"\1", str(value))
            for name, value in service["environment"].items()
        }
        env |= {"PUBLIC_URL": self.url, "EDITORS": str(COUNT), "EDITOR_PORT": str(self._port)}
        env |= {"XDG_DATA_HOME": str(self._folder), "XDG_CONFIG_HOME": str(self._folder)}
        with (self._folder / "proxy.log").open("wb") as log:
            return subprocess.Popen(
                ["sh", "-c", command], env={**os.environ, **env}, stdout=log, stderr=log
            )

    def trust(self) -> ssl.SSLContext:
        """Return what trusts the proxy's own authority, once there is one."""
        root = self._folder / "caddy/pki/authorities/local/root.crt"
        until("Caddy made its certificate", root.exists, 120)
        return ssl.create_default_context(cafile=str(root))


def _port_of_editors() -> int:
    """Return a port that is free, as that for other editors is, which is 400 above it."""
    while True:
        port = free_ports()
        with socket.socket() as beside, contextlib.suppress(OSError):
            beside.bind(("127.0.0.1", port + 400))
            return port


@pytest.mark.timeout(300)
def test_a_killed_editor_of_three_is_not_missed_behind_the_proxy_of_compose(
    tmp_path: Path, postgres: Server
) -> None:
    installation = Installation(tmp_path, postgres.new_database())
    with contextlib.ExitStack() as stack:

        def kept(process: "subprocess.Popen[bytes]") -> "subprocess.Popen[bytes]":
            stack.callback(process.wait)
            stack.callback(process.kill)
            return process

        editors = [kept(installation.begin(number)) for number in range(COUNT)]
        for number, process in enumerate(editors):
            has_begun = partial(_has_begun, installation, number, process)
            until(f"editor {number} has begun", has_begun, 120)
            assert process.poll() is None, installation.log(number)
        assert {installation.address(n) for n in range(COUNT)} == {
            "127.0.0.1",
            "127.0.0.2",
            "127.0.0.3",
        }
        kept(installation.proxy())
        with httpx.Client(
            base_url=installation.url,
            headers=BEARER,
            verify=installation.trust(),
            trust_env=False,
            timeout=30,
        ) as page:

            def answers() -> bool:
                with contextlib.suppress(httpx.TransportError):
                    return page.get("/api/graphs").is_success
                return False

            until("the proxy answers", answers, 120)
            graphs = [
                page.post("/api/graphs", json={"name": f"g{n}"}).json()["id"] for n in range(9)
            ]
            for graph in graphs:
                assert page.patch(f"/api/graphs/{graph}", json={"description": "before"}).is_success
            editors[_first(installation)].kill()
            for graph in graphs:
                until("a graph is renamed", partial(_renamed, page, graph), 120)
            assert {page.get(f"/api/graphs/{graph}").json()["name"] for graph in graphs} == {
                "after"
            }


def _has_begun(installation: Installation, number: int, process: "subprocess.Popen[bytes]") -> bool:
    """Return whether an editor is ready, or has ended."""
    return process.poll() is not None or installation.is_healthy(number)


def _renamed(page: httpx.Client, graph: str) -> bool:
    return page.patch(f"/api/graphs/{graph}", json={"name": "after"}).is_success


def _first(installation: Installation) -> int:
    """Return which editor has the first address, to which all but graphs goes."""
    return next(n for n in range(COUNT) if installation.address(n) == "127.0.0.1")
