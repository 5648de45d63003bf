"""A real browser at a page of somebody else, whose name points to this computer (DNS rebinding)."""

import html
import json
import shutil
import subprocess
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, Final

import pytest

from support.product import TOKEN, Product, running

CHROMIUM: Final = next(
    filter(None, map(shutil.which, ("chromium-headless-shell", "chromium"))), None
)
EVIL: Final = "evil.test"

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A running editor and runner."""
    with running(tmp_path_factory.mktemp("rebinding") / "data") as found:
        yield found


def shown(url: str, folder: Path) -> str:
    """Return what a browser shows at a URL, for which `evil.test` is this computer."""
    assert CHROMIUM is not None
    done = subprocess.run(
        [
            *(CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--no-proxy-server"),
            *(f"--user-data-dir={folder}", f"--host-resolver-rules=MAP {EVIL} 127.0.0.1"),
            *("--virtual-time-budget=8000", "--timeout=15000", "--dump-dom", url),
        ],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    return done.stdout


def attacker(product: Product) -> ThreadingHTTPServer:
    """Return a server of somebody else whose page asks this server everything it can, by its own name
    and by the right one, and shows what it could read."""
    asked = [
        [f"http://{host}:{port}{path}", method]
        for host in (EVIL, "127.0.0.1", "localhost")
        for port, path, method in (
            (product.port, "/api/graphs", "GET"),
            (product.port, "/api/session", "GET"),
            (product.port, "/api/graphs", "POST"),
            (product.port + 1, "/api/robots", "GET"),
            (product.port + 1, "/api/stop", "POST"),
        )
    ]
    script = """
      const found = [];
      for (const [url, method] of ASKED) {
        try {
          const answer = await fetch(url, {method, credentials: "include"});
          found.push([url, method, answer.status, (await answer.text()).slice(0, 200)]);
        } catch (error) { found.push([url, method, "blocked"]); }
      }
      document.body.textContent = "FOUND" + JSON.stringify(found) + "END";
    """.replace("ASKED", json.dumps(asked))
    page = f"<body></body><script type=module>{script}</script>".encode()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("content-type", "text/html")
            # Cookies know no ports: it can plant one for this server.
            self.send_header("set-cookie", f"aa_{product.port}={TOKEN}; path=/")
            self.end_headers()
            self.wfile.write(page)

        def log_message(self, *_: Any) -> None:
            """Write nothing."""

    return ThreadingHTTPServer(("127.0.0.1", 0), Handler)


def test_a_name_that_points_here_shows_nothing_and_its_page_reads_nothing(
    product: Product, tmp_path: Path
) -> None:
    there = shown(f"http://{EVIL}:{product.port}/", tmp_path / "one")
    assert "This server is not called" in there
    assert "<script" not in there
    server = attacker(product)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        dom = shown(f"http://{EVIL}:{server.server_address[1]}/", tmp_path / "two")
    finally:
        server.shutdown()
        server.server_close()
    found = json.loads(html.unescape(dom.partition("FOUND")[2].partition("END")[0]))
    assert len(found) == 15
    assert [each for each in found if each[2] != "blocked"] == []
    with product.editor() as editor, product.runner() as runner:
        names = [each["name"] for each in editor.get("/api/graphs").json()]
        assert len(names) == len(set(names))
        assert runner.get("/api/runs").json() == []
