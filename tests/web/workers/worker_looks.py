"""Functions by which tests ask a worker what it finds in itself."""

import gc
import os
import sys
import time
from pathlib import Path


def look(opened: int, path: str) -> str:
    """Return a sentence that says whether this process has modules that only its maker imported
    (`colorsys`), collects garbage, and has the file at `path` open as `opened`, as its maker had."""
    shared = "shared" if "colorsys" in sys.modules else "anew"
    collects = "collects" if gc.isenabled() else "keeps"
    try:
        is_open = str(Path(f"/proc/self/fd/{opened}").readlink()) == path
    except OSError:
        is_open = False
    return f"imports {shared}, {collects} garbage, has {'a file' if is_open else 'nothing'} open"


def parent() -> int:
    """Return the id of the process that forked this one."""
    return os.getppid()


def forget() -> None:
    """Drop the sockets that the program had when it forked the process that forked this one."""
    vars(sys.modules["__main__"])["held"].clear()
    gc.collect()


def slept(seconds: float) -> float:
    """Take some time, and return it."""
    time.sleep(seconds)
    return seconds
