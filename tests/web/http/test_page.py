"""The files of the page: what browsers are told of them, and where they say they lie."""

import asyncio
import gzip
from pathlib import Path
from typing import Any

import pytest

from action_assistant.web.http.static_files import Page


async def _nobody(scope: Any, receive: Any, send: Any) -> None:
    await send({"type": "http.response.start", "status": 404, "headers": []})
    await send({"type": "http.response.body", "body": b""})


@pytest.fixture
def page(tmp_path: Path) -> Page:
    """A page as the build writes it, below a path that a proxy gave it."""
    (tmp_path / "index.html").write_text(
        '<meta name="root" content="./"><link rel="manifest" href="./manifest.webmanifest">'
    )
    (tmp_path / "manifest.webmanifest").write_text('{"start_url": "./"}')
    (tmp_path / "service-worker.js").write_text("1;")
    (tmp_path / "assets").mkdir()
    (tmp_path / "assets" / "index-abc.js").write_text("2;")
    (tmp_path / ".vite").mkdir()
    (tmp_path / ".vite" / "manifest.json").write_text("{}")
    return Page(_nobody, tmp_path, lambda _: "/temoto")


def asked(page: Page, path: str) -> tuple[int, dict[str, str], str]:
    """Status, headers and body."""
    status, headers, body = _sent(page, path, [])
    return status, headers, body.decode()


def answered(page: Page, path: str, accepted: str) -> tuple[dict[str, str], bytes]:
    """Headers and body for a browser that accepts these encodings."""
    return _sent(page, path, [(b"accept-encoding", accepted.encode())])[1:]


def _sent(
    page: Page, path: str, asking: list[tuple[bytes, bytes]]
) -> tuple[int, dict[str, str], bytes]:
    told: list[Any] = []

    async def receive() -> Any:
        return {"type": "http.request"}

    async def send(message: Any) -> None:
        told.append(message)

    scope: Any = {"type": "http", "method": "GET", "path": path, "headers": asking}
    asyncio.run(page(scope, receive, send))
    headers = {key.decode(): value.decode() for key, value in told[0]["headers"]}
    return told[0]["status"], headers, told[1]["body"]


def test_the_page_can_be_installed_below_a_path_of_a_proxy(page: Page) -> None:
    assert 'href="/temoto/manifest.webmanifest"' in asked(page, "/")[2]
    _, headers, body = asked(page, "/manifest.webmanifest")
    assert headers["content-type"] == "application/manifest+json"
    assert body == '{"start_url": "./"}'  # seen from where the manifest lies


def test_a_browser_asks_each_time_whether_the_worker_is_another(page: Page) -> None:
    _, headers, _ = asked(page, "/service-worker.js")
    assert headers["cache-control"] == "no-cache"
    assert "javascript" in headers["content-type"]
    assert "immutable" in asked(page, "/assets/index-abc.js")[1]["cache-control"]


def test_the_manifest_of_the_build_is_not_served(page: Page) -> None:
    assert not page.knows("/.vite/manifest.json", accepts_html=False)
    assert asked(page, "/.vite/manifest.json")[0] == 404


@pytest.mark.parametrize(
    ("accepted", "encoding"),
    [
        ("gzip, deflate, br, zstd", "br"),
        ("br;q=0, gzip", "gzip"),
        ("gzip", "gzip"),
        ("br ; q=0.000", ""),
        ("brotli, x-gzip", ""),
        ("", ""),
    ],
)
def test_a_script_is_sent_in_the_shortest_form_that_the_browser_reads(
    tmp_path: Path, accepted: str, encoding: str
) -> None:
    script = b"let a = 1;" * 200
    bodies = {"br": b"compressed by the build", "gzip": gzip.compress(script, mtime=0), "": script}
    (tmp_path / "assets").mkdir()
    (tmp_path / "assets" / "index-abc.js").write_bytes(script)
    (tmp_path / "assets" / "index-abc.js.br").write_bytes(bodies["br"])
    (tmp_path / "index.html").write_text("<p>")
    page = Page(_nobody, tmp_path)
    headers, body = answered(page, "/assets/index-abc.js", accepted)
    assert headers.get("content-encoding", "") == encoding
    assert body == bodies[encoding]
    assert headers["content-length"] == str(len(body))
    assert headers["vary"] == "accept-encoding"
    assert "immutable" in headers["cache-control"]
    assert not page.knows("/assets/index-abc.js.br", accepts_html=False)


def test_styles_and_fonts_have_a_policy_of_their_own_by_which_they_load_nothing(
    page: Page, tmp_path: Path
) -> None:
    for name in ("page-abc.css", "inter-abc.woff2"):
        (tmp_path / "assets" / name).write_text("x")
    (tmp_path / "index.html").touch()
    shown = Page(_nobody, tmp_path)
    for name in ("page-abc.css", "inter-abc.woff2"):
        policy = asked(shown, f"/assets/{name}")[1]["content-security-policy"]
        assert policy == "default-src 'none'; frame-ancestors 'none'"
    # A script may be that of a worker, to which its policy applies: it has that of the page.
    assert "content-security-policy" not in asked(shown, "/assets/index-abc.js")[1]
