"""The command `flatten`, as a person or a script runs it."""

import json
import subprocess
from pathlib import Path
from typing import Any

from action_assistant.umrf.files import codec
from support.command_line import ran

RUN = ["on_true -> run", "on_false -> run", "on_error -> run"]


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    return ran("flatten", *map(str, arguments))


def chain(name: str, *actions: str, ends: list[str] = RUN) -> dict[str, Any]:
    """One action after the other, whatever the one before ends with."""
    return {
        "graph_name": name,
        "graph_entry": [{"name": actions[0]}],
        "graph_exit": [{"name": actions[-1], "conditions": ends}],
        "actions": [
            {
                "name": each, "type": "sync",
                "parents": [{"name": other, "conditions": RUN} for other in actions[max(n - 1, 0) : n]],
                "children": [{"name": other} for other in actions[n + 1 : n + 2]],
            }
            for n, each in enumerate(actions)
        ],
    }  # fmt: skip


def written(folder: Path, value: object, name: str) -> Path:
    path = folder / name
    path.write_text(json.dumps(value, indent=1))
    return path


def test_a_graph_and_its_sub_graphs_become_one(tmp_path: Path) -> None:
    top = written(tmp_path, chain("top", "Drive", "Grasp"), "top.graph.json")
    folder = tmp_path / "graphs"
    folder.mkdir()
    written(folder, chain("Grasp", "Open", "Close"), "grasp.graph.json")
    written(folder, {"x": 1}, "broken.graph.json")
    answer = run(top, "--with", folder)
    assert answer.returncode == 0
    assert answer.stderr.startswith("left out ")
    graph = codec.read(answer.stdout).graph
    assert [a.full_name for a in graph.actions] == ["Drive_0", "Open_0", "Close_0"]
    assert answer.stdout == run(top, "--with", folder).stdout
    alone = run(top, "--with", folder / "grasp.graph.json", "--output", tmp_path / "flat.json")
    assert (alone.returncode, alone.stdout) == (0, "")
    assert (tmp_path / "flat.json").read_text() == answer.stdout


def test_json_says_where_each_action_comes_from(tmp_path: Path) -> None:
    top = written(tmp_path, chain("top", "Grasp") | {"mark": 1}, "top.json")
    inner = written(tmp_path, chain("Grasp", "Open") | {"team": "red"}, "grasp.json")
    answer = run(top, "--with", inner, "--json")
    told = json.loads(answer.stdout)
    assert told["kind"] == "flattened"
    assert told["umrf"]["mark"] == 1
    (origin,) = told["origins"]
    assert [level["action"] for level in origin["levels"]] == ["Grasp_0", "Open_0"]
    assert told["left_out"][0]["fields"] == ["team"]
    assert "team of Grasp_0 left out" in answer.stderr


def test_a_hierarchy_that_would_not_do_the_same_is_refused_with_its_place(tmp_path: Path) -> None:
    top = written(tmp_path, chain("top", "Grasp"), "top.json")
    middle = written(tmp_path, chain("Grasp", "Open", "Hold"), "grasp.json")
    inner = written(tmp_path, chain("Hold", "Close", ends=["on_error -> ignore"]), "hold.json")
    answer = run(top, "--with", middle, inner, "--output", tmp_path / "flat.json")
    assert (answer.returncode, answer.stdout) == (1, "")
    (line,) = answer.stderr.splitlines()
    row = max(
        n
        for n, text in enumerate(middle.read_text().splitlines(), 1)
        if text == '   "name": "Hold",'
    )
    assert line.startswith(
        f"{middle}:{row}:4: Grasp_0 > Hold_0: It can end HALTED, for instance when"
    )
    assert line.endswith("(never-ends)")
    assert not (tmp_path / "flat.json").exists()
    told = json.loads(run(top, "--with", middle, inner, "--json").stdout)
    assert [reason["code"] for reason in told["reasons"]] == ["never-ends"]


def test_actions_come_before_graphs_of_their_name(tmp_path: Path) -> None:
    top = written(tmp_path, chain("top", "Grasp"), "top.json")
    inner = written(tmp_path, chain("Grasp", "Open"), "grasp.json")
    packages = tmp_path / "packages"
    packages.mkdir()
    written(packages, {"name": "Grasp", "type": "sync"}, "grasp.umrf.json")
    answer = run(top, "--with", inner, "--actions", packages)
    assert [a.name for a in codec.read(answer.stdout).graph.actions] == ["Grasp"]


def test_an_unreadable_file_is_wrong_use_and_no_answer(tmp_path: Path) -> None:
    top = written(tmp_path, chain("top", "Grasp"), "top.json")
    bad = written(tmp_path, [], "bad.json")
    for arguments in ((bad,), (top, "--with", bad), (top, "--with", tmp_path / "nothing")):
        answer = run(*arguments)
        assert (answer.returncode, answer.stdout) == (2, "")
        assert answer.stderr.count("\n") == 1
