"""Check the structure of the server: no import circles, few layers, tests that mirror the code.

Two alarms, for the page's files too: a file of more than 700 lines and a function of more than 60
statements need a reason. They ask for a look, not for a split by count.
"""

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

PACKAGE: Final = "action_assistant"
TESTS: Final = Path(__file__).parent
SERVER: Final = TESTS.parent / "server" / PACKAGE
#: Below each of these, packages stand on so many floors at most. In the runner repeats stand on all that
#: carries out one start.
FLOORS: Final = {"runner": 7, "editor": 6, "web": 6, "umrf": 6}
ROOT: Final = TESTS.parent
LINES: Final = 700  # of a file
STATEMENTS: Final = 60  # of a function, without the functions inside it
SOURCES: Final = ("server", "tests", "bench", "frontend/src", "frontend/e2e")
GENERATED: Final = ROOT / "frontend/src/api/schema"
#: Files that are longer, and why a split would be worse.
LONG_FILES: Final[dict[str, str]] = {}
#: Functions that are longer, and why.
LONG_FUNCTIONS: Final[dict[str, str]] = {}


def modules() -> dict[str, Path]:
    """Every module of the server by its dotted name."""
    found = {}
    for path in sorted(SERVER.rglob("*.py")):
        name = ".".join((PACKAGE, *path.relative_to(SERVER).with_suffix("").parts))
        found[name.removesuffix(".__init__")] = path
    return found


MODULES: Final = modules()


def imports(path: Path) -> Iterator[str]:
    """The modules of ours that one imports, wherever in it; for types alone as well."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (each.name for each in node.names if each.name in MODULES)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            for each in node.names:
                deeper = f"{node.module}.{each.name}"
                yield from (name for name in (deeper, node.module) if name in MODULES)


def children(package: str) -> dict[str, set[str]]:
    """Return the direct children of a package, folders as one, with the children that each
    imports."""
    found: dict[str, set[str]] = defaultdict(set)
    inside = f"{package}."

    def child(name: str) -> str:
        return name.removeprefix(inside).partition(".")[0]

    for name, path in MODULES.items():
        if not name.startswith(inside):
            continue
        own = child(name)
        found[own] |= {
            child(each) for each in imports(path) if each.startswith(inside) and child(each) != own
        }
    return found


def floors(package: str) -> dict[str, int]:
    """Return the floor of each child, above everything that it imports. Fails for a circle."""
    graph, found = children(package), dict[str, int]()

    def floor(name: str, above: tuple[str, ...]) -> int:
        assert name not in above, f"a circle in {package}: {' → '.join([*above, name])}"
        if name not in found:
            found[name] = 1 + max((floor(each, (*above, name)) for each in graph[name]), default=0)
        return found[name]

    for name in list(graph):
        floor(name, ())
    return found


PACKAGES: Final = sorted(name for name, path in MODULES.items() if path.name == "__init__.py")


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_make_no_circles_between_what_stands_in_a_folder(package: str) -> None:
    floors(package)


@pytest.mark.parametrize("package", FLOORS)
def test_packages_stand_on_few_floors(package: str) -> None:
    whole = f"{PACKAGE}.{package}"
    graph = children(whole)
    folders = {name for name in graph if MODULES[f"{whole}.{name}"].name == "__init__.py"}

    def floor(name: str) -> int:
        return 1 + max((floor(each) for each in graph[name] & folders), default=0)

    highest = max(folders, key=floor)
    assert floor(highest) <= FLOORS[package], f"{highest} stands on floor {floor(highest)}"


def test_folders_of_tests_mirror_those_of_the_server() -> None:
    folders = {path.parent.relative_to(TESTS) for path in TESTS.rglob("test_*.py")}
    mirrored = {each for each in folders if each.parts and (SERVER / each.parts[0]).is_dir()}
    assert {str(each) for each in mirrored if not (SERVER / each / "__init__.py").exists()} == set()


def statements(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return the number of statements of a function, without those of functions inside it."""
    count, waiting = 0, list(ast.iter_child_nodes(function))
    while waiting:
        node = waiting.pop()
        count += isinstance(node, ast.stmt)
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            waiting.extend(ast.iter_child_nodes(node))
    return count


def test_functions_are_short() -> None:
    found: dict[str, int] = defaultdict(int)
    for top in ("server", "migrations", "bench", "tests"):
        for path in sorted((ROOT / top).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                    name = f"{path.relative_to(ROOT)} {node.name}"
                    found[name] = max(found[name], statements(node))
    long = {name: lines for name, lines in found.items() if lines > STATEMENTS}
    assert {name: lines for name, lines in long.items() if name not in LONG_FUNCTIONS} == {}
    assert set(LONG_FUNCTIONS) <= set(long), "a reason without a function that needs it"


def test_files_are_short() -> None:
    found = {}
    for top in SOURCES:
        for path in sorted((ROOT / top).rglob("*")):
            if path.suffix in {".py", ".ts", ".tsx"} and path.parent != GENERATED:
                found[str(path.relative_to(ROOT))] = len(path.read_text().splitlines())
    long = {name: lines for name, lines in found.items() if lines > LINES}
    assert {name: lines for name, lines in long.items() if name not in LONG_FILES} == {}
    assert set(LONG_FILES) <= set(long), "a reason without a file that needs it"
