"""What may be started, and what is said to those who may not."""

from typing import Any

import msgspec
import pytest

from action_assistant.errors import BadInput, Conflict, NotUmrf
from action_assistant.runner.runs.events import Override
from action_assistant.runner.start.admission import admit, read_request
from action_assistant.umrf.digest import digest
from action_assistant.umrf.facts import PINNED, SIMULATED
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph, Relation
from runner.harness import GO_ON, order, sequence


def one_sided(name: str = "lopsided") -> Graph:
    """An arrow that only its child knows of: certain harm on an engine, but no matter of form."""
    graph = sequence(name)
    first = graph.actions[0].key
    last = graph.actions[2].key
    odd = Relation(parent=first, child=last, conditions=GO_ON, only="children")
    return msgspec.structs.replace(graph, relations=(*graph.relations, odd))


def test_a_sound_graph_is_admitted_as_it_is() -> None:
    graph = sequence()
    admitted = admit(order(graph), SIMULATED)
    assert digest(admitted.graph) == digest(graph)
    assert admitted.graph_id == "g1"
    assert [each.key for each in admitted.graph.actions] == [each.key for each in graph.actions]


def test_without_a_graph_the_stamp_of_the_text_tells_it() -> None:
    asked = msgspec.structs.replace(order(sequence()), graph=None)
    assert admit(asked, SIMULATED).graph_id == "g1"


def test_one_changed_letter_is_another_graph() -> None:
    asked = order(sequence())
    text = bytes(asked.umrf).replace(b'"Work"', b'"Vork"')
    with pytest.raises(Conflict, match="digest"):
        admit(msgspec.structs.replace(asked, umrf=msgspec.Raw(text)), SIMULATED)


def test_a_moved_card_is_the_same_graph() -> None:
    graph = sequence()
    moved = msgspec.structs.replace(
        graph,
        actions=tuple(msgspec.structs.replace(each, position=(9.0, 9.0)) for each in graph.actions),
    )
    asked = msgspec.structs.replace(order(moved), digest=digest(graph))
    assert admit(asked, SIMULATED).digest == digest(graph)


def test_certain_harm_blocks_until_a_person_says_why_it_does_not_matter() -> None:
    asked = order(one_sided())
    with pytest.raises(Conflict) as refused:
        admit(asked, PINNED)
    where: Any = refused.value.where
    codes = tuple({each["code"] for each in where["problems"]})
    reason = Override(codes, "seen and understood")
    assert admit(msgspec.structs.replace(asked, override=reason), PINNED).digest == asked.digest
    other = Override(("something-else",), "seen")
    with pytest.raises(Conflict):
        admit(msgspec.structs.replace(asked, override=other), PINNED)


@pytest.mark.parametrize("name", ["a b", "größe", "x" * 65, "1st", "a/b"])
def test_names_for_robots_are_stricter_than_for_the_simulator(name: str) -> None:
    asked = order(sequence(name))
    assert admit(asked, SIMULATED).graph.name == name
    with pytest.raises(Conflict, match="not safe"):
        admit(msgspec.structs.replace(asked, engine="David"), PINNED)


def test_a_script_is_for_the_simulator_and_never_instant() -> None:
    asked = order(sequence(), script={"*": [{"after_s": 0}]})
    (behaviour,) = admit(asked, SIMULATED).script.behaviours["*"]
    assert behaviour.after_s > 0
    with pytest.raises(BadInput, match="simulator"):
        admit(msgspec.structs.replace(asked, engine="David"), PINNED)


@pytest.mark.parametrize("text", [b"1", b"[]", b"{}", b'{"graph_name":"a","graph_name":"b"}'])
def test_what_is_no_graph_is_refused(text: bytes) -> None:
    asked = msgspec.structs.replace(order(sequence()), umrf=msgspec.Raw(text))
    with pytest.raises((NotUmrf, Conflict)):
        admit(asked, SIMULATED)


def test_the_place_of_a_mistake_is_a_json_pointer() -> None:
    fields = {
        "version": "v",
        "digest": "d",
        "umrf": {},
        "engine": "simulator",
        "request_id": "r",
        "override": {"codes": ["a", 1], "reason": ""},
    }
    with pytest.raises(BadInput) as refused:
        read_request(msgspec.json.encode(fields))
    assert refused.value.where == {"path": "/override/codes/1"} or refused.value.where == {
        "path": "/override/codes"
    }


def test_the_text_is_read_as_sent_not_as_some_json_library_would_write_it() -> None:
    graph = sequence()
    text = codec.write(graph)
    body = b'{"version":"v","digest":"%b","engine":"simulator","request_id":"r","umrf":%b}'
    asked = read_request(body % (digest(graph).encode(), text.strip().encode()))
    assert bytes(asked.umrf) == text.strip().encode()
