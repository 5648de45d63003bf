"""Builds the help that the product carries, from the documents of this repository: `make site`.

    python docs/site/build.py build/help

It takes seconds, fetches nothing, and fails where a page names a page, a heading or a picture that is
not there.
"""

import shutil
import sys
import tempfile
from pathlib import Path
from typing import Final

import api_pages
import diagrams
import moves
import pages
from sphinx.cmd.build import main as sphinx

from action_assistant.system import diagnostics
from action_assistant.umrf import codes

HERE: Final = Path(__file__).resolve().parent
FRONTEND: Final = pages.ROOT / "frontend"
SCHEMA: Final = FRONTEND / "src/api/schema"
#: Where a document wants a table that is made from the code.
TABLES: Final = {
    "<!-- the tables of codes -->": codes.table,
    "<!-- the table of diagnostics -->": diagnostics.table,
}
#: What no page asks for, of the theme and of Sphinx.
_SPARE: Final = ("*.map", "*.LICENSE.txt", ".buildinfo", "objects.inv", "debug.css", "file.png")


def texts() -> tuple[dict[str, str], set[str]]:
    """Every page as Markdown, by its path in the help, and the files that they need."""
    found: dict[str, str] = {}
    needed: set[str] = set()
    for place, document in pages.sources().items():
        text, files = pages.relinked(diagrams.told(document.read_text()), document)
        needed |= files
        found[place] = text
    for name in ("editor", "runner"):
        found[f"api/{name}.md"] = api_pages.page(name, SCHEMA / f"{name}.openapi.json")
    return found, needed


def lay_out(folder: Path) -> None:
    """The pages as Sphinx reads them."""
    found, needed = texts()
    for place, text in found.items():
        path = folder / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(_completed(place, text, found))
    for file in needed:
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(pages.DOCS / file, folder / file)
    shutil.copy(HERE / "conf.py", folder)
    shutil.copytree(HERE / "static", folder / "_static")
    shutil.copytree(HERE / "templates", folder / "_templates")
    shutil.copy(FRONTEND / "public/mark.svg", folder / "_static")


def _completed(place: str, text: str, found: dict[str, str]) -> str:
    """What belongs to a page because of the others."""
    if place == "index.md":
        return f"{text}\n\n{pages.navigation(set(found))}\n"
    if place == "decisions/index.md":
        records = sorted(each for each in found if each.startswith("decisions/") and each != place)
        lines = [f"- [{pages.numbered(found[each], each)}]({Path(each).name})" for each in records]
        return f"{text}\n\n" + "\n".join(lines)
    for mark, table in TABLES.items():
        text = text.replace(mark, table())
    if pages.LIST in text:
        names = [each for each in pages.section_of(place) if f"{each}.md" in found]
        others = [each for each in names if f"{each}.md" != place]
        return text.replace(pages.LIST, pages.listed(others, found, place))
    if place.startswith("decisions/"):
        return f"---\norphan: true\n---\n\n{text}"  # the sidebar would be only decisions
    return text


def build(to: Path) -> int:
    """The site in a folder of its own. Answers Sphinx's exit code."""
    with tempfile.TemporaryDirectory() as made:
        source, site, trees = (Path(made) / each for each in ("source", "site", "trees"))
        source.mkdir()
        lay_out(source)
        told = ["--quiet", "--nitpicky", "--fail-on-warning", "--keep-going"]
        code = sphinx([*told, "-d", str(trees), "-b", "html", str(source), str(site)])
        if code:
            return code
        for spare in _SPARE:
            for path in site.rglob(spare):
                path.unlink()
        shutil.rmtree(site / "_sources", ignore_errors=True)
        moves.finish(site)
        if to.exists():
            shutil.rmtree(to)
        to.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(site, to)
    return 0


if __name__ == "__main__":
    sys.exit(build(Path(sys.argv[1])))
