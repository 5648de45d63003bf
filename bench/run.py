"""`make bench`: runs the benchmarks named as arguments, or all, and prints their tables.

A benchmark is a module of this folder with `TITLE` and `tables() -> Iterator[Table]`.
"""

import importlib
import platform
import sys
from pathlib import Path

FOLDER = Path(__file__).parent
sys.path.insert(0, str(FOLDER))

from table import show  # noqa: E402 - the folder is no package


def main(names: list[str]) -> int:
    """Exit code: 2 for a name that is no benchmark."""
    known = sorted(p.stem for p in FOLDER.glob("*.py") if "\nTITLE = " in p.read_text())
    if unknown := [name for name in names if name not in known]:
        sys.stderr.write(f"no benchmark: {', '.join(unknown)}; there are {', '.join(known)}\n")
        return 2
    sys.stdout.write(f"Python {platform.python_version()}, {platform.machine()}\n")
    for name in names or known:
        module = importlib.import_module(name)
        sys.stdout.write(f"\n{module.TITLE}\n")
        for table in module.tables():
            show(table)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
