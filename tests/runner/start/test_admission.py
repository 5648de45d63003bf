"""Rules of admission: which starts are refused, and with which words."""

from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from action_assistant.errors import BadInput, Conflict, NotUmrf, TooLarge
from action_assistant.runner.runs.events import Override
from action_assistant.runner.runs.sent_graphs import SentSubgraph, counted
from action_assistant.runner.start.admission import (
    StartRequest,
    admit,
    prepared,
    read_request,
)
from action_assistant.umrf.check import blocking, check, check_reading
from action_assistant.umrf.digest import digest
from action_assistant.umrf.facts import PINNED, SIMULATED
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph, Relation
from action_assistant.umrf.run_size import MOST_BYTES
from runner.harness import GO_ON, order, sequence
from strategies import graphs
from support.doses import examples
from support.recordings import CORPUS, NO_CORPUS
from umrf.drawn import busy_graphs


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


@pytest.mark.parametrize(
    "name",
    [
        "Pick and place",
        "pick-and-place",
        "läuft",
        "a.b",
        "x" * 65,
        "1st",
        "a/b",
        "日本語",
        'it\'s "on"',
    ],
)
def test_a_graph_goes_to_robots_under_any_name_that_engines_take(name: str) -> None:
    asked = msgspec.structs.replace(order(sequence(name)), engine="David")
    assert admit(asked, PINNED).graph.name == name
    assert prepared(asked, PINNED, "run1").name == name


BAD_NAMES = ["", "100%", "%n", "a\nb", "a\x00", "x" * 201, "a\u2028b", "\x9f"]


@pytest.mark.parametrize("name", BAD_NAMES)
@pytest.mark.parametrize("engine", ["simulator", "David"])
def test_a_name_that_no_robot_is_sent_is_a_problem_of_the_check_that_nobody_overrides(
    name: str, engine: str
) -> None:
    asked = msgspec.structs.replace(order(sequence(name)), engine=engine)
    (told,) = [each.code for each in check(sequence(name)) if each.severity == "error"]
    override = Override((told,), "because")
    with pytest.raises(Conflict, match="cannot be overridden") as refused:
        admit(msgspec.structs.replace(asked, override=override), PINNED)
    where: Any = refused.value.where
    assert [each["code"] for each in where["problems"]] == [told]


def with_inner(inner: Graph) -> StartRequest:
    """A start of a graph whose first action is this graph."""
    outer = sequence("outer")
    first = msgspec.structs.replace(outer.actions[0], name=inner.name)
    outer = msgspec.structs.replace(outer, actions=(first, *outer.actions[1:]))
    text = msgspec.Raw(codec.write(inner).encode())
    sent = SentSubgraph(name=inner.name, digest=digest(inner), umrf=text)
    return msgspec.structs.replace(order(outer), subgraphs=(sent,))


def test_problems_that_cannot_be_overridden_are_final_inside_a_sub_graph_too() -> None:
    good = sequence("inner")
    assert admit(with_inner(good), PINNED).inside.keys() == {"inner"}
    odd = msgspec.structs.replace(good.actions[0], name="50%")
    bad = msgspec.structs.replace(good, actions=(odd, *good.actions[1:]))
    override = Override(("subgraph",), "because")
    with pytest.raises(Conflict, match="cannot be overridden"):
        admit(msgspec.structs.replace(with_inner(bad), override=override), PINNED)


NAMES = st.one_of(st.text(max_size=4), st.sampled_from(["A", "A", "Pick and place", *BAD_NAMES]))


@st.composite
def named_graphs(draw: st.DrawFn) -> Graph:
    """Graphs of all kinds, some with names that are not sent."""
    graph = draw(st.one_of(graphs(), busy_graphs(), busy_graphs()))
    if draw(st.booleans()):
        return graph
    actions = tuple(
        msgspec.structs.replace(each, name=draw(NAMES)) if draw(st.booleans()) else each
        for each in graph.actions
    )
    return msgspec.structs.replace(graph, name=draw(NAMES), actions=actions)


def refusal_of(text: str, engine: str) -> set[str] | None:
    """The codes for which a start of this text is refused; None where it is admitted."""
    stamp = digest(codec.read(text).graph)
    body = {"version": "v", "digest": stamp, "umrf": text, "engine": engine, "request_id": "r"}
    facts = SIMULATED if engine == "simulator" else PINNED
    try:
        prepared(read_request(msgspec.json.encode(body)), facts, "run1")
    except Conflict as refused:
        found: Any = (refused.where or {})["problems"]
        return {each["code"] for each in found}
    return None


def errors_of(text: str, engine: str) -> set[str] | None:
    """The codes that the check calls errors, or refused by one engine; None without any."""
    facts = SIMULATED if engine == "simulator" else PINNED
    return {each.code for each in blocking(check_reading(codec.read(text), None, facts))} or None


