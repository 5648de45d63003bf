"""A thumbnail has what the page draws of a graph, and no more than a small picture can show."""

import json
from pathlib import Path

import msgspec
import pytest

from action_assistant import paths
from action_assistant.editor.documents.thumbnails import Thumbnail, thumbnail
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    Action,
    Conditions,
    Graph,
    Relation,
)

#: Thumbnails of the examples, by the name of the file. `thumbnails.test.ts` draws them.
VECTORS = Path(__file__).parents[2] / "vectors" / "thumbnails.json"
FILES = sorted(paths.examples().glob("*.umrf.graph.json"))


def drawn(graph: Graph) -> Thumbnail:
    """Return the thumbnail of a graph that has one."""
    return msgspec.json.decode(thumbnail(graph), type=Thumbnail)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_thumbnails_of_the_examples_are_those_that_the_page_draws(file: Path) -> None:
    found = json.loads(thumbnail(codec.read(file.read_text()).graph))
    assert found == json.loads(VECTORS.read_text())[file.name]


def test_a_graph_without_actions_has_no_thumbnail() -> None:
    ghost = Action(key="a", name="gone", missing=True)
    assert thumbnail(Graph(name="empty")) == b""
    assert thumbnail(Graph(name="ghosts", actions=(ghost,))) == b""


def test_an_arrow_has_the_first_outcome_at_which_it_leads_on() -> None:
    actions = (Action(key="a", name="Go", actor="arm"), Action(key="b", name="Come"))
    relations = (
        Relation(parent=ENTRY, child="a", conditions=ENTRY_CONDITIONS),
        Relation(parent="a", child="b", conditions=Conditions(on_error="run", on_stopped="run")),
        Relation(parent="a", child=EXIT, conditions=Conditions("run")),
        Relation(parent="b", child="gone", conditions=Conditions("run")),
        Relation(parent="b", child=EXIT, conditions=Conditions(), only="children"),
    )
    found = drawn(Graph(name="two", actions=actions, relations=relations))
    assert found == Thumbnail(("arm",), ((0, 2), (-1, 4)), ((0, 1, 0), (1, 2, 2), (1, 3, 0)))


def test_the_thumbnail_of_the_largest_graph_stays_small() -> None:
    actions = tuple(Action(key=f"k{i}", name=f"Action {i}") for i in range(5000))
    relations = tuple(
        Relation(parent=f"k{i}", child=f"k{(i * 7 + hop) % 5000}", conditions=Conditions("run"))
        for i in range(5000)
        for hop in range(4)
    )
    large = thumbnail(Graph(name="large", actions=actions, relations=relations))
    assert 100 < len(drawn(Graph(name="large", actions=actions)).actions) < 1000
    assert len(large) < 6000
