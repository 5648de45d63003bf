"""Actions that stand for graphs."""

from hypothesis import given

from action_assistant.umrf.model import ENTRY, EXIT, Action, Graph, Parameter, Relation
from action_assistant.umrf.signatures import action_of_graph, signature_of, signature_of_graph
from strategies import graphs


def action(key: str, inputs: dict[str, str], outputs: dict[str, str] | None = None) -> Action:
    def listed(texts: dict[str, str]) -> tuple[Parameter, ...]:
        return tuple(Parameter(path, text) for path, text in texts.items())

    return Action(key=key, name=key, inputs=listed(inputs), outputs=listed(outputs or {}))


def drawn(*actions: Action, first: tuple[str, ...], last: tuple[str, ...]) -> Graph:
    entries = [Relation(parent=ENTRY, child=key, child_order=at) for at, key in enumerate(first)]
    exits = [Relation(parent=key, child=EXIT, child_order=at) for at, key in enumerate(last)]
    return Graph(name="round", actions=actions, relations=(*entries, *exits))


FREE = '{"pvf_type":"number","pvf_required":false}'
NEEDED = '{"pvf_type":"number"}'
GIVEN = '{"pvf_type":"number","pvf_value":2}'


def test_a_graph_takes_the_missing_inputs_of_its_entries_and_gives_outputs_of_its_last_exit() -> (
    None
):
    graph = drawn(
        action("One", {"a": NEEDED, "b": GIVEN}),
        action("Two", {"c": NEEDED}, {"d": GIVEN}),
        first=("One",),
        last=("One", "Two"),
    )
    found = action_of_graph(graph)
    assert found.name == "round"
    assert [each.path for each in found.inputs] == ["a"]
    assert found.outputs == (Parameter("d", NEEDED),)


def test_an_input_that_one_of_two_entries_requires_is_required() -> None:
    for texts in ((FREE, NEEDED), (NEEDED, FREE)):
        one, two = (
            action(key, {"a": text}) for key, text in zip(("One", "Two"), texts, strict=True)
        )
        found = action_of_graph(drawn(one, two, first=("One", "Two"), last=()))
        assert found.inputs == (Parameter("a", NEEDED),)


@given(graphs())
def test_a_graph_has_the_parameters_that_a_check_compares(graph: Graph) -> None:
    own, checked = signature_of(action_of_graph(graph)), signature_of_graph(graph)
    assert own.inputs.keys() == checked.inputs.keys()
