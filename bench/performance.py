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
import time
from importlib.metadata import version
from pathlib import Path
from typing import Final

import psutil

FOLDER: Final = Path(__file__).parent
PAGE: Final = FOLDER.parent / "docs" / "performance.md"
FRAMES: Final = FOLDER.parent / "frontend" / "test-results" / "speed.json"
QUIET: Final = 0.1  # of the processors, used by others, up to which a run counts as quiet
LOOK: Final = 3.0  # seconds for which others are looked at
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
    others, paces = [used()], [pace()]
    found = browser() if name == "browser" else list(importlib.import_module(name).tables())
    others.append(used())
    paces.append(pace())
    word = "quiet" if max(others) <= QUIET else "busy"
    head = (
        f"`make performance ARGS={name}`, {datetime.datetime.now(datetime.UTC):%Y-%m-%d %H:%M} UTC, "
        f"{facts()}; {word} machine (others used {max(others):.0%}); "
        f"a million steps of Python took {paces[0]:.0f} ms before, {paces[1]:.0f} after.\n\n"
    )
    return head + "\n".join("\n".join(lines(table)) + "\n" for table in found)


def facts() -> str:
    """What the figures depend on."""
    ours = ", ".join(f"{name} {version(name)}" for name in ("uvicorn", "uvloop", "pycrdt"))
    return (
        f"{os.cpu_count()} cores {platform.machine()}, Python {platform.python_version()}, {ours}"
    )


def used() -> float:
    """The share of all processors that is used while nothing is measured."""
    return 1.0 - float(psutil.cpu_times_percent(interval=LOOK).idle) / 100.0


def pace() -> float:
    """Milliseconds that a million steps take, the best of five times: what else shares a processor's core may
    double it from one hour to the next, and `used` does not see that."""
    times = []
    for _ in range(5):
        started = time.perf_counter()
        total = 0
        for step in range(1_000_000):
            total += step * step
        times.append(time.perf_counter() - started)
    return min(times) * 1000.0


def browser() -> list[Table]:
    """Frames and operations in Chromium, by the page's own benchmark."""
    root = FOLDER.parent
    npm = [str(root / "scripts" / "with-node"), "npm", "--prefix", "frontend", "run", "--silent"]
    spec = [*npm, "e2e", "--", "e2e/speed.spec.ts"]
    subprocess.run(spec, cwd=root, env={**os.environ, "SPEED": "1"}, check=True)
    return [Table(each["head"], each["rows"]) for each in json.loads(FRAMES.read_text())]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
