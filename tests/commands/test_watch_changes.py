"""Changes of a graph in words."""

from msgspec.structs import replace

from action_assistant.commands.watch import ShownGraph, changes
from action_assistant.umrf.model import Action, Conditions, Graph, Parameter, Relation

A = Action(key="a" * 12, name="A", inputs=(Parameter("pose/x", "5"),))
B = Action(key="b" * 12, name="B")
ARROW = Relation(parent=A.key, child=B.key, conditions=Conditions("run"))
PAIR = Graph(name="pair", actions=(A, B), relations=(ARROW,))


def said(before: Graph, after: Graph) -> list[str]:
    return [each.words for each in changes(ShownGraph(before, {}), ShownGraph(after, {}))]


def test_each_kind_of_change_has_words() -> None:
    alone = replace(PAIR, actions=(A,), relations=())
    assert said(alone, PAIR) == ["action B_0 added", "arrow A_0 → B_0 added"]
    assert said(PAIR, alone) == ["action B_0 removed", "arrow A_0 → B_0 removed"]
    assert said(PAIR, replace(PAIR, actions=(replace(A, name="C"), B))) == [
        "action A_0 renamed to C_0"
    ]
    moved = replace(PAIR, actions=(replace(A, position=(1.0, 2.0)), B))
    assert said(PAIR, moved) == ["action A_0 moved"]
    other = replace(PAIR, relations=(replace(ARROW, required=False),))
    assert said(PAIR, other) == ["arrow A_0 → B_0: required is no (was yes)"]
    bent = replace(PAIR, relations=(replace(ARROW, waypoints=(("run", "[[1,2]]"),)),))
    assert said(PAIR, bent) == ["arrow A_0 → B_0 bent"]
    assert said(bent, PAIR) == ["arrow A_0 → B_0 straightened"]
    assert said(PAIR, replace(PAIR, name="trio")) == ["graph pair renamed to trio"]
    noted = replace(PAIR, notes=(("g/1", '{"text":"x"}'),))
    assert said(PAIR, noted) == ["note added"]


def test_values_of_parameters_are_told_and_cut() -> None:
    def having(*inputs: Parameter) -> Graph:
        return replace(PAIR, actions=(replace(A, inputs=inputs), B))

    long = "9" * 500
    assert said(PAIR, having(Parameter("pose/x", "6"))) == [
        "action A_0: parameter pose/x is 6 (was 5)"
    ]
    assert said(PAIR, having()) == ["action A_0: parameter pose/x removed (was 5)"]
    (words,) = said(having(), having(Parameter("pose/x", long)))
    assert words == f"action A_0: parameter pose/x added: {'9' * 120}…"


def test_a_change_without_words_of_its_own_is_reported_as_well() -> None:
    assert said(PAIR, replace(PAIR, actions=(B, A))) == ["the graph changed"]
    assert said(PAIR, PAIR) == []
    (comment,) = changes(ShownGraph(PAIR, {}), ShownGraph(PAIR, {"1/1": "hello"}))
    assert (comment.subject, comment.change, comment.after) == ("comment", "added", "hello")
