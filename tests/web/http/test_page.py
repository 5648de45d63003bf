"""The files of the page: what browsers are told of them, and where they say they lie."""

import asyncio
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
    told: list[Any] = []

    async def receive() -> Any:
        return {"type": "http.request"}

    async def send(message: Any) -> None:
        told.append(message)

    scope: Any = {"type": "http", "method": "GET", "path": path, "headers": []}
    asyncio.run(page(scope, receive, send))
    headers = {key.decode(): value.decode() for key, value in told[0]["headers"]}
    return told[0]["status"], headers, told[1]["body"].decode()


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
