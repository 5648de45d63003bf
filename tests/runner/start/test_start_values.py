"""Values that people give a graph at its start: checked, sent, recorded, and part of what others say yes to."""

import json
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.commands.remote import values_of
from action_assistant.errors import BadInput, CannotStart, Conflict
from action_assistant.runner.robots.rights import Rules
from action_assistant.runner.runs.views import hidden, run_view
from action_assistant.runner.start.admission import GroupRequest
from action_assistant.runner.start.approvals import ApprovalRequest
from action_assistant.runner.start.orders import ordered
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from action_assistant.umrf.limits import Limit
from action_assistant.umrf.model import Graph, Parameter
from action_assistant.umrf.start_values import AskedInput
from runner.execution.test_conductor import Lab, led, shared
from runner.harness import (
    ANN,
    BEN,
    Harness,
    Robot,
    ended,
    engine,
    order,
    sequence,
    until,
    virtual,
)
from runner.registered_robots import NEVER, Open, group, verdicts
from runner.start.test_approvals import careful
from runner.start.test_drills import Published, releasing
from runner.start.test_rights_registry import lab

__all__ = ["releasing"]


def asking(graph: Graph | None = None) -> Graph:
    """A graph whose `Work_1` asks for a place and, by a mark, for a torque of 60 at most."""
    graph = graph or sequence()
    inputs = (
        Parameter("place", '{"pvf_type":"string"}'),
        Parameter("torque", '{"pvf_type":"number","pvf_value":5}'),
    )
    first, second, *rest = graph.actions
    asked = msgspec.structs.replace(second, inputs=inputs, asks=(("torque", '{"most":60}'),))
    return msgspec.structs.replace(graph, actions=(first, asked, *rest))


def sent_inputs(text: str) -> Any:
    (found,) = [each for each in json.loads(text)["actions"] if each["name"] == "Work"][1:2]
    return {name: leaf.get("pvf_value") for name, leaf in found["input_parameters"].items()}


VALUES = {"Work_1": {"place": "valve_8", "torque": 6.5}}


@virtual
async def test_a_start_without_what_the_graph_leaves_open_is_refused_and_with_it_goes() -> None:
    harness = Harness()
    async with harness.runner() as control:
        with pytest.raises(Conflict, match="place"):
            await control.start(order(asking()), ANN)
        asked = order(asking(), values=VALUES)
        run = (await control.start(asked, ANN)).run
        assert (run.digest, run.values) == (digest(asking()), VALUES)
        stored = await harness.journal.read(f"run/{run.id}")
        first = json.loads(stored[0].body)
        assert first["values"] == VALUES
        assert sent_inputs(first["umrf"]) == {"place": "valve_8", "torque": 6.5}
        assert run.sent_digest == first["sent_digest"] == digest(codec.read(first["umrf"]).graph)
        assert run.sent_digest != run.digest
        shown = run_view(run)
        assert (shown.values, shown.sent_digest) == (VALUES, run.sent_digest)
        assert hidden(shown).values is msgspec.UNSET
        assert await ended(control, run.id) == "finished"
        again = msgspec.structs.replace(asked, values={"Work_1": {"place": "valve_9"}})
        with pytest.raises(Conflict, match="another start"):
            await control.start(again, ANN)
        assert not (await control.start(asked, ANN)).fresh


@virtual
async def test_a_wrong_value_is_refused_with_its_place_and_nothing_is_stored() -> None:
    harness = Harness()
    async with harness.runner() as control:
        for place, values in {
            "/values/Work_1/torque": {"Work_1": {"place": "x", "torque": 61.0}},
            "/values/Work_1/place": {"Work_1": {"place": 7.0}},
            "/values/Work_0/speed": {"Work_0": {"speed": 1.0}},
            "/values/Work_9": {"Work_9": {}},
        }.items():
            with pytest.raises(BadInput) as refused:
                await control.start(order(asking(), values=values), ANN)
            assert (refused.value.where or {})["path"] == place
        assert not harness.journal.streams


@virtual
async def test_a_led_run_sends_the_values_with_the_piece_of_their_action() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        graph = asking(shared(sequence("task", 2), "Scout", "Carrier"))
        run = (await control.start(led(graph, values=VALUES), ANN)).run
        assert await ended(control, run.id) == "finished"
        (piece,) = lab.carol.starts
        (action,) = json.loads(piece.umrf)["actions"]
        assert action["input_parameters"]["place"]["pvf_value"] == "valve_8"
        assert lab.harness.journal.history(run.id).values == VALUES


