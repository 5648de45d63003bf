"""The page's own TypeScript in a real Node, for tests of what crosses the wire."""

import json
import re
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest

from action_assistant.umrf.model import Graph

ROOT = Path(__file__).parents[2]
FRONTEND = ROOT / "frontend"
DRIVER = ROOT / "tests" / "wire" / "page.mjs"


class Page:
    """One Node process; a request is an operation of `page.mjs` and its arguments."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process

    def __call__(self, op: str, **arguments: object) -> Any:
        """Ask and wait for the answer."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps({"op": op, **arguments}) + "\n")
        self._process.stdin.flush()
        answer = json.loads(self._process.stdout.readline() or '{"error": "the page ended"}')
        if "error" in answer:
            raise AssertionError(answer["error"])
        return answer

    def read(self, update: bytes) -> Graph:
        """The graph that the page sees in an update."""
        return graph_of(self("read", update=update.hex())["graph"])


def graph_of(value: object) -> Graph:
    """A graph from the names that TypeScript gives its fields."""
    return msgspec.convert(_snake(value), Graph)


def _snake(value: object) -> object:
    match value:
        case Mapping():
            return {_snake_name(key): _snake(member) for key, member in value.items()}
        case list():
            return [_snake(item) for item in value]
        case _:
            return value


def _snake_name(name: str) -> str:
    return re.sub("[A-Z]", lambda letter: f"_{letter[0].lower()}", name)


@contextmanager
def open_page() -> Iterator[Page]:
    """Starts Node with the page's code; skips where neither is installed."""
    fetched = FRONTEND.parent / ".node" / "bin" / "node"  # by scripts/with-node
    node = str(fetched) if fetched.exists() else shutil.which("node")
    if node is None or not (FRONTEND / "node_modules" / "yjs").is_dir():
        pytest.skip("needs Node and the page's packages: make setup")
    process = subprocess.Popen(
        [node, str(DRIVER), str(FRONTEND)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        yield Page(process)
    finally:
        process.communicate(timeout=20)
