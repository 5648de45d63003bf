"""The command `diff`: files, moments and versions, and its exit codes."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.product import Product, running

PAIR = {"graph_name": "pair", "actions": [{"name": "Dock", "type": "sync"}]}


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """One server for the module."""
    with running(tmp_path_factory.mktemp("diff") / "data") as found:
        yield found


def _file(folder: Path, name: str, graph: object) -> str:
    path = folder / name
    path.write_text(json.dumps(graph))
    return str(path)


def test_files_are_compared_without_a_server(tmp_path: Path) -> None:
    alone = Product(tmp_path)
    one = _file(tmp_path, "one", PAIR)
    other = _file(tmp_path, "other", PAIR | {"graph_name": "duo"})
    same = alone.cli("diff", one, one)
    assert (same.returncode, same.stdout) == (0, "")
    found = alone.cli("diff", one, other)
    assert (found.returncode, found.stdout) == (1, '~ graph\n    name: "pair" -> "duo"\n')
    told = json.loads(alone.cli("diff", one, other, "--json").stdout)
    assert told["fields"] == [{"field": "name", "before": "pair", "after": "duo"}]


def test_an_unreadable_graph_is_neither_same_nor_different(
    tmp_path: Path, product: Product
) -> None:
    one = _file(tmp_path, "one", PAIR)
    bad = _file(tmp_path, "bad", [])
    answer = product.cli("diff", one, bad)
    assert (answer.returncode, answer.stdout) == (2, "")
    assert answer.stderr.count("\n") == 1
    answer = product.cli("diff", one, "nothing")
    assert answer.returncode == 2
    assert "no file, no graph and no version" in answer.stderr


def test_moments_of_a_graph_know_what_was_renamed(tmp_path: Path, product: Product) -> None:
    one = _file(tmp_path, "one", PAIR)
    graph = product.cli("import", one).stdout.split()[0]
    with product.editor() as editor:
        version = editor.post(f"/api/graphs/{graph}/versions").json()["id"]
        editor.patch(f"/api/graphs/{graph}", json={"name": "duo"})
    renamed = '~ graph\n    name: "pair" -> "duo"\n'
    for before, after in ((f"{graph}@1", graph), (one, graph), (version, f"{graph}@2")):
        found = product.cli("diff", before, after, "--without-looks")
        assert (found.returncode, found.stdout) == (1, renamed), found.stderr
    assert product.cli("diff", f"{graph}@1", version).returncode == 0