@virtual
async def test_a_second_person_says_yes_to_these_values_and_to_no_others() -> None:
    david = Open(NEVER)
    david.known_actions = ()
    async with careful(Harness(), david) as control:
        graph = asking()
        first = order(graph, engine="David", values=VALUES)
        await control.approvals.give(ApprovalRequest(digest=first.digest), BEN)
        with pytest.raises(Conflict, match="yes to exactly this start"):
            await control.start(first, ANN)
        (look,) = await control.look(group(graph, "David", values=VALUES), "ann")
        assert (verdicts(look)["approved"], look.never) == ("blocked", True)
        await control.approvals.give(ApprovalRequest(digest=look.order_digest), BEN)
        (look,) = await control.look(group(graph, "David", values=VALUES), "ann")
        assert verdicts(look)["approved"] == "passed"
        other = {"Work_1": {"place": "valve_9", "torque": 6.5}}
        with pytest.raises(Conflict, match="yes to exactly this start"):
            await control.start(order(graph, engine="David", values=other), ANN)
        assert david.starts == []
        assert (await control.start(first, ANN)).fresh
        await until(lambda: len(david.starts) == 1)
        assert sent_inputs(david.starts[0].umrf)["place"] == "valve_8"
        control.stop_all(ANN)
        await until(lambda: not control.open)


@virtual
async def test_a_robot_for_released_versions_takes_no_value_that_only_a_mark_allows(
    releasing: Published,
) -> None:
    robot = Robot(engine(NEVER))
    async with lab(Harness({"David": robot}), Rules(released_only=True)) as control:
        graph = asking()
        releasing.digests.add(order(graph).digest)
        marked = order(graph, engine="David", values=VALUES)
        with pytest.raises(Conflict, match="this changes values in one"):
            await control.start(marked, ANN)
        assert robot.starts == []
        left_open = order(graph, engine="David", values={"Work_1": {"place": "valve_8"}})
        run = (await control.start(left_open, ANN)).run.id
        assert len(robot.starts) == 1
        await control.stop(run, ANN)
        await until(lambda: run not in control.open)


_NAMES = st.sampled_from(["a", "b"])
_ORDERS = st.fixed_dictionaries(
    {
        "values": st.dictionaries(
            _NAMES, st.dictionaries(_NAMES, st.sampled_from([1.0, 2.0, "1", True])), max_size=2
        ),
        "engine": st.sampled_from(["conducted", "David"]),
        "robots": st.dictionaries(_NAMES, st.sampled_from(["David", "Carol"])),
        "lost": st.sampled_from(["stop", "wait"]),
    }
)


_LIMITS = st.sampled_from([(), (Limit(parameter="torque", most=60),), (Limit(parameter="torque"),)])


@given(_ORDERS, _ORDERS, st.frozensets(_NAMES), st.frozensets(_NAMES), _LIMITS, _LIMITS)
def test_two_orders_have_one_digest_exactly_if_they_order_the_same(
    one: dict[str, Any],
    other: dict[str, Any],
    codes: frozenset[str],
    others: frozenset[str],
    limit: tuple[Limit, ...],
    bound: tuple[Limit, ...],
) -> None:
    def meant(parts: dict[str, Any], codes: frozenset[str], limits: tuple[Limit, ...]) -> str:
        is_led = parts["engine"] == "conducted"
        more = [parts["robots"], parts["lost"]] if is_led else []
        return json.dumps(
            [parts["values"], is_led, more, sorted(codes), str(limits)], sort_keys=True
        )

    def made(parts: dict[str, Any], codes: frozenset[str], limits: tuple[Limit, ...]) -> str:
        named = {"David": limits} if limits else {}
        return ordered(order(sequence(), **parts), "tree", codes, named).digest

    is_same = meant(one, codes, limit) == meant(other, others, bound)
    assert (made(one, codes, limit) == made(other, others, bound)) == is_same
    if meant(one, codes, limit) == meant({**one, "values": {}, "engine": "David"}, frozenset(), ()):
        assert made(one, codes, limit) == "tree"


def test_settings_of_the_command_line_name_one_input_each() -> None:
    def asked(action: str, name: str, kind: str = "string") -> AskedInput:
        return AskedInput(action=action, name=name, aid="a", type=kind, open=True)

    known = [asked("Go_0", "place"), asked("Go_1", "place"), asked("Go_1", "speed", "number")]
    assert values_of([("Go_0.place", "7"), ("speed", "7")], known) == {
        "Go_0": {"place": "7"},
        "Go_1": {"speed": 7},
    }
    for setting, why in {
        ("place", "x"): "several actions. One of: Go_0.place, Go_1.place",
        ("colour", "x"): "not asked for",
        ("speed", "fast"): "is no number",
    }.items():
        with pytest.raises(CannotStart, match=why):
            values_of([setting], known)
    with pytest.raises(CannotStart, match="twice"):
        values_of([("speed", "1"), ("Go_1.speed", "2")], known)


def test_a_group_gives_each_robot_the_values() -> None:
    asked = msgspec.structs.replace(group(sequence(), "David", "Carol"), values=VALUES)
    assert isinstance(asked, GroupRequest)
    assert asked.for_engine("Carol").values == VALUES
