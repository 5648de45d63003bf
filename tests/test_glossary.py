"""The words of the glossary, in the texts that people read: OpenAPI of both processes, and the page;
and the routes that documents name.

`docs/glossary.md` has for each term, behind *Not*, words that are not used for it.
"""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from support.openapi import documents

ROOT = Path(__file__).parents[1]
GLOSSARY = ROOT / "docs" / "glossary.md"
DOCUMENTS = ROOT / "docs"
PAGE = ROOT / "frontend" / "src"

# Elsewhere the applications are made in processes of their own, where this is no error.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

_ROW = re.compile(r"- (?P<terms>\*\*.*?): (?P<meaning>.*?\.)(?: Not: (?P<others>.*?)\.)?")
_COMMENTS = re.compile(r"/\*.*?\*/|(?<![:\"'`])//[^\n]*", re.DOTALL)
_BETWEEN_TAGS = re.compile(r"(?<![=\-])>([^<>{}=;]*[A-Za-z][^<>{}=;]*)<")
_SHOWN = re.compile(
    r"(?:label|title|placeholder|message|description|text|hint)\s*[=:]\s*\{?([\"'`])(.+?)\1"
)
_SENTENCE = re.compile(r"([\"'`])([A-Z][^\"'`\n]* [^\"'`\n]*)\1")
_INSERTED = re.compile(r"\$\{[^}]*\}")
_METHOD = "(?:GET|PUT|POST|PATCH|DELETE)"
_ROUTE = re.compile(rf"({_METHOD}(?:, {_METHOD})*) (/api/[\w/{{}}-]+)")
_SOCKETS = frozenset({"/api/graphs/{}/room", "/api/live"})


class Term:
    """An entry of the glossary."""

    def __init__(self, row: re.Match[str]) -> None:
        self.names = [
            name.strip()
            for bold in re.findall(r"\*\*(.+?)\*\*", row["terms"])
            for name in bold.split(",")
        ]
        self.others = [other.strip() for other in (row["others"] or "").split(",") if other.strip()]


@cache
def terms() -> list[Term]:
    """Return all entries of the glossary."""
    return [Term(row) for row in map(_ROW.fullmatch, GLOSSARY.read_text().splitlines()) if row]


def instead(text: str) -> list[str]:
    """Return the words of a text for which the glossary has another word, with that word."""
    return [
        f"{other!r}, not {term.names[0]!r}"
        for term in terms()
        for other in term.others
        if re.search(rf"\b{re.escape(other)}s?\b", text, re.IGNORECASE)
    ]


@pytest.fixture(scope="module")
def schemas(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    """Return the OpenAPI documents of the editor and the runner, without starting either."""
    return list(documents(tmp_path_factory.mktemp("data")).values())


def described(value: object) -> Iterator[str]:
    """Every summary and description of a schema."""
    if isinstance(value, dict):
        for key, member in value.items():
            if key in {"summary", "description"} and isinstance(member, str):
                yield member
            else:
                yield from described(member)
    elif isinstance(value, list):
        for member in value:
            yield from described(member)


def shown(source: str) -> Iterator[str]:
    """The texts that a module of the page may show. Words that only search finds are none."""
    code = _COMMENTS.sub("", source)
    code = "\n".join(line for line in code.split("\n") if not line.lstrip().startswith("also:"))
    yield from _BETWEEN_TAGS.findall(code)
    for found in (*_SHOWN.finditer(code), *_SENTENCE.finditer(code)):
        yield _INSERTED.sub("…", found[2])


def sources() -> Iterator[Path]:
    """The modules of the page, without tests and what only tests use."""
    for path in sorted(PAGE.rglob("*.ts*")):
        if ".test." not in path.name and not path.name.startswith("fake-"):
            yield path


def test_each_term_stands_once_and_is_not_forbidden_for_another() -> None:
    names = [name for term in terms() for name in term.names]
    assert len(names) > 50
    assert len(names) == len(set(names))
    assert not {other for term in terms() for other in term.others} & set(names)


def test_openapi_uses_the_words_of_the_glossary(schemas: list[dict[str, Any]]) -> None:
    texts = [text for schema in schemas for text in described(schema)]
    assert len(texts) > 100
    assert [(text, instead(text)) for text in texts if instead(text)] == []


def test_the_page_uses_the_words_of_the_glossary() -> None:
    texts = [(path, text) for path in sources() for text in shown(path.read_text())]
    assert len(texts) > 500
    wrong = [(path.name, text, instead(text)) for path, text in texts if instead(text)]
    assert wrong == []


def test_the_glossary_says_what_each_state_of_a_run_means(schemas: list[dict[str, Any]]) -> None:
    shape = schemas[1]["components"]["schemas"]["RunShown"]["properties"]["state"]
    text = GLOSSARY.read_text()
    assert len(shape["enum"]) > 8
    assert [state for state in shape["enum"] if f"*{state}*" not in text] == []


def test_the_routes_that_documents_name_are_there(schemas: list[dict[str, Any]]) -> None:
    there = {
        (method.upper(), re.sub(r"\{\w+\}", "{}", path))
        for schema in schemas
        for path, item in schema["paths"].items()
        for method in item
    }
    named = {
        (method, re.sub(r"\{\w+\}|\b[A-Z_]+\b", "{}", path))
        for document in DOCUMENTS.rglob("*.md")
        for methods, path in _ROUTE.findall(document.read_text())
        for method in methods.split(", ")
    }
    assert len(named) > 20
    assert {(method, path) for method, path in named - there if path not in _SOCKETS} == set()


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("<Text>Add a node</Text>", ["'node', not 'action'"]),
        ('<Menu label="Delete edges" />', ["'edge', not 'arrow'"]),
        ("const text = `Kill ${name} now`;", ["'kill', not 'Stop'"]),
        ('also: "new node insert",', []),
        ("/** A node of the canvas. */", []),
    ],
)
def test_a_word_that_is_not_used_is_found_where_people_would_read_it(
    source: str, found: list[str]
) -> None:
    assert [each for text in shown(source) for each in instead(text)][:1] == found
