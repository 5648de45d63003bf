"""Graphs written into a robot's index, over HTTP, by a runner that was told where."""

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
    """A client of a runner that knows David and may write for it."""
    data = tmp_path_factory.mktemp("writes") / "data"
    process = RunnerProcess(data, "--index-folder", f"David={index}").start()
    with process.client() as found:
        for name in ("David", "Carol"):
            assert found.post("/api/robots", json={"name": name}).status_code == 201
        yield found
    process.end()


@pytest.mark.long
def test_a_graph_is_written_replaced_on_request_and_shown_in_the_robot_s_log(
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


@pytest.mark.long
def test_a_folder_that_is_missing_is_the_trouble_of_its_robot_alone(tmp_path: Path) -> None:
    index, missing = tmp_path / "index", tmp_path / "missing"
    index.mkdir()
    (tmp_path / "file").touch()
    folders = {"David": missing, "Carol": index, "Eve": tmp_path / "file"}
    flags = [word for robot, at in folders.items() for word in ("--index-folder", f"{robot}={at}")]
    process = RunnerProcess(tmp_path / "data", *flags).start()
    body = msgspec.json.encode(wish(LEG))
    with process.client() as found:
        for name in folders:
            assert found.post("/api/robots", json={"name": name}).status_code == 201
        refused = problem(found.post("/api/robots/David/index", content=body), 409)
        assert refused["detail"] == (
            f"There is no folder {missing} that David could index: No such file or directory. "
            "Nothing was written."
        )
        refused = problem(found.post("/api/robots/Eve/index", content=body), 409)
        assert "that Eve could index: Not a directory" in refused["detail"]
        assert found.post("/api/robots/Carol/index", content=body).status_code == 200
        missing.mkdir()  # its disk is there now
        assert found.post("/api/robots/David/index", content=body).status_code == 200
        assert sorted(held(missing)) == sorted(held(index)) != []
    process.end()
    told = (tmp_path / "data.log").read_text()
    for robot in ("David", "Eve"):
        assert f"that {robot} could index" in told


@pytest.mark.parametrize(
    ("folders", "why"),
    [
        (["David"], "is written ROBOT=DIR, not 'David'"),
        (["=/tmp"], "is written ROBOT=DIR"),
        (["David=/tmp", "David=/var"], "Two folders are named for David"),
        (["David=/a:/b"], "is written ROBOT=DIR"),
    ],
)
def test_a_command_line_without_a_folder_is_refused(folders: list[str], why: str) -> None:
    with pytest.raises(CannotStart, match=why):
        index_folders(folders)


def test_the_command_line_comes_before_the_environment_which_says_the_same() -> None:
    written = {"ACTION_ASSISTANT_INDEX_FOLDERS": "David=/a=1, 2: Carol = rel :"}
    found = index_folders((), written)
    assert found == {"David": Path("/a=1, 2"), "Carol": Path("rel").absolute()}
    assert index_folders((), {"ACTION_ASSISTANT_INDEX_FOLDERS": as_index_folders(found)}) == found
    assert index_folders(["Eve=/e"], written) == {"Eve": Path("/e")}
    assert index_folders((), {}) == {}
