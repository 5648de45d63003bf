"""Commands against a running server: import, export, graphs, runs, run, stop."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from action_assistant.umrf import codec
from action_assistant.umrf.digest import digest
from support.product import Product, running

QUICK = {"behaviours": {"*": [{"after_s": 0.05}]}}
ENDLESS = {"behaviours": {"*": [{"never": True}]}}
GRAPH = {
    "graph_name": "pair",
    "graph_entry": [{"name": "A"}],
    "graph_exit": [{"name": "B"}],
    "actions": [
        {"name": "A", "type": "sync", "children": [{"name": "B"}]},
        {"name": "B", "type": "sync", "parents": [{"name": "A"}]},
    ],
}


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """One server for the module."""
    with running(tmp_path_factory.mktemp("remote") / "data") as found:
        yield found


@pytest.fixture
def files(tmp_path: Path) -> dict[str, str]:
    """Files by what they are."""
    found = {"graph": GRAPH, "quick": QUICK, "endless": ENDLESS}
    for name, value in found.items():
        (tmp_path / name).write_text(json.dumps(value))
    return {name: str(tmp_path / name) for name in found}


def imported(product: Product, file: str) -> str:
    """The id of a graph imported from a file."""
    answer = product.cli("import", file)
    assert answer.returncode == 0, answer.stderr
    return answer.stdout.split()[0]


def test_a_file_comes_back_with_the_same_meaning(product: Product, files: dict[str, str]) -> None:
    graph = imported(product, files["graph"])
    assert graph in product.cli("graphs").stdout
    exported = product.cli("export", graph)
    assert digest(codec.read(exported.stdout).graph) == digest(codec.read(json.dumps(GRAPH)).graph)


def test_a_run_is_waited_for_and_listed(product: Product, files: dict[str, str]) -> None:
    graph = imported(product, files["graph"])
    answer = product.cli("run", graph, "--script", files["quick"])
    assert answer.returncode == 0, answer.stderr + answer.stdout
    run = answer.stdout.split()[0]
    assert answer.stdout.splitlines()[-1] == "finished (on_true)"
    (listed,) = json.loads(product.cli("runs", "--graph", graph, "--json").stdout)
    assert (listed["id"], listed["state"], listed["result"]) == (run, "finished", "on_true")


def test_a_run_is_stopped_and_that_is_proven(product: Product, files: dict[str, str]) -> None:
    graph = imported(product, files["graph"])
    run = product.cli("run", graph, "--script", files["endless"], "--no-wait").stdout.strip()
    answer = product.cli("stop", run)
    assert (answer.returncode, answer.stdout) == (0, "stopped\n")
    with product.runner() as runner:
        assert runner.get(f"/api/runs/{run}").json()["state"] == "stopped"


def test_the_answer_no_is_exit_code_1_and_one_sentence(
    product: Product, files: dict[str, str], tmp_path: Path
) -> None:
    for arguments in (
        ["export", "nothing"],
        ["run", "nothing"],
        ["stop", "nothing"],
        ["import", files["quick"]],
        ["run", imported(product, files["graph"]), "--engine", "nobody"],
    ):
        answer = product.cli(*arguments)
        assert answer.returncode == 1, arguments
        assert len(answer.stderr.splitlines()) == 1, answer.stderr


def test_without_a_server_it_says_how_to_start_one(tmp_path: Path) -> None:
    answer = Product(tmp_path).cli("graphs")
    assert answer.returncode == 2
    assert "action-assistant serve" in answer.stderr
