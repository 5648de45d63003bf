"""The documentation below /help/: for strangers, under a policy of its own, honest where it is missing."""

import asyncio
import os
from pathlib import Path
from typing import Any

import pytest

from action_assistant.web.http.static_files import HelpSite


async def _nobody(scope: Any, receive: Any, send: Any) -> None:
    await send({"type": "http.response.start", "status": 418, "headers": []})
    await send({"type": "http.response.body", "body": b"not the help"})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A small site, as the build writes it."""
    (tmp_path / "index.html").write_text("<h1>Help</h1>")
    (tmp_path / "_static").mkdir()
    (tmp_path / "_static" / "site.css").write_text("a { color: red }" * 100)
    (tmp_path.parent / "secret.txt").write_text("not for the network")
    return tmp_path


def asked(
    site: HelpSite, path: str, method: str = "GET", **headers: str
) -> tuple[int, dict[str, str], str]:
    """Status, headers and body."""
    told: list[Any] = []

    async def receive() -> Any:
        return {"type": "http.request"}

    async def send(message: Any) -> None:
        told.append(message)

    given = [(name.replace("_", "-").encode(), text.encode()) for name, text in headers.items()]
    scope: Any = {"type": "http", "method": method, "path": path, "headers": given}
    asyncio.run(site(scope, receive, send))
    fields = {key.decode(): value.decode() for key, value in told[0]["headers"]}
    return told[0]["status"], fields, told[1]["body"].decode(errors="replace")


def test_a_page_has_a_policy_that_lets_nothing_inline_and_nothing_else_in(folder: Path) -> None:
    status, headers, body = asked(HelpSite(_nobody, folder), "/help/")
    assert (status, body) == (200, "<h1>Help</h1>")
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert headers["content-type"] == "text/html; charset=utf-8"


def test_a_browser_asks_whether_it_changed_and_gets_it_only_then(folder: Path) -> None:
    site = HelpSite(_nobody, folder)
    _, headers, _ = asked(site, "/help/_static/site.css")
    assert headers["cache-control"] == "no-cache"
    status, _, body = asked(site, "/help/_static/site.css", if_none_match=headers["etag"])
    assert (status, body) == (304, "")
    assert asked(site, "/help/_static/site.css", accept_encoding="gzip")[1]["content-encoding"]


def test_without_its_slash_it_leads_there_below_whatever_path(folder: Path) -> None:
    status, headers, _ = asked(HelpSite(_nobody, folder), "/help")
    assert (status, headers["location"]) == (308, "help/")


def test_a_missing_page_says_so_with_a_way_back(folder: Path) -> None:
    status, headers, body = asked(HelpSite(_nobody, folder), "/help/api/nothing.html")
    assert status == 404
    assert 'href=".././"' in body
    assert "content-security-policy" in headers


def test_a_site_that_nobody_built_says_how_and_is_found_once_it_is(tmp_path: Path) -> None:
    site = HelpSite(_nobody, tmp_path / "help")
    status, _, body = asked(site, "/help/")
    assert status == 404
    assert "make site" in body
    (tmp_path / "help").mkdir()
    (tmp_path / "help" / "index.html").write_text("<h1>Help</h1>")
    assert asked(site, "/help/")[0] == 200


def test_a_site_that_is_built_anew_is_shown_anew(folder: Path) -> None:
    site = HelpSite(_nobody, folder)
    asked(site, "/help/")
    (folder / "index.html").write_text("<h1>Newer</h1>")
    os.utime(folder / "index.html", (1, 1))
    assert asked(site, "/help/")[2] == "<h1>Newer</h1>"


@pytest.mark.parametrize("path", ["/help/../secret.txt", "/help//etc/passwd", "/help/./index.html"])
def test_no_path_leads_out_of_it(folder: Path, path: str) -> None:
    assert asked(HelpSite(_nobody, folder), path)[0] == 404


@pytest.mark.parametrize(
    ("path", "method"),
    [("/helpers", "GET"), ("/", "GET"), ("/help/", "POST"), ("/api/help", "GET")],
)
def test_requests_outside_help_are_passed_on(folder: Path, path: str, method: str) -> None:
    assert asked(HelpSite(_nobody, folder), path, method)[0] == 418
