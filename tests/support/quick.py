"""Run what a change needs before it is committed: lint, types and the tests of its area.

    python -m support.quick [AREA]

AREA is a folder of the server (`runner/stop`, `umrf`) or of the page (`frontend/src/outline`). Without
it, the areas are those of the files that differ from `main`, committed or not. The exit code is 1 when
a step failed.
"""

import subprocess
import sys
import time
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[2]
SERVER: Final = "server/action_assistant"
PAGE: Final = "frontend/src"
NODE: Final = "../scripts/with-node"
PYTHON_SUFFIXES: Final = {".py", ".toml"}
PROCESSES: Final = "4"


def changed() -> list[str]:
    """Return the paths of the files that differ from `main` or are new, relative to the repository."""
    base = subprocess.check_output(["git", "merge-base", "main", "HEAD"], cwd=ROOT, text=True)
    tracked = ["git", "diff", "--name-only", "--diff-filter=d", base.strip()]
    new = ["git", "ls-files", "--others", "--exclude-standard"]
    return [
        path
        for command in (tracked, new)
        for path in subprocess.check_output(command, cwd=ROOT, text=True).splitlines()
    ]


def files_of(area: str) -> list[str]:
    """Return the source files of one folder; raise `SystemExit` where there is no such folder."""
    for folder in (ROOT / area, ROOT / SERVER / area, ROOT / PAGE / area):
        if folder.is_dir():
            return [
                str(path.relative_to(ROOT))
                for path in folder.rglob("*")
                if path.suffix in {".py", ".ts", ".tsx", ".css"}
            ]
    raise SystemExit(f"no folder {area} in the repository, in {SERVER} or in {PAGE}")


def tests_of(paths: list[str]) -> list[str]:
    """Return the test files and folders of the server that belong to these files.

    Tests mirror the folders of the server: those of `runner/stop/proof.py` are in `tests/runner/stop`.
    A folder inside another one that is returned as well is left out.
    """
    found = set[Path]()
    for path in map(Path, paths):
        if path.suffix != ".py":
            continue
        if path.parts[0] == "tests":
            if path.name.startswith("test_") and "ros" not in path.parts:
                found.add(path)
        elif path.is_relative_to(SERVER):
            mirrored = Path("tests") / path.relative_to(SERVER).parent
            while not (ROOT / mirrored).is_dir():
                mirrored = mirrored.parent
            if mirrored == Path("tests"):
                named = mirrored / f"test_{path.name}"
                found |= {named} if (ROOT / named).exists() else set()
            else:
                found.add(mirrored)
    return sorted(str(each) for each in found if not found & set(each.parents))


def steps(paths: list[str]) -> list[tuple[str, Path, list[str]]]:
    """Return what has to pass: the name of each step, its folder and its command."""
    bin_folder = str(ROOT / ".venv/bin")
    server = any(Path(path).suffix in PYTHON_SUFFIXES for path in paths)
    page = [path for path in paths if path.startswith("frontend/")]
    names = ("tree", "references", "glossary", "language")
    structure = [f"tests/test_{name}.py" for name in names]
    pytest = [f"{bin_folder}/pytest", "-q", "--numprocesses", PROCESSES, "--dist", "loadfile"]
    found = []
    if server:
        found += [
            ("ruff format", ROOT, [f"{bin_folder}/ruff", "format", "--check", "--quiet", "."]),
            ("ruff", ROOT, [f"{bin_folder}/ruff", "check", "--quiet", "."]),
            ("mypy", ROOT, [f"{bin_folder}/mypy"]),
            ("layers", ROOT, [f"{bin_folder}/lint-imports", "--no-logo"]),
        ]
    found.append(("structure and tests", ROOT, [*pytest, *structure, *tests_of(paths)]))
    if page:
        frontend, modules = ROOT / "frontend", "node_modules/.bin"
        sources = [
            path.removeprefix("frontend/") for path in page if path.endswith((".ts", ".tsx"))
        ]
        vitest = [NODE, f"{modules}/vitest", "related", "--run", "--reporter=dot", *sources]
        found += [
            ("tsc", frontend, [NODE, f"{modules}/tsc", "--noEmit"]),
            ("Biome", frontend, [NODE, f"{modules}/biome", "check", "."]),
            *([("vitest", frontend, vitest)] if sources else []),
        ]
    return found


def say(text: str) -> None:
    """Write one line at once, so that it stands in order among what the steps write."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def main(area: str = "") -> int:
    """Run the steps, say how long each took, and return the exit code."""
    paths = files_of(area) if area else changed()
    if not paths:
        say("Nothing differs from main; name a folder: make quick AREA=runner/stop")
        return 0
    failed = []
    for name, folder, command in steps(paths):
        start = time.monotonic()
        done = subprocess.run(command, cwd=folder, check=False)
        say(f"» {name}: {time.monotonic() - start:.0f} s")
        if done.returncode:
            failed.append(name)
    if failed:
        say(f"failed: {', '.join(failed)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
