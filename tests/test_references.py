"""Whatever code and documents refer to is in this repository: files, sections, rules, decisions, links."""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Final

import pytest

ROOT: Final = Path(__file__).parents[1]
DOCS: Final = ROOT / "docs"
_TOPS: Final = ("bench", "docs", "frontend", "migrations", "ros", "scripts", "server", "tests")
_SKIPPED: Final = frozenset(
    {"node_modules", "dist", "__pycache__", "test-results", "playwright-report"}
)
_READ: Final = frozenset({".md", ".py", ".ts", ".tsx", ".toml", ".css"})
#: Folders in which a path may begin that is written without them.
_BASES: Final = ("", "server/action_assistant", "frontend/src")

_PATH: Final = re.compile(r"`([\w.-]+(?:/[\w.@-]+)+\.(?:py|tsx?|md|toml|conf|sh|css|service))`")
_FOLDER: Final = re.compile(rf"`((?:{'|'.join(_TOPS)})(?:/[\w-]+)+)/?`")
_PLAIN: Final = re.compile(r"(?<![\w/(`.])(docs/[\w./-]+\.md)")
_MODULE: Final = re.compile(
    r"`(?:action_assistant\.)?((?:editor|runner|web|journal|umrf)\.\w+)[\w.]*`"
)
_FILES: Final = frozenset(
    {
        *("editor.db", "runner.db", "editor.mark", "editor.database", "umrf.json"),
        *("editor.address", "runner.address"),
    }
)
_NAMED: Final = re.compile(r"`([A-Za-z_][\w.]*)`(?:,| \() ?`((?:server|frontend)/[^`]+\.\w+)`")
_LINK: Final = re.compile(r"\]\(([^)\s#:]*)(?:#([^)\s]+))?\)")
_HEADING: Final = re.compile(r"^#{1,6} (.+?)\s*$", re.MULTILINE)
_NUMBERED: Final = re.compile(r"^#{2,4} (\d+(?:\.\d+)?)\.? ", re.MULTILINE)
_SECTION: Final = re.compile(
    r"docs/([\w-]+\.md)`? (\d+(?:\.\d+)?(?:(?:, | to | and )\d+(?:\.\d+)?)*)"
)
_DECISION: Final = re.compile(r"\b[Dd]ecisions? \[?(\d{1,3})((?:(?:, | and |/)\d{1,3})*)\b")
_RULE: Final = re.compile(r"\b[Rr]ules? (R\d+)(?: … (R\d+))?")
_HAZARD: Final = re.compile(r"(?<![\w-])(H\d{1,2}b?)(?![\w.-])")
#: Documents that the code was written from, and that no clone has.
_ELSEWHERE: Final = re.compile(
    r"\b(?:SPEC|DESIGN) (?:\d|[RH]\d)|\b(?:SPEC|DESIGN|FACTS)\.md|\bnotes/\w+\.md"
)


@cache
def files() -> tuple[Path, ...]:
    """Return all files that people read and write here."""
    found = [path for path in ROOT.iterdir() if path.suffix in _READ]
    for top in _TOPS:
        found += _below(ROOT / top)
    found += (ROOT / "tests").rglob("blocked.json")  # its evidence names sections
    return tuple(sorted(found))


def _below(folder: Path) -> Iterator[Path]:
    for path in folder.iterdir():
        if path.is_dir():
            if path.name not in _SKIPPED and not path.name.startswith("."):
                yield from _below(path)
        elif path.suffix in _READ and path != Path(__file__):
            yield path


@cache
def text_of(path: Path) -> str:
    """Return the text of a file."""
    return path.read_text(encoding="utf-8")


@cache
def places() -> frozenset[str]:
    """Every path, and every end of one, that a reference may name."""
    known: set[str] = set()
    for path in files():
        parts = path.relative_to(ROOT).parts
        known.update("/".join(parts[n:]) for n in range(len(parts)))
    return frozenset(known)


def is_there(path: str, beside: Path) -> bool:
    """Return whether a path leads somewhere: from the top, from a package, from its own folder,
    or as the end of a known path."""
    found = any((ROOT / base / path).exists() for base in _BASES)
    return found or (beside.parent / path).exists() or path in places()


def sections(name: str) -> frozenset[str]:
    """The numbers of the headings of a document."""
    path = DOCS / name
    return frozenset(_NUMBERED.findall(text_of(path))) if path.exists() else frozenset()


def anchors(path: Path) -> frozenset[str]:
    """Return the anchors of a document, as the usual viewers make them from headings."""
    found = (
        re.sub(r"[^\w\- ]", "", heading.lower()) for heading in _HEADING.findall(text_of(path))
    )
    return frozenset(heading.replace(" ", "-") for heading in found)


