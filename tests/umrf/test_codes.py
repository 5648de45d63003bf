"""The registry of problem codes, and the code that reports them."""

import ast
from collections.abc import Iterator
from pathlib import Path

from action_assistant.umrf.check import STRUCTURAL
from action_assistant.umrf.codes import CODES
from action_assistant.umrf.fixes import _FIXES

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "server" / "action_assistant" / "umrf"


def words() -> Iterator[str]:
    """Every text in the source except documentation, of all modules but the registry."""
    for path in SOURCES.rglob("*.py"):
        if path.name != "codes.py":
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.Constant) and isinstance(node.value, str):
                    yield node.value


def reported() -> Iterator[tuple[str, str | None]]:
    """The codes that calls and values name as such, with their severity where it is written."""
    for path in SOURCES.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.Call):
                continue
            name = node.func.attr if isinstance(node.func, ast.Attribute) else ""
            name = node.func.id if isinstance(node.func, ast.Name) else name
            given = [*node.args[:1], *(k.value for k in node.keywords if k.arg == "code")]
            if name not in ("report", "Unreadable", "Problem"):
                continue
            texts = [v.value for v in node.args[1:2] if isinstance(v, ast.Constant)]
            severity = texts[0] if texts and texts[0] in ("error", "warning") else None
            for value in given:
                if isinstance(value, ast.Constant) and isinstance(value.value, str):
                    yield value.value, severity


def test_every_code_that_is_reported_is_registered_and_every_registered_one_is_reported() -> None:
    for code, severity in reported():
        assert code in CODES
        assert severity is None or severity in CODES[code].severities, code
    assert set(CODES) <= set(words())


def test_fixes_are_those_that_codes_name() -> None:
    assert {fix for code in CODES.values() for fix in code.fixes} == set(_FIXES)


def test_structural_codes_are_errors() -> None:
    assert all(CODES[code].severities == ("error",) for code in STRUCTURAL)
