"""A listener to starts may be a second engine that does not serve its get yet, unless it is known."""

import pytest

from action_assistant.runner.links.ros2.newcomers import Newcomers
from action_assistant.runner.links.ros2.ros_values import Endpoint

ENGINE = "action_engine_node"
WHILE = 3600.0


def end(process: str, name: str = ENGINE) -> Endpoint:
    """An endpoint of a node."""
    return Endpoint(gid=f"{process}/start", process=process, logger=name, type_hash="")


class Seen:
    """Asks again and again who may be a second engine, at the times given."""

    def __init__(self, *others: str) -> None:
        self._newcomers = Newcomers()
        self.others = frozenset(others)

    def at(
        self, second: float, *listeners: Endpoint, served_by: str = "one", name: str = ENGINE
    ) -> tuple[str, ...]:
        servers = (end(served_by, name),) if served_by else ()
        return self._newcomers.among(listeners, servers, lambda: self.others, second)


def test_the_engine_itself_is_no_newcomer() -> None:
    assert Seen().at(0, end("one")) == ()


@pytest.mark.parametrize("name", [ENGINE, f"robots.{ENGINE}", "_NODE_NAME_UNKNOWN_"])
def test_a_node_of_the_engines_name_or_of_none_stays_a_newcomer_for_ever(name: str) -> None:
    seen = Seen()
    for second in (0, 20, WHILE):
        assert seen.at(second, end("one"), end("two", name)) == (name.rpartition(".")[2],)


def test_a_node_of_another_name_is_a_newcomer_for_ten_seconds() -> None:
    seen, echo = Seen(), end("two", "_ros2cli_17")
    assert seen.at(0, end("one"), echo) == ("_ros2cli_17",)
    assert seen.at(9.9, end("one"), echo) == ("_ros2cli_17",)
    assert seen.at(10, end("one"), echo) == ()
    assert seen.at(10.1, end("one"), echo, end("three", "_ros2cli_18")) == ("_ros2cli_18",)


def test_a_node_that_came_back_is_another_one() -> None:
    seen, echo = Seen(), end("two", "_ros2cli_17")
    seen.at(0, echo)
    assert seen.at(10, echo) == ()
    assert seen.at(11) == ()
    assert seen.at(12, echo) == ("_ros2cli_17",)


def test_a_node_that_serves_another_path_publishes_starts_or_hears_feedback_is_no_engine() -> None:
    seen = Seen("two")
    assert seen.at(0, end("one"), end("two")) == ()
    seen.others = frozenset()  # it was shown once
    assert seen.at(1, end("one"), end("two")) == ()
    assert seen.at(2, end("one"), end("two"), end("three")) == (ENGINE,)


def test_an_engine_that_does_not_serve_any_more_is_a_newcomer() -> None:
    seen = Seen()
    assert seen.at(0, end("one")) == ()
    assert seen.at(1, end("one"), served_by="two") == (ENGINE,)


@pytest.mark.parametrize(("served_by", "name"), [("", ENGINE), ("one", "_NODE_NAME_UNKNOWN_")])
def test_a_listener_is_judged_by_its_name_only_beside_an_engine_whose_name_is_known(
    served_by: str, name: str
) -> None:
    seen = Seen()
    for second in (0, 11, WHILE):
        assert seen.at(second, end("two"), served_by=served_by, name=name) == (ENGINE,)
    assert seen.at(WHILE + 1, end("one"), end("two")) == (ENGINE,)
