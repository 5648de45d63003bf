"""`make performance`: measures, and writes the tables into docs/performance.md.

The text between the tables is ours; each table stands between two marks that name its benchmark, and
only those named as arguments (or all) are measured again.
"""

import datetime
import importlib
import json
import os
import platform
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).parent
PAGE: Final = FOLDER.parent / "docs" / "performance.md"
FRAMES: Final = FOLDER.parent / "frontend" / "test-results" / "speed.json"
QUIET: Final = 0.5  # load per core up to which a run counts as quiet
sys.path.insert(0, str(FOLDER))

from table import Table, lines  # noqa: E402 - the folder is no package


def main(names: list[str]) -> int:
    """Exit code: 2 for a name that has no place in the page."""
    known = re.findall(r"<!-- begin (\w+) -->", PAGE.read_text())
    if unknown := [name for name in names if name not in known]:
        sys.stderr.write(f"no place for {', '.join(unknown)}; there are {', '.join(known)}\n")
        return 2
    for name in names or known:
        sys.stderr.write(f"measuring {name}\n")
        place = re.compile(f"(<!-- begin {name} -->\n).*?(<!-- end {name} -->)", re.DOTALL)
        measured = block(name)
        # Read only now: somebody may have written in it meanwhile.
        page = place.sub(lambda found, text=measured: found[1] + text + found[2], PAGE.read_text())
        PAGE.write_text(page)
    return 0


def block(name: str) -> str:
    """The tables of one benchmark under a line that says where, when and how quietly."""
    before = load()
    found = browser() if name == "browser" else list(importlib.import_module(name).tables())
    noise = max(before, load())
    word = "quiet" if noise <= QUIET else "busy with other work, so only CPU time says something"
    head = (
        f"`make performance ARGS={name}`, {datetime.datetime.now(datetime.UTC):%Y-%m-%d %H:%M} UTC, "
        f"{facts()}; machine {word} (load {noise:.1f} per core).\n\n"
    )
    return head + "\n".join("\n".join(lines(table)) + "\n" for table in found)


def facts() -> str:
    """What the figures depend on."""
    ours = ", ".join(f"{name} {version(name)}" for name in ("uvicorn", "uvloop", "pycrdt"))
    return (
        f"{os.cpu_count()} cores {platform.machine()}, Python {platform.python_version()}, {ours}"
    )


def load() -> float:
    """How many others want each core."""
    return os.getloadavg()[0] / (os.cpu_count() or 1)


def browser() -> list[Table]:
    """Frames and operations in Chromium, by the page's own benchmark."""
    root = FOLDER.parent
    npm = [str(root / "scripts" / "with-node"), "npm", "--prefix", "frontend", "run", "--silent"]
    spec = [*npm, "e2e", "--", "e2e/speed.spec.ts"]
    subprocess.run(spec, cwd=root, env={**os.environ, "SPEED": "1"}, check=True)
    return [Table(each["head"], each["rows"]) for each in json.loads(FRAMES.read_text())]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
