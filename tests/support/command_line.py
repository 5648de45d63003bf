"""Commands of this program, run inside the process of a test.

A process of its own takes half a second to a whole one only to load. Signals, working folders and the
death of a command are tested with processes: `support.product.COMMAND`.
"""

import io
import logging
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from action_assistant.cli import main


def ran(
    *words: str | Path, environ: Mapping[str, str] | None = None
) -> "subprocess.CompletedProcess[str]":
    """Run a command, and return its exit code and what it wrote. `environ`: its environment, else
    that of the test. It leaves environment, streams and log as they were."""
    out, told = _stream(), _stream()
    with _apart(environ if environ is not None else os.environ, out, told):
        try:
            code = main([str(each) for each in words])
        except SystemExit as ended:  # of argparse: --help, wrong words
            code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    return subprocess.CompletedProcess([str(each) for each in words], code, _text(out), _text(told))


def seconds_of(*words: str | Path) -> float:
    """Return how long a command that has to succeed takes in a process of its own, from start to end."""
    begun = time.monotonic()
    command = [sys.executable, "-m", "action_assistant", *map(str, words)]
    subprocess.run(command, check=True, capture_output=True, timeout=110)
    return time.monotonic() - begun


def _stream() -> io.TextIOWrapper:
    return io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True)


def _text(stream: io.TextIOWrapper) -> str:
    stream.seek(0)
    return stream.read()


@contextmanager
def _apart(
    environ: Mapping[str, str], out: io.TextIOWrapper, told: io.TextIOWrapper
) -> Iterator[None]:
    """Set environment and streams inside of the block, and undo what a command changes for all."""
    kept, streams, root = dict(os.environ), (sys.stdout, sys.stderr), logging.getLogger()
    handlers, level = root.handlers[:], root.level
    given = dict(environ)
    os.environ.clear()
    os.environ.update(given)
    sys.stdout, sys.stderr = out, told
    root.handlers[:] = []
    try:
        yield
    finally:
        root.handlers[:] = handlers
        root.setLevel(level)
        sys.stdout, sys.stderr = streams
        os.environ.clear()
        os.environ.update(kept)
