"""The commands `import`, which fills the library, and `package`, which takes actions out of it."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from support.product import Product, running


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """One server for the module."""
    with running(tmp_path_factory.mktemp("imports") / "data") as found:
        yield found


def action(name: str, kind: str = "number") -> str:
    takes = {"speed": {"pvf_type": kind}}
    return json.dumps({"name": name, "type": "sync", "input_parameters": takes})


def library(product: Product) -> dict[str, dict[str, Any]]:
    with product.editor() as editor:
        listed = editor.get("/api/actions").json()
    return {each["name"]: each for each in listed if each["document"] is not None}


def written(folder: Path, **files: str) -> Path:
    for name, text in files.items():
        path = folder / name.replace("__", "/")
        path = path.with_name(f"{path.name}.umrf.json")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


def test_the_file_of_an_action_goes_into_the_library(product: Product, tmp_path: Path) -> None:
    written(tmp_path, go=action("GoAlone"))
    answer = product.cli("import", str(tmp_path / "go.umrf.json"))
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.split() == [library(product)["GoAlone"]["document"], "GoAlone"]


def test_all_actions_of_a_folder_are_imported_except_those_that_colcon_ignores(
    product: Product, tmp_path: Path
) -> None:
    graph = {"graph_name": "g", "graph_entry": [], "graph_exit": [], "actions": []}
    written(
        tmp_path,
        src__ta_one__one=action("OfWorkspaceOne"),
        src__ta_two__two=action("OfWorkspaceTwo"),
        src__graph=json.dumps(graph),
        build__ta_one__one=action("OfBuild"),
        hidden__x=action("OfHidden"),
    )
    (tmp_path / "build" / "COLCON_IGNORE").touch()
    (tmp_path / "hidden").rename(tmp_path / ".hidden")
    answer = product.cli("import", str(tmp_path))
    assert answer.returncode == 0, answer.stderr
    assert "is a graph, and was left alone" in answer.stderr
    known = library(product)
    assert {"OfWorkspaceOne", "OfWorkspaceTwo"} <= known.keys()
    assert known.keys().isdisjoint({"OfBuild", "OfHidden"})
    assert product.cli("import", str(tmp_path)).stdout.count("is in the library") == 2


def test_an_action_that_differs_is_replaced_only_when_that_is_asked_for(
    product: Product, tmp_path: Path
) -> None:
    written(tmp_path, turn=action("Turn"))
    file = str(tmp_path / "turn.umrf.json")
    product.cli("import", file)
    written(tmp_path, turn=action("Turn", "string"))
    answer = product.cli("import", file)
    assert answer.returncode == 1
    assert "is in the library, and differs" in answer.stderr
    assert library(product)["Turn"]["inputs"][0]["pvf_type"] == "number"
    answer = product.cli("import", "--update", file)
    assert (answer.returncode, "(updated)" in answer.stdout) == (0, True)
    assert library(product)["Turn"]["inputs"][0]["pvf_type"] == "string"


def test_an_unreadable_file_is_named_and_the_others_are_imported(
    product: Product, tmp_path: Path
) -> None:
    written(tmp_path, a="{", b=action("AfterAll"), c=action("AfterAll", "string"))
    answer = product.cli("import", str(tmp_path))
    assert answer.returncode == 1
    assert "a.umrf.json" in answer.stderr
    assert "was read from" in answer.stderr
    assert "AfterAll" in library(product)
    assert product.cli("import", str(tmp_path / "none")).returncode == 2


def test_packages_are_made_of_the_library_by_name(product: Product, tmp_path: Path) -> None:
    written(tmp_path, lift=action("LiftBox"), drop=action("DropBox"))
    product.cli("import", str(tmp_path))
    answer = product.cli("package", "--name", "LiftBox", "--output", str(tmp_path / "src"))
    assert answer.returncode == 0, answer.stderr
    assert [each.name for each in (tmp_path / "src").iterdir()] == ["lift_box"]
    file = json.loads((tmp_path / "src/lift_box/lift_box.umrf.json").read_text())
    assert file["input_parameters"] == {"speed": {"pvf_type": "number"}}
    unknown = product.cli("package", "--name", "Nothing", "--output", str(tmp_path / "src"))
    assert (unknown.returncode, "no action 'Nothing'" in unknown.stderr) == (1, True)
    assert product.cli("package", "--output", str(tmp_path / "src")).returncode == 2
