"""Which documents the help consists of, where each lies in it, and where its links then lead."""

import re
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[2]
DOCS: Final = ROOT / "docs"

#: The navigation. What is not there yet is left out; what is there and not named comes under the last.
SECTIONS: Final = (
    ("Start", ("tutorial", "overview")),
    ("Operating robots", ("operators-guide", "robots", "safety")),
    ("Editing and looking back", ("editor", "drawing", "runs", "library", "action-packages")),
    ("UMRF", ("umrf", "umrf-and-the-engine")),
    (
        "Administration",
        (
            *("administration", "installing", "containers", "network"),
            *("people", "backups", "audit", "monitoring", "doctor", "scale"),
        ),
    ),
    ("For programs", ("programs", "api/editor", "api/runner", "contracts", "room-protocol")),
    (
        "How it is built",
        (
            *("architecture", "first-change", "glossary", "performance", "comparison"),
            *("decisions/index", "contributing", "changes"),
        ),
    ),
)
#: Pages that the navigation calls otherwise than they call themselves.
CALLED: Final = {
    "tutorial": "Tutorial",
    "overview": "All on one page",
    "editor": "What a graph means",
    "contributing": "Contributing",
}
#: Documents that have another name in the help than in the repository.
RENAMED: Final = {
    "README.md": "overview.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changes.md",
    "docs/site/index.md": "index.md",
    "docs/decisions/README.md": "decisions/index.md",
    "docs/decisions": "decisions/index.md",
}
#: Folders of `docs` whose files go along as they are when a page leads to them.
CARRIED: Final = ("pictures", "proxy")
#: Where a document wants the list of the other pages of its section.
LIST: Final = "<!-- the pages of this section -->"

#: A span of code, which stays as it is, or a link.
_LINK: Final = re.compile(r"`[^`\n]+`|(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s#]*)(#[^)\s]*)?\)")
_CODE: Final = re.compile(r"(^```[^`]*^```|^(?: {4}[^\n]*\n)+)", re.MULTILINE)
_TITLE: Final = re.compile(r"^# (.+)$", re.MULTILINE)
_FIRST: Final = re.compile(r"^# .+\n+([^#\n|!>`].+)$", re.MULTILINE)


def sources() -> dict[str, Path]:
    """Each page of the help by its path there, and the document that it is made of."""
    documents = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]
    documents += [*DOCS.glob("*.md"), *(DOCS / "decisions").glob("*.md"), DOCS / "site/index.md"]
    return {place: path for path in sorted(documents) if (place := place_of(path)) is not None}


def place_of(path: Path) -> str | None:
    """Where a file of the repository lies in the help; None where it does not."""
    name = path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else ""
    if name in RENAMED:
        return RENAMED[name]
    within = name.removeprefix("docs/")
    carried = within.startswith(tuple(f"{each}/" for each in CARRIED))
    if within == name or not path.is_file() or not (carried or path.suffix == ".md"):
        return None
    return within


def relinked(text: str, document: Path) -> tuple[str, set[str]]:
    """The text with links that lead where things lie in the help, and which files it needs beside it.

    What the help has no place for stays as words. Fails for what the repository does not have.
    """
    own = place_of(document)
    assert own is not None
    needed: set[str] = set()

    def lead(match: re.Match[str]) -> str:
        sign, words, target, anchor = match[1], match[2], match[3], match[4] or ""
        if target is None or "://" in target or target.startswith("mailto:"):
            return match[0]
        if not sign:
            words, inside = relinked(words, document)
            needed.update(inside)
        there = (document.parent / target).resolve()
        if target and not there.exists():
            raise ValueError(f"{document} leads to {target}, which is not there")
        place = own if not target else place_of(there)
        if place is None:
            return words
        if not place.endswith(".md"):
            needed.add(place)
        way = "../" * own.count("/") + place if target else ""
        return f"{sign}[{words}]({way}{anchor})"

    def prose(part: str) -> str:
        return _LINK.sub(lead, part)

    parts = _CODE.split(text)
    return "".join(part if n % 2 else prose(part) for n, part in enumerate(parts)), needed


def titled(text: str, fallback: str) -> str:
    """What a document calls itself."""
    found = _TITLE.search(text)
    return found[1] if found else fallback


def numbered(text: str, place: str) -> str:
    """The title of a decision, with its number whether it says it or not."""
    bare = re.sub(r"^\d+\.? *", "", titled(text, place))
    return f"{int(Path(place).name[:3])}. {bare}"


def listed(places: list[str], texts: dict[str, str], own: str) -> str:
    """Pages as a list, each with the first sentence that it says."""
    lines = []
    for place in places:
        text = texts[f"{place}.md"]
        found = _FIRST.search(text)
        first = re.split(r"(?<=\.) ", found[1])[0] if found else ""
        # A link in it would lead from another folder.
        first = _LINK.sub(lambda match: match[2] or match[0], first)
        way = "../" * own.count("/") + place
        lines.append(f"- [{titled(text, place)}]({way}.md){': ' if first else ''}{first}")
    return "\n".join(lines)


def section_of(place: str) -> tuple[str, ...]:
    """The names of the section that a page is in."""
    return next((names for _, names in SECTIONS if place.removesuffix(".md") in names), ())


def navigation(places: set[str]) -> str:
    """The table of contents, as Sphinx reads it."""
    named = {f"{name}.md" for _, names in SECTIONS for name in names}
    rest = sorted(
        place.removesuffix(".md")
        for place in places - named - {"index.md"}
        if not place.startswith("decisions/")
    )
    blocks = []
    for caption, names in (*SECTIONS, ("More", tuple(rest))):
        there = [name for name in names if f"{name}.md" in places]
        if there:
            pages = "\n".join(
                f"{CALLED[name]} <{name}>" if name in CALLED else name for name in there
            )
            blocks.append(
                f"```{{toctree}}\n:hidden:\n:titlesonly:\n:caption: {caption}\n\n{pages}\n```"
            )
    return "\n\n".join(blocks)
