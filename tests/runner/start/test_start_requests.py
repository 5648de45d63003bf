"""The fields of a start besides its graph, and their limits."""

import msgspec
import pytest

from action_assistant.errors import BadInput, TooLarge
from action_assistant.runner.runs.events import Override
from action_assistant.runner.start.admission import admit, prepared, read_group
from action_assistant.umrf.facts import PINNED, SIMULATED
from runner.harness import order, sequence
from runner.start.test_admission import one_sided


def test_other_fields_of_a_start_are_checked_and_refused_with_their_place() -> None:
    blank = order(one_sided(), override=Override(codes=(), reason="  "))
    with pytest.raises(BadInput, match="Say why") as refused:
        admit(blank, PINNED)
    assert refused.value.where == {"path": "/override/reason"}
    odd = msgspec.structs.replace(order(sequence()), script=msgspec.Raw(b'{"behaviours":1}'))
    with pytest.raises(BadInput, match="The script: ") as refused:
        admit(odd, SIMULATED)
    assert refused.value.where == {"path": "/script"}


def test_a_graph_that_is_started_has_a_bound() -> None:
    many = order(sequence(actions=5_001))
    plain = msgspec.Raw(msgspec.json.encode(msgspec.json.decode(many.umrf)))
    with pytest.raises(TooLarge, match="5,001 actions; at most 5,000 are run"):
        prepared(msgspec.structs.replace(many, umrf=plain), SIMULATED, "r1")
    with pytest.raises(TooLarge, match="at most 2 MB"):
        prepared(many, SIMULATED, "r1")


def test_a_robot_is_named_once_in_a_start_on_several() -> None:
    body = b'{"version":"v","digest":"d","umrf":{},"request_id":"r","engines":["A","A"]}'
    with pytest.raises(BadInput, match="named twice"):
        read_group(body)
    with pytest.raises(BadInput) as refused:
        read_group(b"{")
    assert refused.value.where is None
