"""Records a data folder as the first version with the log of today wrote it: no links yet, no backups.

    git archive 4e338f0e server migrations pyproject.toml | tar x -C /tmp/then
    PYTHONPATH=/tmp/then/server:tests .venv/bin/python -m record_first tests/data/folders/first

What it wrote never changes; it is at `editor_0001` and `runner_0001`.
"""

import asyncio
import io
import lzma
import sys
import tarfile
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import msgspec

from support import used_server
from support.product import TOKEN, Product
from support.used_server import Guest


def answers(editor: httpx.Client, runner: httpx.Client) -> dict[str, Any]:
    """Return the server's answers about its graphs, versions and runs, by path."""
    said = {}

    def ask(client: httpx.Client, path: str) -> Any:
        answer = client.get(path)
        assert answer.status_code == 200, (path, answer.text)
        said[path] = answer.json()
        return said[path]

    for graph in ask(editor, "/api/graphs"):
        for what in ("umrf", "versions"):
            ask(editor, f"/api/graphs/{graph['id']}/{what}")
        for version in said[f"/api/graphs/{graph['id']}/versions"]:
            ask(editor, f"/api/versions/{version['id']}")
    for run in ask(runner, "/api/runs"):
        ask(runner, f"/api/runs/{run['id']}")
    return said


async def draw(product: Product, editor: httpx.Client) -> str:
    """Draw as people could at that version, and return the graph that has versions."""
    with (
        Guest(product, "Ann", {"token": TOKEN}) as ann,
        Guest(product, "Ben", {"token": TOKEN}) as ben,
    ):
        graphs = used_server.made(editor)
        await used_server.draw(editor, graphs, ann, ben)
        used_server.published(editor, graphs, ann, ben)
    return graphs[0]


def run(graph: str, editor: httpx.Client, runner: httpx.Client) -> None:
    """Runs that end well, badly, and by a stop."""
    version = editor.get(f"/api/graphs/{graph}/versions").json()[0]["id"]
    whole = editor.get(f"/api/versions/{version}").json()
    for number, behaviour in enumerate(
        ({"after_s": 0.05}, {"after_s": 0.05, "result": "on_error"}, {"never": True})
    ):
        start = {
            "version": version,
            "digest": whole["digest"],
            "umrf": whole["umrf"],
            "engine": "simulator",
            "request_id": f"request-{number}",
            "script": {"behaviours": {"*": [behaviour]}},
        }
        started = runner.post("/api/runs", json=start)
        assert started.status_code == 201, started.text
        made = started.json()["id"]
        if "never" in behaviour:
            used_server.eventually(partial(used_server.says, runner, made, "started_at"))
            runner.post(f"/api/runs/{made}/stop").raise_for_status()
        used_server.eventually(partial(used_server.says, runner, made, "ended_at"))


def main() -> None:
    """Record it."""
    folder = Path(sys.argv[1]).resolve()
    folder.mkdir(parents=True)
    with tempfile.TemporaryDirectory() as there:
        data = Path(there) / "data"
        data.mkdir()
        (data / "token").write_text(TOKEN + "\n")
        product = Product(data)
        product.start()
        try:
            with product.editor() as editor, product.runner() as runner:
                run(asyncio.run(draw(product, editor)), editor, runner)
                said = answers(editor, runner)
        finally:
            product.end()
        packed = io.BytesIO()
        with tarfile.open(fileobj=packed, mode="w") as tar:
            for path in sorted(data.rglob("*")):
                if path.is_file() and not path.name.endswith((".lock", "-shm")):
                    tar.add(path, path.relative_to(data).as_posix())
        (folder / "sqlite.tar.xz").write_bytes(lzma.compress(packed.getvalue()))
        (folder / "sqlite.json.xz").write_bytes(lzma.compress(msgspec.json.encode(said)))


if __name__ == "__main__":
    main()
