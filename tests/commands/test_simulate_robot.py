"""`simulate-robot` where it cannot run, and what it reads before it does."""

import json
from pathlib import Path

import pytest

from action_assistant import cli
from action_assistant.commands.simulate_robot import _index, _texts
from action_assistant.runner.links.ros2.availability import why_not
from action_assistant.umrf.files import codec
from runner.harness import sequence


@pytest.mark.skipif(not why_not(), reason="rclpy is here, so it would run")
def test_without_rclpy_it_says_what_is_missing(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["simulate-robot", "David"]) == 2
    told = capsys.readouterr().err
    assert "rclpy is not there" in told
    assert "make ros" in told


@pytest.mark.parametrize(
    "wrong", [["--quirk", "loss=much"], ["--quirk", "speed=2"], ["--domain", "233"]]
)
def test_wrong_options_of_simulate_robot_are_wrong_use(
    wrong: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        cli.main(["simulate-robot", "David", *wrong])
    assert left.value.code == 2
    assert wrong[0] in capsys.readouterr().err


def test_a_folder_is_indexed_two_folders_deep_as_an_engine_does(tmp_path: Path) -> None:
    def put(place: str, text: str) -> None:
        file = tmp_path / place
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    for place, name in (
        ("a.umrf.json", "One"),
        ("x/y/b.umrf.json", "Two"),
        ("x/y/z/c.umrf.json", "Three"),
    ):
        put(place, json.dumps({"name": name, "type": "sync"}))
    put("graphs/patrol.umrf.graph.json", codec.write(sequence("patrol")))
    put("graphs/broken.graph.json", "{no")
    index = _index(tmp_path)
    assert (set(index.actions), set(index.graphs)) == ({"One", "Two"}, {"patrol"})
    assert len(list(_texts(tmp_path, "umrf.json"))) == 2
