"""An action has the file of its name, and never one outside the folder."""

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.errors import CannotStart
from action_assistant.runner.links.behaviours.folder import BehaviourFolder, Unusable, file_of
from runner.links.behaviours.written import OK, write

pytestmark = pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="behaviours need Linux")


def test_the_file_of_an_action_is_its_name_in_snake_case(tmp_path: Path) -> None:
    folder = BehaviourFolder.opened(write(tmp_path / "b", open_gripper=OK))
    assert folder.has("OpenGripper")
    assert folder.source("OpenGripper") == OK
    assert not folder.has("CloseGripper")


@given(st.one_of(st.text(), st.text(alphabet="./\\aZ_%\0~ -\n", max_size=20)))
def test_any_action_name_gives_a_plain_file_name(name: str) -> None:
    file = file_of(name)
    if file is not None:
        assert Path(file).name == file
        assert file.removesuffix(".py").replace("_", "").isalnum()
        assert file.isascii()


@pytest.mark.parametrize(
    "name",
    [
        "",
        ".",
        "..",
        "../open",
        "/open",
        "a/b",
        "a\\b",
        "open.py",
        "Open\0",
        "class",
        "Öffnen",
        "o" * 300,
    ],
)
def test_names_that_no_package_can_have_have_no_behaviour(tmp_path: Path, name: str) -> None:
    folder = BehaviourFolder.opened(write(tmp_path / "b", open=OK, **{"class": OK}))
    assert not folder.has(name)
    with pytest.raises(Unusable, match="no name that a behaviour can have"):
        folder.source(name)


@pytest.mark.parametrize("inside", [True, False])
def test_a_link_is_no_behaviour_wherever_it_leads(tmp_path: Path, inside: bool) -> None:
    place = write(tmp_path / "b", real_one=OK)
    write(tmp_path / "c", other=OK)
    (place / "linked.py").symlink_to("real_one.py" if inside else tmp_path / "c" / "other.py")
    folder = BehaviourFolder.opened(place)
    assert folder.has("Linked")  # so that the script is not taken in its place
    with pytest.raises(Unusable, match="it is a link, and no link is followed"):
        folder.source("Linked")


def test_an_unreadable_file_is_refused_with_the_reason(tmp_path: Path) -> None:
    place = write(tmp_path / "b")
    (place / "a_folder.py").mkdir()
    os.mkfifo(place / "a_pipe.py")  # would keep whoever opens it
    (place / "binary.py").write_bytes(b"\xff\xfe")
    (place / "large.py").write_bytes(b"#" * (1 << 20) + b"\n")
    refused = BehaviourFolder.opened(place).listed().refused
    assert {name: reason.partition(":")[2] for name, reason in refused.items()} == {
        "a_folder": " it is no regular file.",
        "a_pipe": " it is no regular file.",
        "binary": " it is not UTF-8.",
        "large": " it is larger than 1 MB.",
    }


def test_only_what_can_be_the_file_of_an_action_is_listed(tmp_path: Path) -> None:
    place = write(
        tmp_path / "b", open_gripper=OK, OpenGripper=OK, __init__=OK, _private=OK, class_=OK
    )
    (place / "open_gripper.pyc").write_bytes(b"")
    folder = BehaviourFolder.opened(place)
    assert folder.listed().names == ("open_gripper",)
    assert folder.listed(["OpenGripper", "../b/OpenGripper"]).names == ("open_gripper",)
    assert folder.listed(["CloseGripper"]).names == ()


def test_a_file_in_the_place_of_the_folder_is_none(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(CannotStart, match="Not a directory"):
        BehaviourFolder.opened(tmp_path / "file")
