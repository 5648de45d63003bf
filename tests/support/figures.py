"""Measure the size and the language of the code: `make figures`, for today and for an earlier commit.

    python -m support.figures [COMMIT]

Prints one row for each figure: its value at COMMIT (default: the last one before the code was
made plainer), its value in the working tree, and the goal.
"""

import ast
import re
import subprocess
import sys
import tarfile
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Final, NamedTuple

ROOT: Final = Path(__file__).parents[2]
PACKAGE: Final = "action_assistant"
BEFORE: Final = "ab1e3093"
FEW_LINES: Final = 40  # of a file of the page
SHORT_WORDS: Final = 4  # of a docstring
LONG_FUNCTION: Final = 10  # lines; a longer public one needs a docstring

#: First words that leave the subject of a sentence to be guessed.
OPENING: Final = re.compile(
    r"(What|Whether|Which|Who|Whom|Whose|How|Where|When|Why|As|The same|Those|That|In which|By which"
    r"|From which|(For|By|With|Under|To|At|In) (what|whom|who|those|how)|Until|Of|All of|Nothing"
    r"|Something|Somebody|Someone|It|They|Them|Everything|Everybody|Others?|One of|Each of|Both"
    r"|None)\b"
)
#: A comment of documentation in TypeScript, with the text of its first line.
_TSDOC: Final = re.compile(r"/\*\*\s*(?:\*\s*)?(?P<first>[^\n]*)")


_DOCUMENTED: Final = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


class Docstring(NamedTuple):
    """The documentation of one class, function or file: where it stands and what it says."""

    path: Path
    line: int
    name: str
    text: str

    @property
    def has_no_subject(self) -> bool:
        """Return whether the first sentence opens with a word that stands for its subject."""
        return OPENING.match(self.text) is not None

    @property
    def is_short(self) -> bool:
        """Return whether the text of a class or function has too few words to say anything. The path of a
        module says the rest of its subject."""
        return bool(self.name) and len(self.text.split()) <= SHORT_WORDS

    def __str__(self) -> str:
        first = self.text.splitlines()[0] if self.text else ""
        return f"{self.path}:{self.line} {self.name}: {first}"


def python_files(root: Path) -> list[Path]:
    """Return the modules of the server, packages included."""
    return sorted((root / "server" / PACKAGE).rglob("*.py"))


def page_files(root: Path, *suffixes: str) -> list[Path]:
    """Return the written files of the page with these suffixes: no tests, nothing generated."""
    found = (root / "frontend/src").rglob("*")
    return sorted(
        path
        for path in found
        if path.suffix in suffixes and ".test." not in path.name and "schema" not in path.parts
    )


def docstrings(root: Path) -> Iterator[Docstring]:
    """Yield the docstring of each module, class and function of the server that has one."""
    for path in python_files(root):
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, _DOCUMENTED):
                continue
            if (text := ast.get_docstring(node)) is not None:
                line, name = (1, "") if isinstance(node, ast.Module) else (node.lineno, node.name)
                yield Docstring(path.relative_to(root), line, name, text)


def undocumented(root: Path) -> list[str]:
    """Return the public classes and functions of more than ten lines that have no docstring. The `summary` of
    a route is its documentation."""
    return [
        f"{path.relative_to(root)}:{node.lineno} {node.name}"
        for path in python_files(root)
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        and not node.name.startswith("_")
        and (node.end_lineno or 0) - node.lineno > LONG_FUNCTION
        and ast.get_docstring(node) is None
        and "summary" not in _decorations(node)
    ]


def _decorations(node: ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) -> set[str | None]:
    calls = (each for each in node.decorator_list if isinstance(each, ast.Call))
    return {keyword.arg for call in calls for keyword in call.keywords}


def tsdocs(root: Path) -> Iterator[Docstring]:
    """Yield the comments of documentation in the page's sources."""
    for path in page_files(root, ".ts", ".tsx"):
        source = path.read_text()
        for found in _TSDOC.finditer(source):
            line = source.count("\n", 0, found.start()) + 1
            text = found["first"].removesuffix("*/").strip()
            yield Docstring(path.relative_to(root), line, "", text)


