"""The built documentation: every link leads somewhere, nothing comes from elsewhere, nothing is inline.

`make setup` builds it before tests run; what is looked at is what the product serves.
"""

import json
import re
import sys
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Final
from urllib.parse import unquote, urlsplit

import pytest

from action_assistant import paths
from action_assistant.system.diagnostics import CODES as DIAGNOSTICS
from action_assistant.umrf.codes import CODES

ROOT: Final = Path(__file__).parents[2]
SITE: Final = paths.help_site()
_LOADING: Final = {"link": "href", "script": "src", "img": "src", "source": "src", "iframe": "src"}

pytestmark = pytest.mark.skipif(
    not (SITE / "index.html").is_file(), reason="the help is not built; `make setup` builds it"
)


class _Read(HTMLParser):
    """Reads a page's links, loaded files, anchors, and inline scripts and styles."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.anchors: set[str] = set()
        self.inline: list[str] = []
        self.levelless: list[str] = []
        self.text = ""
        self._script = False
        self.feed(page.read_text())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Notes one tag."""
        given = {name: value or "" for name, value in attrs}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        if tag in _LOADING and _LOADING[tag] in given:
            self.loaded.append(given[_LOADING[tag]])
        if tag == "style" or "style" in given or any(name.startswith("on") for name in given):
            self.inline.append(f"<{tag} {given}>")
        if given.get("role") == "heading" and "aria-level" not in given:
            self.levelless.append(f"<{tag} {given}>")
        self._script = tag == "script"
        if self._script and "src" not in given:
            self.inline.append(f"<script {given}>")

    def handle_data(self, data: str) -> None:
        """Notes what people read."""
        self.text += "" if self._script else data


@cache
def pages() -> dict[Path, _Read]:
    """Every page, read."""
    return {path: _Read(path) for path in sorted(SITE.rglob("*.html"))}


def dead(page: Path, address: str) -> bool:
    """Return whether an address within the site leads to no file or no heading."""
    parts = urlsplit(address)
    target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
    if target == SITE.parent:  # the way back to the product
        return False
    if not target.is_file():
        return True
    return bool(parts.fragment) and unquote(parts.fragment) not in pages()[target].anchors


def test_every_link_and_every_picture_of_every_page_is_there() -> None:
    found = {
        str(page.relative_to(SITE)): wrong
        for page, read in pages().items()
        if (
            wrong := [
                each
                for each in (*read.links, *read.loaded)
                if not urlsplit(each).scheme and dead(page, each)
            ]
        )
    }
    assert len(pages()) > 90
    assert found == {}


def test_nothing_is_loaded_from_elsewhere_and_nothing_is_inline() -> None:
    for page, read in pages().items():
        assert [each for each in read.loaded if "//" in each] == [], page
        assert read.inline == [], page
        assert read.levelless == [], page
    for sheet in SITE.rglob("*.css"):
        assert not re.search(r"@import|url\(\s*['\"]?(?:https?:)?//", sheet.read_text()), sheet


def test_a_reader_of_screens_and_a_keyboard_get_along_on_every_page() -> None:
    nameless = r'<aside class="[^"]*(?<!no-toc)">|<th[^>]*>(<p></p>)?</th>|<pre>'
    for page in SITE.rglob("*.html"):
        text = page.read_text()
        assert not re.search(nameless, text), page
        assert len(re.findall("<h1[ >]", text)) == 1, page


def test_every_document_is_a_page_that_the_navigation_or_a_list_leads_to() -> None:
    names = {path.stem for path in (ROOT / "docs").glob("*.md")}
    assert names <= {path.stem for path in SITE.glob("*.html")}
    linked = {unquote(urlsplit(each).path) for each in pages()[SITE / "index.html"].links}
    assert {f"{name}.html" for name in names} <= linked
    decisions = {unquote(each) for each in pages()[SITE / "decisions" / "index.html"].links}
    assert {
        f"{path.stem}.html" for path in (ROOT / "docs/decisions").glob("[0-9]*.md")
    } <= decisions


