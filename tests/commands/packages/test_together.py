"""`package --together`: one package with all actions of a graph."""

from collections.abc import Callable
from pathlib import Path

from commands.packages.trees import everything

GRAPH = {
    "graph_name": "task",
    "graph_entry": [],
    "graph_exit": [],
    "actions": [
        {"name": "Drive", "instance_id": 0, "type": "sync"},
        {"name": "LookAt", "instance_id": 0, "type": "sync"},
        {"name": "Drive", "instance_id": 1, "type": "sync"},
    ],
}


def test_all_actions_of_a_graph_come_into_one_package(
    package: Callable[..., int], tmp_path: Path
) -> None:
    assert package(GRAPH, "--together", "kitchen") == 0
    assert [each.name for each in (tmp_path / "out").iterdir()] == ["kitchen"]
    made = everything(tmp_path / "out/kitchen")
    assert {"src/drive.cpp", "src/look_at.cpp", ".generated.json"} <= made.keys()
    assert package(GRAPH, "--together", "kitchen", "--check") == 0


def test_an_action_less_is_told_and_removed(package: Callable[..., int], tmp_path: Path) -> None:
    package(GRAPH, "--together", "kitchen")
    assert package(GRAPH, "--together", "kitchen", "--name", "Drive", "--check") == 1
    assert package(GRAPH, "--together", "kitchen", "--name", "Drive") == 0
    left = everything(tmp_path / "out/kitchen")
    assert not [path for path in left if "look_at" in path]
    assert b"look_at" not in left["CMakeLists.txt"]


def test_a_name_that_leads_out_of_the_folder_is_refused(
    package: Callable[..., int], tmp_path: Path
) -> None:
    assert package(GRAPH, "--together", "../up") == 1
    assert not (tmp_path / "up").exists()
    assert not (tmp_path / "out").exists()