def dead_paths(text: str, beside: Path) -> list[str]:
    """Files, folders and modules that are named and not there."""
    named = {*_PATH.findall(text), *_PLAIN.findall(text)}
    dead = [path for path in named if not is_there(path, beside)]
    dead += [path for path in set(_FOLDER.findall(text)) if not (ROOT / path).exists()]
    for module in {*_MODULE.findall(text)} - _FILES:
        path = ROOT / "server" / "action_assistant" / module.replace(".", "/")
        if not path.with_suffix(".py").exists() and not path.is_dir():
            dead.append(module)
    return sorted(dead)


def dead_sections(text: str) -> list[str]:
    """Numbered sections, rules and decisions that are named and not there."""
    dead: list[str] = []
    for name, numbers in _SECTION.findall(text):
        known = sections(name)
        dead += [
            f"{name} {each}" for each in re.findall(r"[\d.]+\d|\d", numbers) if each not in known
        ]
    rules = text_of(DOCS / "room-protocol.md")
    for found in _RULE.findall(text):
        dead += [rule for rule in found if rule and f"**{rule}." not in rules]
    for first, others in _DECISION.findall(text):
        for number in (first, *re.findall(r"\d+", others)):
            if not list((DOCS / "decisions").glob(f"{int(number):03}-*.md")):
                dead.append(f"decision {number}")
    return dead


def dead_links(path: Path) -> list[str]:
    """Links of a document that lead to no file or no heading."""
    dead: list[str] = []
    for target, anchor in _LINK.findall(text_of(path)):
        place = (path.parent / target).resolve() if target else path
        if not place.exists():
            dead.append(target)
        elif anchor and place.suffix == ".md" and anchor not in anchors(place):
            dead.append(f"{target}#{anchor}")
    return dead


def test_files_and_modules_that_are_named_are_there() -> None:
    found = {path: dead_paths(text_of(path), path) for path in files()}
    assert {str(path.relative_to(ROOT)): dead for path, dead in found.items() if dead} == {}


def test_classes_and_functions_that_documents_name_are_in_their_modules() -> None:
    named = [(path, *each) for path in DOCS.glob("*.md") for each in _NAMED.findall(text_of(path))]
    assert len(named) > 30
    missing = [
        (path.name, name, module)
        for path, name, module in named
        if not all(re.search(rf"\b{part}\b", text_of(ROOT / module)) for part in name.split("."))
    ]
    assert missing == []


def test_sections_rules_and_decisions_that_are_named_are_there() -> None:
    found = {path: dead_sections(text_of(path)) for path in files()}
    assert {str(path.relative_to(ROOT)): dead for path, dead in found.items() if dead} == {}


def test_links_of_documents_lead_somewhere() -> None:
    found = {path: dead_links(path) for path in files() if path.suffix == ".md"}
    assert sum(len(_LINK.findall(text_of(path))) for path in found) > 100
    assert {str(path.relative_to(ROOT)): dead for path, dead in found.items() if dead} == {}


def test_no_reference_leads_to_documents_that_no_clone_has() -> None:
    found = {path: _ELSEWHERE.findall(text_of(path)) for path in files()}
    assert {str(path.relative_to(ROOT)): words for path, words in found.items() if words} == {}


def test_hazards_that_are_named_are_described() -> None:
    described = text_of(DOCS / "umrf-and-the-engine.md")
    source = ROOT / "server" / "action_assistant" / "umrf"
    named = {
        code
        for path in files()
        if source in path.parents
        for code in _HAZARD.findall(text_of(path))
    }
    assert {"H1", "H2b", "H12"} <= named
    assert sorted(code for code in named if f"\n- `{code}`: " not in described) == []


def test_every_document_is_linked_from_the_first_page() -> None:
    linked = {target for target, _ in _LINK.findall(text_of(ROOT / "README.md"))}
    pages = {path.relative_to(ROOT).as_posix() for path in DOCS.glob("*.md")}
    assert sorted(pages - linked) == []


@pytest.mark.parametrize(
    ("text", "dead"),
    [
        ("see `docs/nothing.md`", ["docs/nothing.md"]),
        ("see docs/nothing.md 2.", ["docs/nothing.md"]),
        ("`editor/nothing.py` does", ["editor/nothing.py"]),
        ("`runner.nothing.follow` does", ["runner.nothing"]),
        ("`tests/nothing/` has it", ["tests/nothing"]),
        ("`docs/glossary.md`, `umrf/files/codec.py`, `umrf.files.codec.read`, `editor.mark`", []),
    ],
)
def test_a_dead_path_is_found(text: str, dead: list[str]) -> None:
    assert dead_paths(text, ROOT / "README.md") == dead


@pytest.mark.parametrize(
    ("text", "dead"),
    [
        ("docs/umrf-and-the-engine.md 2.3, 2.99", ["umrf-and-the-engine.md 2.99"]),
        ("docs/umrf-and-the-engine.md 2.3 to 2.7", []),
        ("(rule R99)", ["R99"]),
        ("decision 999", ["decision 999"]),
        ("decisions 12 and 34", []),
    ],
)
def test_a_dead_section_is_found(text: str, dead: list[str]) -> None:
    assert dead_sections(text) == dead
