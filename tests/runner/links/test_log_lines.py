"""A line of an engine's log names its graph, also where the name has blanks and quotes."""

import pytest

from action_assistant.runner.links.ros2.ros_values import LogLine

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
