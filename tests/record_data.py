"""Records a data folder as a version wrote it, for tests that open it with every later one.

    git archive TAG server migrations pyproject.toml | tar x -C /tmp/then
    PYTHONPATH=/tmp/then/server:tests .venv/bin/python -m record_data tests/data/folders/NAME

writes `sqlite.tar.xz` (a data folder), `postgres.tar.xz` (one whose graphs are in the database of
`postgres.sql.xz`), what that version answered about each, and its backup of the first. Recorded folders never change: they
are what people have on their disks.
"""

import asyncio
import io
import lzma
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

import msgspec

from journal.servers import Server, server
from support.product import TOKEN, Product
from support.used_server import answers, live


def record(folder: Path, name: str, *flags: str) -> None:
    """Live in a new data folder, and write down what is in it."""
    folder = folder.resolve()
    with tempfile.TemporaryDirectory() as there:
        data = Path(there) / "data"
        data.mkdir()
        (data / "token").write_text(TOKEN + "\n")
        product = Product(data, *flags)
        product.start()
        try:
            links = asyncio.run(live(product, TOKEN))
            said = answers(product, TOKEN)
            if not flags:
                product.cli("backup", str(folder / f"{name}.zip"), "--data", str(data))
        finally:
            product.end()
        packed = io.BytesIO()
        with tarfile.open(fileobj=packed, mode="w") as tar:
            for path in sorted(data.rglob("*")):
                if path.is_file() and not path.name.endswith((".lock", "-shm")):
                    tar.add(path, path.relative_to(data).as_posix())
        (folder / f"{name}.tar.xz").write_bytes(lzma.compress(packed.getvalue()))
        told = msgspec.json.encode({"links": links, "answers": said})
        (folder / f"{name}.json.xz").write_bytes(lzma.compress(msgspec.json.format(told)))


def dumped(postgres: Server, url: str) -> bytes:
    """A database as SQL."""
    found = subprocess.run(
        [str(postgres.binaries / "pg_dump"), "--no-owner", "--inserts", "--dbname", url],
        check=True,
        capture_output=True,
    )
    lines = found.stdout.splitlines(keepends=True)  # some commands only the newest psql knows
    return b"".join(line for line in lines if not line.startswith(b"\\"))


def main() -> None:
    """Record both."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True)
    record(folder, "sqlite")
    with server() as postgres:
        url = postgres.new_database()
        record(folder, "postgres", "--database", url)
        (folder / "postgres.sql.xz").write_bytes(lzma.compress(dumped(postgres, url)))


if __name__ == "__main__":
    main()