@given(named_graphs(), st.sampled_from(["simulator", "David"]))
@settings(max_examples=examples(150), deadline=None, suppress_health_check=list(HealthCheck))
def test_a_start_refuses_of_a_graph_what_the_check_calls_an_error_and_nothing_else(
    graph: Graph, engine: str
) -> None:
    """A start may show fewer of many errors."""
    text = codec.write(graph)
    refused, errors = refusal_of(text, engine), errors_of(text, engine)
    assert (refused is None) == (errors is None), (refused, errors)
    assert (refused or set()) <= (errors or set())


@pytest.mark.skipif(not CORPUS.is_dir(), reason=NO_CORPUS)
def test_a_start_refuses_of_real_files_what_the_check_calls_an_error() -> None:
    for path in sorted(CORPUS.rglob("*.json")):
        try:
            text = path.read_bytes().decode()
            codec.read(text)
        except (UnicodeDecodeError, codec.Unreadable):
            continue
        assert (refusal_of(text, "David") is None) == (errors_of(text, "David") is None), path.name


def test_a_script_is_for_the_simulator_and_never_instant() -> None:
    asked = order(sequence(), script={"*": [{"after_s": 0}]})
    (behaviour,) = admit(asked, SIMULATED).script.behaviours["*"]
    assert behaviour.after_s > 0
    with pytest.raises(BadInput, match="simulator"):
        admit(msgspec.structs.replace(asked, engine="David"), PINNED)


@pytest.mark.parametrize("text", [b"1", b"[]", b"{}", b'{"graph_name":"a","graph_name":"b"}'])
def test_a_body_that_is_no_graph_is_refused(text: bytes) -> None:
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


def with_number(number: str) -> tuple[bytes, str]:
    """A graph with a number that is spelled so, and its digest."""
    text = codec.write(sequence())
    parameter = '"input_parameters": {"speed": {"pvf_type": "number", "pvf_value": NUMBER}},'
    text = text.replace('"type": "sync",', f'"type": "sync", {parameter}', 1)
    text = text.replace("NUMBER", number)
    return text.encode(), digest(codec.read(text).graph)


def start_of(umrf: bytes, stamp: str) -> bytes:
    body = b'{"version":"v","digest":"%b","engine":"simulator","request_id":"r","umrf":%b}'
    return body % (stamp.encode(), umrf)


@pytest.mark.parametrize("number", ["5.0", "5", "1e2", "0.30000000000000004"])
def test_a_graph_as_object_and_as_text_are_the_same_start(number: str) -> None:
    text, stamp = with_number(number)
    as_object = read_request(start_of(text.strip(), stamp))
    as_text = read_request(start_of(msgspec.json.encode(text.decode()), stamp))
    first, second = (prepared(each, SIMULATED, "run1") for each in (as_object, as_text))
    assert first == second
    assert first.digest == stamp
    assert f'"pvf_value": {number}' in second.umrf


@pytest.mark.parametrize(
    ("text", "line", "column"),
    [("", 1, 1), ("{", 1, 2), ('{\n "graph_name": nan}', 2, 16), ("5.0.0", 1, 4)],
)
def test_a_text_that_is_no_json_is_refused_with_its_place(
    text: str, line: int, column: int
) -> None:
    asked = read_request(start_of(msgspec.json.encode(text), "0"))
    with pytest.raises(BadInput) as refused:
        admit(asked, SIMULATED)
    assert type(refused.value) is BadInput
    assert refused.value.where == {"path": "/umrf", "line": line, "column": column}


@pytest.mark.parametrize(
    "text", ['"a text in a text"', "[1]", "{}", '{"actions": [], "actions": []}']
)
def test_a_text_that_is_no_graph_is_refused_as_the_object_is(text: str) -> None:
    told = []
    for umrf in (text.encode(), msgspec.json.encode(text)):
        if umrf.startswith(b'"a'):
            continue  # as an object it would be a text, too
        with pytest.raises(NotUmrf) as refused:
            admit(read_request(start_of(umrf, "0")), SIMULATED)
        told.append(refused.value.detail)
    assert len(set(told)) == 1


def test_a_text_with_half_a_character_is_refused() -> None:
    for half in (b'"\\ud800"', b'"\\udc00x"'):
        with pytest.raises(BadInput):
            admit(read_request(start_of(half, "0")), SIMULATED)


def test_escapes_do_not_count_against_the_limit() -> None:
    text, stamp = with_number("5.0")
    text += b"\n" * (MOST_BYTES - len(text))
    body = start_of(msgspec.json.encode(text.decode()), stamp)
    assert counted(body) < MOST_BYTES + 200 < len(body)
    assert admit(read_request(body), SIMULATED).digest == stamp
    too_long = msgspec.json.encode(text.decode() + "\n")
    with pytest.raises(TooLarge):
        admit(read_request(start_of(too_long, stamp)), SIMULATED)
