"""Change built pages so that nothing inline is left, parts have names, and pictures keep their room.

So the help's Content-Security-Policy can refuse everything inline: no text of a document ever becomes a
script or a style. And a page that is opened at a heading stays there while its pictures come.
"""

import hashlib
import re
import struct
from pathlib import Path
from typing import Final

_SCRIPT: Final = re.compile(r"<script>(.*?)</script>", re.DOTALL)
_SHEET: Final = re.compile(r"<style>(.*?)</style>", re.DOTALL)
_STYLE: Final = re.compile(r'(<[a-zA-Z][^<>]*?) style="([^"]*)"')
#: Headings of the list of pages, as the theme writes them: without a level they are none to a reader.
_CAPTION: Final = re.compile(r'<p class="caption" role="heading">')
#: What a reader of screens goes by and the theme leaves out: names of the two columns, no heading of a
#: column without words, a way to scroll what is wide by keys, and a heading of the search.
_NAMED: Final = (
    ('<aside class="sidebar-drawer">', '<aside class="sidebar-drawer" aria-label="All pages">'),
    ('<aside class="toc-drawer">', '<aside class="toc-drawer" aria-label="On this page">'),
    ('<th class="head"><p></p></th>', "<td></td>"),
    ("<pre>", '<pre tabindex="0">'),
    ('<div id="search-results">', '<h1>Search</h1>\n<div id="search-results">'),
)
_PICTURE: Final = re.compile(r'<img ([^>]*?)src="([^"]+\.png)"')


def finish(site: Path) -> None:
    """Change every page of a built site."""
    rules: dict[str, str] = {}
    for page in site.rglob("*.html"):
        up = "../" * (len(page.relative_to(site).parts) - 1)
        page.write_text(_sized(_moved(page.read_text(), site, up, rules), page.parent))
    sheet = "".join(f'[data-style="{name}"]{{{rule}}}\n' for name, rule in sorted(rules.items()))
    (site / "_static" / "inline.css").write_text(sheet)


def _named(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:10]


def _moved(text: str, site: Path, up: str, rules: dict[str, str]) -> str:
    def file(body: str, suffix: str) -> str:
        path = site / "_static" / f"inline-{_named(body)}{suffix}"
        path.write_text(body)
        return f"{up}_static/{path.name}"

    def ruled(match: re.Match[str]) -> str:
        rules[_named(match[2])] = match[2]
        return f'{match[1]} data-style="{_named(match[2])}"'

    text = _SCRIPT.sub(lambda found: f'<script src="{file(found[1], ".js")}"></script>', text)
    text = _SHEET.sub(
        lambda found: f'<link rel="stylesheet" href="{file(found[1], ".css")}">', text
    )
    text = _STYLE.sub(ruled, text)
    text = _CAPTION.sub('<p class="caption" role="heading" aria-level="2">', text)
    for theirs, ours in _NAMED:
        text = text.replace(theirs, ours)
    return text.replace("</head>", f'<link rel="stylesheet" href="{up}_static/inline.css"></head>')


def _sized(text: str, folder: Path) -> str:
    def size(match: re.Match[str]) -> str:
        width, height = _pixels(folder / match[2])
        return f'<img width="{width}" height="{height}" {match[1]}src="{match[2]}"'

    return _PICTURE.sub(size, text)


def _pixels(picture: Path) -> tuple[int, int]:
    with picture.open("rb") as file:
        width, height = struct.unpack(">II", file.read(24)[16:24])
    return width, height
