"""Names that actions, their packages and their libraries can have."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.umrf.packages.naming import (
    check_name,
    check_names,
    member_name,
    snake_case,
)


@pytest.mark.parametrize(
    ("name", "package"),
    [
        ("TaAddString", "ta_add_string"),
        ("TaURDF", "ta_u_r_d_f"),
        ("MoveTCP", "move_t_c_p"),
        ("A1B22", "a1_b22"),
        ("move_arm", "move_arm"),
        ("moveArm", "move_arm"),
        ("NewAction_1743416583991", "new_action_1743416583991"),
    ],
)
def test_packages_are_called_as_the_engine_looks_for_them(name: str, package: str) -> None:
    assert snake_case(name) == package
    assert check_name(name) == ()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("", "no name"),
        ("graph_entry", "the engine's own name"),
        ("graph_exit", "the engine's own name"),
        ("Move arm", "C++ class"),
        ("Ünicode", "C++ class"),
        ("1st", "C++ class"),
        ("../Etc", "C++ class"),
        ("A\n", "C++ class"),
        ("class", "a word of C++"),
        ("co_await", "a word of C++"),
        ("EOF", "macro"),
        ("SIGTERM", "macro"),
        ("errno", "macro"),
        ("TemotoAction", "already"),
        ("open", "a function of C"),
        ("Result_A", "single _"),
        ("_Hidden", "single _"),
        ("Ta__Add", "single _"),
        ("Ends_", "single _"),
        ("A", "two characters"),
        ("A" * 60, "characters"),
        ("Test", "have for themselves"),
        ("Install", "have for themselves"),
        ("Rclcpp", "have for themselves"),
        ("TemotoMsgs", "have for themselves"),
        ("Aux", "have for themselves"),
    ],
)
def test_impossible_names_are_refused_with_the_reason(name: str, words: str) -> None:
    (refusal,) = check_name(name)
    assert refusal.place == name
    assert words in refusal.reason
    assert refusal.reason.endswith(".")


def test_names_that_become_one_package_are_told() -> None:
    (refusal,) = check_names(["MoveArm", "Look", "moveArm", "MoveArm"])
    assert refusal.place == "moveArm"
    assert "“moveArm” and “MoveArm” would both be the package “move_arm”" in refusal.reason


@pytest.mark.parametrize(
    ("key", "member"),
    [
        ("x", "x"),
        ("frame_id", "frame_id"),
        ("survey type", "survey_type"),
        ("class", "class_"),
        ("std", "std_"),
        ("errno", "errno_"),
        ("NULL", "NULL_"),
        ("X", "X"),
        ("3d", "p_3d"),
        ("__a__", "a"),
        ("é", "p"),
    ],
)
def test_keys_become_members_that_nothing_else_has(key: str, member: str) -> None:
    assert member_name(key) == member


@given(st.text())
def test_every_key_becomes_an_identifier(key: str) -> None:
    member = member_name(key)
    assert member.isascii()
    assert member.isidentifier()
    assert "__" not in member
    assert not member.startswith("_")
