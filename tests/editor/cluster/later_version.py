"""The command of a later version, whose migrations are another folder: `later_version.py MIGRATIONS WORDS …`."""

import sys
from pathlib import Path

from action_assistant import paths
from action_assistant.cli import main

if __name__ == "__main__":
    folder = Path(sys.argv.pop(1))
    setattr(paths, "migrations", lambda: folder)  # noqa: B010 - mypy takes no assignment to a function
    sys.exit(main())
