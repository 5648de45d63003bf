"""What a worker finds in itself."""

import gc
import os
import sys
from pathlib import Path


def look(opened: int, path: str) -> str:
    """Whether this process has modules that only its maker imported (`colorsys`), garbage collection,
    and the file at `path` that its maker had open under this number."""
    shared = "shared" if "colorsys" in sys.modules else "anew"
    collects = "collects" if gc.isenabled() else "keeps"
    try:
        is_open = str(Path(f"/proc/self/fd/{opened}").readlink()) == path
    except OSError:
        is_open = False
    return f"imports {shared}, {collects} garbage, has {'a file' if is_open else 'nothing'} open"


def parent() -> int:
    """The process that forked this one."""
    return os.getppid()
