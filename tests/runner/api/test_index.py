"""Graphs written into a robot's index, over HTTP, by a runner that was told where."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import httpx
import msgspec
import pytest

from action_assistant.errors import CannotStart
from action_assistant.settings import as_index_folders, index_folders
from runner.api.test_api import problem
from runner.harness import sequence
from runner.index_folders.folders import add, held, wish
from runner.process import RunnerProcess

LEG = sequence("leg", 2)


@pytest.fixture(scope="module")
def index(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("index")


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory, index: Path) -> Iterator[httpx.Client]:
    """Of a runner that may write for David, whom it knows."""
    data = tmp_path_factory.mktemp("writes") / "data"
    process = RunnerProcess(data, "--index-folder", f"David={index}").start()
    with process.client() as found:
        for name in ("David", "Carol"):
            assert found.post("/api/robots", json={"name": name}).status_code == 201
        yield found
    process.end()


def test_it_is_written_replaced_when_that_is_said_and_shown_in_the_robot_s_log(
    client: httpx.Client, index: Path
) -> None:
    add(index, "mine.graph.json", sequence("round", 3))
    round_ = sequence("round", 2)
    path = "/api/robots/David/index"
    body = msgspec.json.encode(wish(LEG, round_))
    refused = problem(client.post(path, content=body), 409)
    assert refused["where"]["files"] == {"round": "mine.graph.json"}
    assert sorted(held(index)) == ["mine.graph.json"]
    answer = client.post(path, content=msgspec.json.encode(wish(LEG, round_, replace=["round"])))
    assert answer.status_code == 200, answer.text
    (written,), (replaced,) = answer.json()["written"], answer.json()["replaced"]
    assert (written["graph"], written["path"]) == ("leg", "leg.umrf.graph.json")
    assert sorted(held(index)) == sorted([written["path"], replaced["path"], replaced["kept"]])
    asked, done = client.get("/api/robots/David/events").json()[1::-1]
    assert (asked["kind"], asked["graphs"]) == ("index_write_asked", ["leg", "round"])
    assert done["kind"] == "index_written"
    assert [each["path"] for each in done["files"]] == [written["path"], replaced["path"]]
    assert done["sender"] != ""


def test_there_is_no_way_to_name_a_folder_over_the_network(client: httpx.Client) -> None:
    body = msgspec.json.decode(msgspec.json.encode(wish(LEG)))
    refused = problem(client.post("/api/robots/David/index", json=body | {"folder": "/tmp"}), 400)
    assert "folder" in refused["detail"]
    refused = problem(client.post("/api/robots/Carol/index", json=body), 409)
    assert "--index-folder" in refused["detail"]
    assert client.post("/api/robots/..%2FDavid/index", json=body).status_code == 404


def test_only_operators_may(client: httpx.Client) -> None:
    described = client.get("/schema/openapi.json").json()
    assert described["paths"]["/api/robots/{name}/index"]["post"]["x-needs"] == "operate"


def test_a_folder_that_is_not_there_is_refused_at_the_start(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "action_assistant", "runner", "--data", str(tmp_path / "data")]
    environ = {**os.environ, "ACTION_ASSISTANT_INDEX_FOLDERS": "David=/nonexistent"}
    done = subprocess.run(command, env=environ, capture_output=True, text=True, check=False)
    told = "There is no folder /nonexistent that David could index: No such file or directory."
    assert (done.returncode, told in done.stderr) == (2, True), done.stderr


@pytest.mark.parametrize(
    ("folders", "why"),
    [
        (["David"], "is written ROBOT=DIR, not 'David'"),
        (["=/tmp"], "is written ROBOT=DIR"),
        (["David=/tmp", "David=/var"], "Two folders are named for David"),
        (["David=/a:/b"], "is written ROBOT=DIR"),
    ],
)
def test_what_names_no_folder_is_refused(folders: list[str], why: str) -> None:
    with pytest.raises(CannotStart, match=why):
        index_folders(folders)


def test_the_command_line_comes_before_the_environment_which_says_the_same() -> None:
    written = {"ACTION_ASSISTANT_INDEX_FOLDERS": "David=/a=1, 2: Carol = rel :"}
    found = index_folders((), written)
    assert found == {"David": Path("/a=1, 2"), "Carol": Path("rel").absolute()}
    assert index_folders((), {"ACTION_ASSISTANT_INDEX_FOLDERS": as_index_folders(found)}) == found
    assert index_folders(["Eve=/e"], written) == {"Eve": Path("/e")}
    assert index_folders((), {}) == {}
