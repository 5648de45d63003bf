"""Whatever lies in the working folder: nothing of it is run, by no process of ours."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

from support.product import COMMAND, PROGRAM, Product

#: Modules that some process of ours imports, early or late, of ours, of others and of Python itself.
_MODULES: Final = (
    *("segno", "uvicorn", "sqlalchemy", "alembic", "litestar", "msgspec", "httpx", "anyio"),
    *("action_assistant", "pycrdt", "websockets", "rclpy", "temoto_msgs", "numpy", "yaml"),
    *("json", "multiprocessing", "selectors", "socket", "pickle", "resource", "asyncio", "pkgutil"),
    *("sitecustomize", "usercustomize", "runpy", "signal", "encodings", "re", "gc_of_nobody"),
)
GRAPH = {
    "graph_name": "trap",
    "graph_entry": [{"name": "A", "instance_id": 0}],
    "graph_exit": [{"name": "A", "instance_id": 0}],
    "actions": [{"name": "A", "instance_id": 0, "type": "sync", "effect": "synchronous"}],
}


@pytest.fixture
def traps(tmp_path: Path) -> Path:
    """A folder full of modules that write down who ran them, and then do harm."""
    folder = tmp_path / "work"
    folder.mkdir()
    for number, name in enumerate(_MODULES):
        text = (
            f"import os\nwith open({str(tmp_path / 'ran')!r}, 'a') as out:\n"
            f"    out.write({name!r} + chr(10))\nraise ImportError('a trap')\n"
        )
        if number % 2:
            (folder / name).mkdir()
            (folder / name / "__init__.py").write_text(text)
        else:
            (folder / f"{name}.py").write_text(text)
    return folder


def ran(traps: Path) -> list[str]:
    """Return the traps that were run."""
    told = traps.parent / "ran"
    return told.read_text().split() if told.exists() else []


def test_serve_and_all_that_it_starts_run_nothing_of_it(traps: Path) -> None:
    product = Product(traps.parent / "data", program=PROGRAM, folder=traps)
    try:
        product.start()
        file = traps / "trap.json"
        file.write_text(json.dumps(GRAPH))
        made = product.cli("import", str(file))
        assert made.returncode == 0, made.stderr
        # A start is prepared by workers, which a server process forks.
        run = product.cli("run", made.stdout.split()[0])
        assert run.returncode == 0, run.stderr
    finally:
        product.end()
    assert ran(traps) == []


@pytest.mark.long
@pytest.mark.parametrize("arguments", [("doctor", "--json"), ("migrate",)])
def test_no_command_runs_anything_of_it(traps: Path, arguments: tuple[str, ...]) -> None:
    product = Product(traps.parent / "data", program=PROGRAM, folder=traps)
    answer = product.cli(*arguments, "--data", str(product.data))
    assert "Traceback" not in answer.stderr
    assert ran(traps) == []


def without(traps: Path, *names: str) -> None:
    """Take some of them away."""
    for name in names:
        (traps / f"{name}.py").unlink(missing_ok=True)
        shutil.rmtree(traps / name, ignore_errors=True)


#: Python imports these by itself when it starts, and then this program.
_FIRST: Final = ("action_assistant", "encodings", "sitecustomize", "usercustomize", "re", "runpy")


@pytest.mark.parametrize("path", [os.pathsep, "."])
def test_not_by_a_pythonpath_that_names_it_without_saying_so(traps: Path, path: str) -> None:
    """An empty entry is the working folder: `PYTHONPATH=$PYTHONPATH:/more` makes one. Python itself
    takes the modules of its own start from there; what we import is ours to say."""
    without(traps, *_FIRST)
    answer = subprocess.run(
        [*PROGRAM, "doctor", "--only", "machine", "--data", str(traps.parent / "data")],
        cwd=traps,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "Traceback" not in answer.stderr
    assert ran(traps) == []


def test_started_as_a_module_it_takes_the_folder_off_the_path_before_anything_else(
    traps: Path,
) -> None:
    """Python has put it there by then, and looked for this program in it."""
    without(traps, *_FIRST)
    answer = subprocess.run(
        [*COMMAND, "--version"], cwd=traps, capture_output=True, text=True, check=False
    )
    assert answer.returncode == 0, answer.stderr
    assert ran(traps) == []


def test_processes_that_start_python_exclude_the_working_folder(tmp_path: Path) -> None:
    """Whatever a process of ours starts inherits that, also what others write."""
    (tmp_path / "pickle.py").write_text("raise ImportError('a trap')")
    program = (
        "import sys; sys.argv[:] = ['action-assistant', '--version']; "
        "from action_assistant.__main__ import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "import subprocess; subprocess.run([sys.executable, '-c', 'import pickle'], check=True)"
    )
    shown = subprocess.run(
        [sys.executable, "-P", "-c", program],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert shown.returncode == 0, shown.stderr