def neighbours(root: Path) -> list[str]:
    """Return the server's modules that exactly one module imports, one of the same folder."""
    files = {
        ".".join(
            (PACKAGE, *path.relative_to(root / "server" / PACKAGE).with_suffix("").parts)
        ): path
        for path in python_files(root)
    }
    importers: dict[str, set[str]] = defaultdict(set)
    for name, path in files.items():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                targets = [each.name for each in node.names]
            elif isinstance(node, ast.ImportFrom) and node.module is not None:
                targets = [f"{node.module}.{each.name}" for each in node.names] + [node.module]
            else:
                continue
            for target in targets:
                if target in files:
                    importers[target].add(name)
    return sorted(
        name
        for name, by in importers.items()
        if len(by) == 1 and name.rpartition(".")[0] == next(iter(by)).rpartition(".")[0]
    )


def lines(paths: list[Path]) -> int:
    """Return the number of lines of all these files together."""
    return sum(len(path.read_text().splitlines()) for path in paths)


def words(root: Path) -> int:
    """Return the number of words of the documents in `docs/`, decisions included."""
    return sum(len(path.read_text().split()) for path in (root / "docs").rglob("*.md"))


def waits(root: Path) -> int:
    """Return how many browser tests wait for a time instead of an event."""
    specs = (root / "frontend/e2e").rglob("*.ts")
    return sum(path.read_text().count("waitForTimeout(") for path in specs)


def fetches(root: Path) -> int:
    """Return how many requests of the page name the type of their answer by hand."""
    sources = page_files(root, ".ts", ".tsx")
    by_hand = re.compile(r"fetchJson<|\.json\(\)\)? as ")
    return sum(len(by_hand.findall(path.read_text())) for path in sources)


def share(found: list[Docstring], of: list[Docstring]) -> str:
    """Return a count with its share of all, for example `12 (3.1 %)`."""
    return f"{len(found)} ({100 * len(found) / max(len(of), 1):.1f} %)"


def figures(root: Path) -> dict[str, str]:
    """Return each figure of one state of the repository, by its name."""
    python, modules = list(docstrings(root)), python_files(root)
    page, pages = list(tsdocs(root)), page_files(root, ".ts", ".tsx")
    return {
        "server: modules": str(sum(path.name != "__init__.py" for path in modules)),
        "server: lines": str(lines(modules)),
        "server: modules whose only importer is a neighbour": str(len(neighbours(root))),
        "server: docstrings without a subject": share(
            [each for each in python if each.has_no_subject], python
        ),
        "server: docstrings of four words or fewer": share(
            [each for each in python if each.is_short], python
        ),
        "server: undocumented public classes and functions": str(len(undocumented(root))),
        "page: files": str(len(pages)),
        "page: files under 40 lines": str(sum(lines([path]) < FEW_LINES for path in pages)),
        "page: lines of TypeScript": str(lines(pages)),
        "page: lines of CSS": str(lines(page_files(root, ".css"))),
        "page: comments of documentation without a subject": share(
            [each for each in page if each.has_no_subject], page
        ),
        "page: answers typed by hand": str(fetches(root)),
        "documents: words": str(words(root)),
        "browser tests: waits for a time": str(waits(root)),
    }


GOALS: Final = {
    "server: modules": "≤ 370",
    "server: lines": "≤ 60000",
    "server: modules whose only importer is a neighbour": "≤ 30",
    "server: docstrings without a subject": "≤ 4 %",
    "server: docstrings of four words or fewer": "≤ 1.5 %",
    "page: files": "≤ 430",
    "page: files under 40 lines": "≤ 40",
    "page: lines of TypeScript": "≤ 51000",
    "page: lines of CSS": "≤ 9000",
    "page: answers typed by hand": "0",
    "documents: words": "≤ 55000",
    "browser tests: waits for a time": "0",
}


def main(commit: str = BEFORE) -> None:
    """Print the table."""
    archive = subprocess.run(
        ["git", "archive", commit, "server", "frontend/src", "frontend/e2e", "docs"],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        check=True,
    ).stdout
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(fileobj=BytesIO(archive)) as tar:
            tar.extractall(folder, filter="data")
        before = figures(Path(folder))
    now = figures(ROOT)
    rows = [("", commit, "now", "goal")]
    rows += [(name, before[name], value, GOALS.get(name, "")) for name, value in now.items()]
    widths = [max(len(row[column]) for row in rows) for column in range(4)]
    for name, *values in rows:
        cells = [f"{value:>{width}}" for value, width in zip(values, widths[1:], strict=True)]
        sys.stdout.write("  ".join([f"{name:<{widths[0]}}", *cells]).rstrip() + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
