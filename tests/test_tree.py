"""The tree of the server: folders that can be looked over, no circles, one name for one thing; and
how long files and functions are, of the page's files too (its functions: `frontend/src/tree.test.ts`).
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
MOST: Final = 15  # modules of a folder
#: Below each of these, packages stand on so many floors at most.
FLOORS: Final = {"runner": 6, "editor": 6, "web": 6, "umrf": 6}
ROOT: Final = TESTS.parent
LINES: Final = 400  # of a file
OWN_LINES: Final = 40  # of a function
SOURCES: Final = ("server", "tests", "bench", "frontend/src", "frontend/e2e")
GENERATED: Final = ROOT / "frontend/src/api/schema"
#: Files that are longer, and why a split would be worse.
LONG_FILES: Final = {
    "server/action_assistant/runner/execution/service.py": "starts and stops over the same open runs",
    "server/action_assistant/runner/execution/run_loop.py": "all that one open run holds and does",
    "server/action_assistant/umrf/semantics/core.py": "one recursion: results, runs, stops, pauses",
}
#: Functions that are longer, and why.
LONG_FUNCTIONS: Final = {
    "migrations/editor/editor_0001_log_and_catalogue.py upgrade": "migrations never change again",
    "migrations/runner/runner_0001_log_and_runs.py upgrade": "migrations never change again",
}
#: Class names that stand in several modules, and why they may.
SHARED: Final[dict[str, str]] = {}


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
    """What stands directly in a package, folders as one, and what of it each imports."""
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
    """On which floor each child stands: above everything that it imports. Fails for a circle."""
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
def test_a_folder_holds_neither_many_modules_nor_one(package: str) -> None:
    folder = MODULES[package].parent
    there = [path.stem for path in folder.glob("*.py") if path.stem != "__init__"]
    below = [path for path in folder.iterdir() if (path / "__init__.py").exists()]
    assert len(there) <= MOST, f"{len(there)} modules in {package}"
    assert len(there) != 1 or below, f"{package} has one module: {there}"


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
    for folder in mirrored:
        assert len(list((TESTS / folder).glob("test_*.py"))) <= MOST, f"many tests in {folder}"


def test_a_class_name_stands_in_one_module() -> None:
    where = defaultdict(set)
    for name, path in MODULES.items():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ClassDef):
                where[node.name].add(name)
    several = {name: sorted(places) for name, places in where.items() if len(places) > 1}
    assert {name: at for name, at in several.items() if name not in SHARED} == {}
    assert set(SHARED) <= set(several), "a reason without a name that needs it"


def own_lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """From `def` to its end; functions inside, their decorators, and its docstring do not count."""
    assert function.end_lineno is not None
    lines = set(range(function.lineno, function.end_lineno + 1))
    first = function.body[0]
    inside: list[tuple[int, int | None]] = []
    if ast.get_docstring(function, clean=False) is not None:
        inside.append((first.lineno, first.end_lineno))
    for node in ast.walk(function):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node is not function:
            starts = [node.lineno, *(each.lineno for each in node.decorator_list)]
            inside.append((min(starts), node.end_lineno))
    for begin, end in inside:
        lines -= set(range(begin, (end or begin) + 1))
    return len(lines)


def test_functions_are_short() -> None:
    found: dict[str, int] = defaultdict(int)
    for top in ("server", "migrations", "bench", "tests"):
        for path in sorted((ROOT / top).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                    name = f"{path.relative_to(ROOT)} {node.name}"
                    found[name] = max(found[name], own_lines(node))
    long = {name: lines for name, lines in found.items() if lines > OWN_LINES}
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
