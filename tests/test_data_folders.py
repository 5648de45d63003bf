"""Data folders of earlier versions: today's code opens them, and says of everything what was said then."""

import io
import lzma
import tarfile
from pathlib import Path
from typing import Any

import msgspec
import pytest

from journal.servers import Server
from support.product import TOKEN, Product, running
from support.used_server import Guest, answers, differences

FOLDERS = sorted(path for path in (Path(__file__).parent / "data" / "folders").glob("2*"))
#: Answers with other words since: Stop by a person or a program comes first (decision 22).
REWORDED = {
    "Go had not reported its end when root pressed Stop.": "root sent Stop from a program while Go ran (0.0 s)."
}


def unpacked(file: Path, data: Path) -> None:
    """A data folder as it was."""
    with tarfile.open(fileobj=io.BytesIO(lzma.decompress(file.read_bytes()))) as tar:
        tar.extractall(data, filter="data")


def told(folder: Path, name: str) -> Any:
    """Return a recorded answer of that version."""
    return msgspec.json.decode(lzma.decompress((folder / f"{name}.json.xz").read_bytes()))


@pytest.mark.parametrize("folder", FOLDERS, ids=[path.name for path in FOLDERS])
@pytest.mark.parametrize(
    "kind",
    ["SQLite", *(pytest.param(kind, marks=pytest.mark.long) for kind in ("Postgres", "a backup"))],
)
def test_all_data_of_an_earlier_version_are_there(
    request: pytest.FixtureRequest, tmp_path: Path, folder: Path, kind: str
) -> None:
    data, flags = tmp_path / "data", []
    name = "postgres" if kind == "Postgres" else "sqlite"
    unpacked(folder / f"{name}.tar.xz", data)
    if kind == "Postgres":
        postgres: Server = request.getfixturevalue("postgres")
        dump = postgres.home / "dump.sql"
        dump.write_bytes(lzma.decompress((folder / "postgres.sql.xz").read_bytes()))
        flags = ["--database", postgres.load(dump)]
    if kind == "a backup":
        for journal in ("editor", "runner"):
            (data / f"{journal}.db").unlink()
        restored = Product(data).cli("restore", str(folder / "sqlite.zip"), "--data", str(data))
        assert restored.returncode == 0, restored.stderr
    then = told(folder, name)
    with running(data, *flags) as product:
        now = answers(product, TOKEN)
        for person in then["answers"]["/api/people"]:
            del person["color"]  # of who is here, not of what was left (decision 57)
        for run in then["answers"]["/api/runs"]:
            run["cause"] = REWORDED.get(run["cause"], run["cause"])
        assert list(differences(then["answers"], now)) == []
        for link in then["links"]:
            with Guest(product, "Zoe", {"invitation": link}) as guest:
                assert guest.person["name"] == "Zoe"
    verified = product.cli("verify", "--data", str(data), *flags)
    assert verified.returncode == 0, verified.stdout
    assert "editor: " in verified.stdout
    assert "runner: " in verified.stdout


def test_there_is_one_to_begin_with() -> None:
    assert FOLDERS
