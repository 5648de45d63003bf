"""The runner finds the differences between the graph that was sent and the one that an engine
shows."""

from msgspec.structs import replace

from action_assistant.runner.execution.evidence import difference
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Parameter
from runner.harness import sequence


def test_only_real_differences_are_named() -> None:
    sent = sequence()
    first, *others = sent.actions
    assert difference(sent, codec.write(sent)) == ""
    assert "cannot be read" in difference(sent, "{")
    value = Parameter("speed", '{"pvf_type":"number","pvf_value":5}')
    faster = replace(sent, actions=(replace(first, inputs=(value,)), *others))
    assert difference(sent, codec.write(faster)) == "Work_0 differ."
    fewer = replace(sent, relations=sent.relations[:-2])
    assert difference(sent, codec.write(fewer)) == "the arrows differ."
    more = sequence(actions=4)
    assert difference(sent, codec.write(more)) == "it has Work_3, too."
    assert difference(more, codec.write(sent)) == "it lacks Work_3."
