"""A line of an engine's log names its graph, also where the name has blanks and quotes, and its level."""

import msgspec
import pytest

from action_assistant.runner.links.ros2.ros_values import LogLine
from action_assistant.runner.runs.events import EngineSaid

LINES = [
    "Received request to start UMRF graph: {}",
    "Received request to stop UMRF graph: {}",
    "Stopping UMRF graph '{}' ...",
    "UMRF graph '{}' stopped.",
    "Graph '{}' finished.",
    "Cannot execute UMRF graph '{}' because it's already active (RUNNING)",
    "Could not resolve graph '{}'",
    "Cannot modify graph '{}' because it is not in PAUSED state. Current state: 'FINISHED'",
    "origin [in startGraph]: Could not resolve graph '{}'\n   fwd [in executeUmrfGraph]: forwarding",
]


@pytest.mark.parametrize("line", LINES)
@pytest.mark.parametrize("name", ["patrol", "Pick and place", "läuft", "a.b", "it's", "g__Sub__0"])
def test_the_name_of_the_graph_is_found_in_the_words_of_the_engine(line: str, name: str) -> None:
    assert LogLine("action_engine_node", line.format(name)).graph == name


@pytest.mark.parametrize("line", ["map::at", "The Action Engine is initialized."])
def test_a_line_about_no_graph_names_none(line: str) -> None:
    assert LogLine("action_engine_node", line).graph is None


@pytest.mark.parametrize(
    ("number", "level"),
    [(10, "debug"), (20, "info"), (30, "warn"), (40, "error"), (50, "fatal"), (0, ""), (25, "")],
)
def test_the_level_of_a_line_is_the_word_of_ros_2_for_its_number(number: int, level: str) -> None:
    assert LogLine("action_engine_node", "map::at", number).level == level


def test_a_stored_line_keeps_its_level_and_one_of_an_earlier_version_has_none() -> None:
    said = EngineSaid(1, "map::at", "error")
    assert msgspec.json.decode(msgspec.json.encode(said), type=EngineSaid) == said
    assert msgspec.json.decode(b'{"at":1,"text":"map::at"}', type=EngineSaid).level == ""
