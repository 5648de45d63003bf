"""Systems other than Linux, as far as they can be played here: what they lack is taken away, and every
module of ours is imported, and commands are run, in a process that is without it.

On a real macOS or Windows none of this was tried.
"""

import ast
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from action_assistant.cli import COMMANDS as WORDS
from action_assistant.cli import main
from support import elsewhere
from support.product import Product, free_ports, running

pytestmark = pytest.mark.usefixtures("new_interpreters")

PACKAGE = Path(__file__).parents[1] / "server" / "action_assistant"
EXAMPLES = sorted((PACKAGE / "examples").glob("*.json"))
#: Modules of the standard library that exist on POSIX alone.
POSIX = {*elsewhere.LACKS["win32"]["modules"]} - {"posix", "uvloop"}


def there(system: str, *words: str) -> "subprocess.CompletedProcess[str]":
    """A command on another system."""
    command = [sys.executable, elsewhere.__file__, system, *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=100)


def at_import(tree: ast.Module) -> Iterator[str]:
    """The modules that a file imports when it is imported itself."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import):
            yield from (each.name.partition(".")[0] for each in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module.partition(".")[0]
        elif not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            waiting += ast.iter_child_nodes(node)


def test_one_module_alone_imports_what_only_posix_has() -> None:
    wrong = {
        str(path.relative_to(PACKAGE)): names
        for path in PACKAGE.rglob("*.py")
        if (names := set(at_import(ast.parse(path.read_text()))) & POSIX)
    }
    assert wrong == {}, "action_assistant.system.posix has them"
    assert "importlib.import_module(name)" in (PACKAGE / "system" / "posix.py").read_text()


@pytest.mark.parametrize("system", ["win32", "darwin"])
def test_every_module_can_be_imported(system: str) -> None:
    answer = there(system)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert answer.stdout.endswith(", 0 failed\n")


def test_modules_that_the_other_system_lacks_cannot_be_imported() -> None:
    command = [sys.executable, "-c", "import sys; sys.path.insert(0, 'tests')\n"
               "from support.elsewhere import move_to; move_to('win32')\n"
               "import os\n"
               "try: import fcntl\n"
               "except ImportError: print(sys.platform, hasattr(os, 'fork'))"]  # fmt: skip
    answer = subprocess.run(
        command, cwd=PACKAGE.parents[1], capture_output=True, text=True, check=True
    )
    assert answer.stdout == "win32 False\n"


@pytest.mark.long
@pytest.mark.parametrize("system", ["win32", "darwin"])
def test_files_are_checked_converted_simulated_and_compared_as_on_linux(
    system: str, capfd: pytest.CaptureFixture[str]
) -> None:
    one, other = map(str, EXAMPLES[:2])
    commands = (
        ("check", one, other, "--json"),
        ("convert", one),
        ("convert", one, "--through-document"),
        ("simulate", one, "--trace"),
        ("diff", one, other),
        ("flatten", one),
    )
    answer = there(system, *[word for each in commands for word in ("+", *each)][1:])
    expected = []
    for words in commands:
        code = main(words)
        expected.append(f"{capfd.readouterr().out}\n+ {code}\n")
        assert len(expected[-1]) > 10
    assert answer.stdout == "".join(expected), answer.stderr


@pytest.mark.long
def test_packages_are_written_as_on_linux(tmp_path: Path) -> None:
    words = ("package", str(EXAMPLES[0]), "--output")
    again = (*words, str(tmp_path / "there"))
    answer = there("win32", *again, "+", *again)  # and once more over what is there
    assert answer.stdout.count("\n+ 0\n") == 2, answer.stdout + answer.stderr
    assert main([*words, str(tmp_path / "here")]) == 0
    made = {
        name: {
            str(each.relative_to(tmp_path / name)): each.read_bytes()
            for each in (tmp_path / name).rglob("*")
            if each.is_file()
        }
        for name in ("here", "there")
    }
    assert made["here"] == made["there"]
    assert made["here"]


def test_on_windows_commands_reach_a_server_and_nothing_is_served() -> None:
    refused = [name for name, entry in WORDS.items() if entry.posix]
    assert {"serve", "editor", "runner", "backup", "restore"} <= set(refused)
    answer = there("win32", "serve", "+", "migrate")
    assert answer.stdout.count("\n+ 2\n") == 2
    for name in ("serve", "migrate"):
        assert f"`{name}` needs Linux or macOS" in answer.stderr
    assert "docs/installing.md" in answer.stderr


@pytest.mark.long
def test_on_windows_a_graph_is_brought_to_a_server_and_run(tmp_path: Path) -> None:
    words = ("import", str(EXAMPLES[0]), "+", "graphs", "+", "stop", "--all", "+", "people", "list")
    with running(tmp_path / "data") as product:
        answer = subprocess.run(
            [sys.executable, elsewhere.__file__, "win32", *words],
            env=product.environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )
    assert answer.stdout.count("\n+ 0\n") == 4, answer.stdout + answer.stderr


@pytest.mark.parametrize(
    ("kind", "offset"), [pytest.param("editor", 0, marks=pytest.mark.long), ("runner", 1)]
)
def test_on_macos_both_processes_serve(tmp_path: Path, kind: str, offset: int) -> None:
    port = free_ports() + offset
    command = [sys.executable, elsewhere.__file__, "darwin", kind, "--data", str(tmp_path / "data")]
    log = tmp_path / "log"
    with (
        log.open("wb") as out,
        subprocess.Popen(
            [*command, "--port", str(port)], stderr=out, env=Product(tmp_path / "d").environment
        ) as process,
    ):
        try:
            deadline = time.monotonic() + 60
            while not _ready(port):
                assert process.poll() is None, log.read_text()
                assert time.monotonic() < deadline, log.read_text()
                time.sleep(0.05)
        finally:
            process.terminate()
        assert process.wait(20) in {0, -signal.SIGTERM}


def _ready(port: int) -> bool:
    try:
        return httpx.get(f"http://127.0.0.1:{port}/readyz", trust_env=False).status_code == 200
    except httpx.TransportError:
        return False