def test_every_route_and_shape_of_both_processes_is_told() -> None:
    for name in ("editor", "runner"):
        spec = json.loads((ROOT / f"frontend/src/api/schema/{name}.openapi.json").read_text())
        read = pages()[SITE / "api" / f"{name}.html"]
        routes = {
            f"{method.upper()} {path}"
            for path, methods in spec["paths"].items()
            for method in methods
        }
        assert {each for each in routes if each not in read.text} == set()
        assert {each.lower() for each in spec["components"]["schemas"]} <= read.anchors


def test_every_code_of_problems_and_diagnostics_is_told() -> None:
    for name, codes in (("umrf", CODES), ("doctor", DIAGNOSTICS)):
        told = pages()[SITE / f"{name}.html"].text
        assert [code for code in codes if code not in told] == []


def test_places_that_the_page_leads_to_are_there() -> None:
    named = [
        place
        for path in (ROOT / "frontend/src").rglob("*.tsx")
        for place in re.findall(r'HelpLink\s+place="([^"]+)"', path.read_text())
    ]
    assert len(named) >= 3
    assert [each for each in named if dead(SITE / "index.html", each)] == []


def test_its_colours_are_those_of_the_page() -> None:
    tokens = (ROOT / "frontend/src/ui/tokens.css").read_text()
    light, dark = tokens.split("[data-mantine-color-scheme", maxsplit=1)
    told = (ROOT / "docs/site/conf.py").read_text()
    start, middle, end = (told.index(each) for each in ("LIGHT = {", "DARK = {", "_FONTS = {"))
    for colours, scheme in ((told[start:middle], light), (told[middle:end], dark)):
        used = re.findall(r"#[0-9a-f]{6}", colours)
        assert len(used) == 10
        assert [each for each in used if each not in scheme] == []


def test_search_finds_what_an_operator_asks_for() -> None:
    index = (SITE / "searchindex.js").read_text()
    assert '"unconfirm"' in index or "unconfirm:" in index
    assert "operators-guide" in index


@pytest.fixture
def generator(monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of what builds it, to import from."""
    folder = ROOT / "docs" / "site"
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.syspath_prepend(str(folder))
    return folder


def test_a_diagram_that_cannot_be_told_fails(generator: Path) -> None:
    import diagrams

    drawn = "```mermaid\nsequenceDiagram\n  participant a as the page\n  a->>b: go\n```"
    assert "| the page | b | go |" in diagrams.told(drawn)
    with pytest.raises(ValueError, match="not known"):
        diagrams.told("```mermaid\nsequenceDiagram\n  a ~~> b\n```")


def test_a_page_that_comes_later_is_in_the_navigation_and_in_its_list(generator: Path) -> None:
    import pages as site

    without, with_it = {"index.md", "administration.md"}, {"administration.md", "backups.md"}
    assert "backups" not in site.navigation(without)
    assert "\nbackups\n" in site.navigation(with_it)
    assert ":caption: More" in site.navigation({"nobody-thought-of-it.md"})
    told = site.listed(
        ["backups"], {"backups.md": "# Backups\n\nA copy. More."}, "administration.md"
    )
    assert told == "- [Backups](backups.md): A copy."


def test_a_link_leads_to_where_things_lie_in_the_help(generator: Path) -> None:
    import pages as site

    readme, network = ROOT / "README.md", ROOT / "docs" / "network.md"
    told, _ = site.relinked("[a](docs/robots.md#x) [b](LICENSE) `[c](no)`", readme)
    assert told.startswith("[a](robots.md#x) b ")
    told, needed = site.relinked("[a](../README.md#in-the-lab) [b](proxy/Caddyfile)", network)
    assert told == "[a](overview.md#in-the-lab) [b](proxy/Caddyfile)"
    assert needed == {"proxy/Caddyfile"}
    with pytest.raises(ValueError, match=r"none\.png"):
        site.relinked("![a](pictures/none.png)", network)
