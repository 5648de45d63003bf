"""C++ packages over HTTP: which a graph has, what is in them, and a file of all of them."""

import io
import json
import zipfile
from typing import Any

import httpx
import pytest

from action_assistant.umrf.files import codec
from action_assistant.umrf.kept_values import KEEPER_PACKAGE, has_keeper, keeper
from action_assistant.umrf.packages.choosing import distinct_actions
from action_assistant.umrf.packages.generating import package_files
from action_assistant.umrf.signatures import signature_of
from editor.process import Editor


def leaf(kind: str) -> dict[str, str]:
    return {"pvf_type": kind}


def action(name: str, instance: int = 0, **parameters: Any) -> dict[str, Any]:
    return {"name": name, "instance_id": instance, "type": "sync", "input_parameters": parameters}


#: Two that can be, one of them used twice, one whose name C++ has taken, one that differs from itself.
BODY: dict[str, Any] = {
    "graph_name": "kitchen",
    "graph_entry": [],
    "graph_exit": [],
    "actions": [
        action("OpenLid", pose={"x": leaf("number")}),
        action("Drive", speed=leaf("number")),
        action("Drive", 1, speed=leaf("number")),
        action("class", speed=leaf("number")),
        action("Look", at=leaf("string")),
        action("Look", 1, at=leaf("number")),
    ],
}


@pytest.fixture
def kitchen(http: httpx.Client) -> str:
    made = http.post("/api/graphs", content=json.dumps(BODY).encode())
    assert made.status_code == 201, made.text
    identity: str = made.json()["id"]
    return identity


def test_a_graph_tells_its_packages_and_why_some_actions_have_none(
    http: httpx.Client, kitchen: str
) -> None:
    found = http.get(f"/api/graphs/{kitchen}/packages").json()
    assert [(each["action"], each["package"]) for each in found["packages"]] == [
        ("OpenLid", "open_lid"),
        ("Drive", "drive"),
    ]
    assert "src/open_lid.cpp" in found["packages"][0]["files"]
    reasons = {each["action"]: each["reason"] for each in found["refusals"]}
    assert "word of C++" in reasons["class"]
    assert "different parameters" in reasons["Look"]
    assert found["seq"] == 1


def test_the_shown_files_of_a_package_are_those_that_the_command_writes(
    http: httpx.Client, kitchen: str
) -> None:
    shown = http.get(f"/api/graphs/{kitchen}/packages/open_lid").json()
    graph = codec.read(http.get(f"/api/graphs/{kitchen}/umrf").content).graph
    files = package_files(distinct_actions(graph)[0])
    assert {each["path"]: each["text"].encode() for each in shown["files"]} == files
    assert shown["action"] == "OpenLid"


def test_the_file_has_a_folder_for_each_package_and_is_the_same_each_time(
    http: httpx.Client, kitchen: str
) -> None:
    answer = http.get(f"/api/graphs/{kitchen}/packages.zip")
    assert answer.headers["content-type"] == "application/zip"
    assert 'filename="action_packages.zip"' in answer.headers["content-disposition"]
    with zipfile.ZipFile(io.BytesIO(answer.content)) as packed:
        assert packed.testzip() is None
        assert {name.split("/")[0] for name in packed.namelist()} == {"open_lid", "drive"}
        source = packed.read("drive/src/drive.cpp")
    shown = http.get(f"/api/graphs/{kitchen}/packages/drive").json()["files"]
    assert source.decode() in [each["text"] for each in shown]
    assert http.get(f"/api/graphs/{kitchen}/packages.zip").content == answer.content


def test_chosen_packages_come_alone(http: httpx.Client, kitchen: str) -> None:
    answer = http.get(f"/api/graphs/{kitchen}/packages.zip", params={"package": "drive"})
    assert 'filename="drive.zip"' in answer.headers["content-disposition"]
    with zipfile.ZipFile(io.BytesIO(answer.content)) as packed:
        assert {name.split("/")[0] for name in packed.namelist()} == {"drive"}


@pytest.mark.parametrize("package", ["class", "look", "..%2f..", "drive%0d%0aX: y", "%22"])
def test_a_package_that_cannot_be_is_not_found(
    http: httpx.Client, kitchen: str, package: str
) -> None:
    for path in (f"packages/{package}", f"packages.zip?package=drive&package={package}"):
        answer = http.get(f"/api/graphs/{kitchen}/{path}")
        assert answer.status_code == 404, (path, answer.text)


def test_earlier_packages_can_be_had_and_a_graph_without_any_says_so(editor: Editor) -> None:
    with editor.client() as http:
        empty = http.post("/api/graphs", json={"name": "empty"}).json()
        assert http.get(f"/api/graphs/{empty['id']}/packages").json()["packages"] == []
        assert http.get(f"/api/graphs/{empty['id']}/packages.zip").status_code == 404
        assert http.get(f"/api/graphs/{empty['id']}/packages?at=99").status_code == 409
        assert http.get("/api/graphs/nothing/packages").status_code == 404


def test_the_package_that_keeps_values_needs_no_graph(http: httpx.Client) -> None:
    answer = http.get("/api/values-package.zip")
    assert answer.status_code == 200
    assert f'filename="{KEEPER_PACKAGE}.zip"' in answer.headers["content-disposition"]
    with zipfile.ZipFile(io.BytesIO(answer.content)) as found:
        files = {name: found.read(name) for name in found.namelist()}
    wanted = package_files(keeper())
    assert files == {f"{KEEPER_PACKAGE}/{path}": content for path, content in wanted.items()}
    read = codec.read_action(files[f"{KEEPER_PACKAGE}/{KEEPER_PACKAGE}.umrf.json"]).action
    assert has_keeper({read.name: signature_of(read)})
