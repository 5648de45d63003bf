"""Through the documented nginx, with TLS and below a path: what programs and the command line do."""

import json
import ssl
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from support.command_line import ran
from support.product import TOKEN, Product, free_ports, running
from support.proxy import NGINX, nginx

pytestmark = pytest.mark.skipif(not NGINX, reason="nginx is not installed")

NAME = "localhost"
BEARER = {"authorization": f"Bearer {TOKEN}"}
GRAPH = {
    "graph_name": "pair",
    "graph_entry": [{"name": "A"}],
    "graph_exit": [{"name": "A"}],
    "actions": [{"name": "A", "type": "sync"}],
}


class Proxied:
    """A product with nginx before it."""

    def __init__(self, product: Product, url: str, chain: Path) -> None:
        self.product = product
        self.url = url
        self.trust = ssl.create_default_context(cafile=str(chain))
        self._chain = chain

    def cli(self, *words: str) -> "subprocess.CompletedProcess[str]":
        """A command against the public address."""
        environment = {**self.product.environment, "SSL_CERT_FILE": str(self._chain)}
        environment.pop("ACTION_ASSISTANT_URL")
        return ran(*words, environ=environment)

    def ask(self, path: str, method: str = "GET", **more: Any) -> httpx.Response:
        """A request below the public address."""
        headers = {**BEARER, **more.pop("headers", {})}
        with httpx.Client(verify=self.trust, trust_env=False, timeout=20) as client:
            return client.request(method, self.url + path, headers=headers, **more)


@pytest.fixture(scope="module")
def proxied(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Proxied]:
    folder = tmp_path_factory.mktemp("proxied")
    port = free_ports()
    url = f"https://{NAME}:{port}/temoto"
    with (
        running(folder / "data", "--public-url", f"{url}/") as product,
        nginx(folder / "proxy", name=NAME, port=port, editor=product.port) as chain,
    ):
        yield Proxied(product, url, chain)


@pytest.mark.long
def test_a_command_needs_nothing_but_the_public_address(proxied: Proxied, tmp_path: Path) -> None:
    file = tmp_path / "pair.json"
    file.write_text(json.dumps(GRAPH))
    server = ("--server", f"{proxied.url}/")
    made = proxied.cli("import", str(file), *server)
    assert made.returncode == 0, made.stderr
    assert "pair" in proxied.cli("graphs", *server).stdout
    ran = proxied.cli("run", "pair", *server)
    assert ran.returncode == 0, ran.stderr
    assert "finished" in proxied.cli("runs", "--url", proxied.url).stdout
    assert proxied.cli("stop", "--all", *server).returncode == 0


@pytest.mark.long
def test_a_path_reaches_the_runner_as_it_was_written(proxied: Proxied) -> None:
    direct = proxied.product.runner()
    with direct:
        for path in ("/api/runs/a%2Fb", "/api/runs/a%20b", "/api/robots/a%2Fb"):
            here, there = proxied.ask(f"/runner{path}"), direct.get(path)
            said = [{**each.json(), "request_id": ""} for each in (here, there)]
            assert (here.status_code, said[0]) == (there.status_code, said[1])


def test_sockets_and_events_pass(proxied: Proxied) -> None:
    url = proxied.url.replace("https", "wss")
    with connect(f"{url}/runner/api/live", ssl=proxied.trust, additional_headers=BEARER) as live:
        assert json.loads(live.recv(10))["type"] == "hello"
    with pytest.raises(InvalidStatus) as refused:
        connect(f"{url}/runner/api/live", ssl=proxied.trust)
    assert refused.value.response.status_code == 401
    with (
        httpx.Client(verify=proxied.trust, trust_env=False, timeout=20) as client,
        client.stream("GET", f"{proxied.url}/api/events?after=0", headers=BEARER) as stream,
    ):
        assert next(stream.iter_lines()) != ""


def test_a_large_file_passes_and_one_that_is_too_large_is_refused_by_us(proxied: Proxied) -> None:
    large = {**GRAPH, "graph_description": "x" * 3_000_000}
    text = json.dumps(large)
    answer = proxied.ask(
        "/api/graphs?preview=true",
        "POST",
        content=text,
        headers={"content-type": "application/json"},
    )
    assert answer.status_code < 500
    assert answer.headers["content-type"].endswith("json")
