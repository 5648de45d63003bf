"""The look at a robot before an action of a led run begins there: one place, for each action."""

from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import Refused
from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.execution.led_look import LedLook
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Registration
from action_assistant.runner.runs.events import Override
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest, GroupRequest, WordRequest
from action_assistant.runner.start.preflight import Item
from action_assistant.umrf.model import Conditions
from runner.execution.test_conductor import Lab, led, refused, shared
from runner.harness import ANN, BEN, ended, engine, order, sequence, two_ends, until, virtual

#: A rule of a later version, which is broken.
CLOSED = Item(code="later", verdict="blocked", text="The baton of this robot is elsewhere.")
BY_WORD = Override(("indexing",), "I have started it with rate 0.")


class LaterRule:
    """A rule that a later version adds to the look at a robot. `asked`: the robots in turn."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.is_broken = False
        self.takes_s = 0.0
        self.asked: list[str] = []
        items = LedLook.items

        async def with_rule(look: LedLook, robot: Any, *more: Any) -> list[Item]:
            self.asked.append(robot.registration.name)
            await anyio.sleep(self.takes_s)
            found = await items(look, robot, *more)
            return [*found, CLOSED] if self.is_broken else found

        monkeypatch.setattr(LedLook, "items", with_rule)


async def go_on(control: ExecutionService, run: str) -> None:
    """Let a run go on once it is held."""
    await until(lambda: control.open[run].run.held is not None)
    held = control.open[run].run.held
    assert held is not None
    await control.go_on(run, GoOnRequest(time(held.at)), BEN)


async def kept(control: ExecutionService, run: str) -> None:
    """Try to let a run go on, which the rule forbids."""
    with pytest.raises(Refused, match=CLOSED.text):
        await go_on(control, run)
    assert control.open[run].run.held is not None


@virtual
async def test_a_rule_of_the_look_keeps_every_action_from_its_robot(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """At the start, with a later piece, after *go on*, after a restart, and after a word."""
    rule = LaterRule(monkeypatch)
    lab = Lab({"*": [{"after_s": 5}]})
    request = led(shared(sequence("task", 4), "Scout", "Carrier"), lost="wait")

    def sent() -> int:
        return len(lab.david.starts) + len(lab.carol.starts)

    async with lab.runner() as control:
        rule.is_broken = True
        assert CLOSED.text in await refused(control, request)
        looks = await control.look(_group(request))
        assert [CLOSED in each.items for each in looks] == [False, True, True]
        assert sent() == 0
        rule.is_broken = False
        run = (await control.start(request, ANN)).run.id
        await until(lambda: sent() == 1)
        rule.is_broken = True  # a later piece
        await until(lambda: control.open[run].run.held is not None)
        assert CLOSED.text in control.open[run].run.alarms[-1].text
        await kept(control, run)
        await anyio.sleep(20)
        assert sent() == 1
    async with lab.runner() as control:  # after a restart
        await kept(control, run)
        await anyio.sleep(20)
        assert sent() == 1
        rule.is_broken = False
        await go_on(control, run)
        await until(lambda: sent() == 2)
        await until(lambda: control.open[run].run.actions["Work_1"].state == "RUNNING")
        rule.is_broken = True
        lab.carol.engine = engine({"*": [{"after_s": 5}]})  # its outcome is not known
        await until(lambda: control.open[run].run.held is not None)
        piece = control.open[run].run.actions["Work_1"].piece
        await control.confirm_rest(piece, RestRequest("I stand beside it."), BEN)
        await until(lambda: "without an outcome" in control.open[run].run.alarms[-1].text)
        word = WordRequest(action="Work_1", outcome="true", reason="It stands at the door.")
        await control.give_outcome(run, word, BEN)
        await anyio.sleep(1)
        await kept(control, run)
        await anyio.sleep(20)
        assert sent() == 2
        await control.stop(run, BEN)
        assert await ended(control, run) in {"stopped", "error"}
        assert sent() == 2
    assert rule.asked.count("David") > 3
    assert "Carol" in rule.asked


@virtual
async def test_an_answer_is_too_old_for_a_piece_after_a_rule_that_has_waited(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lab = Lab({"*": [{"after_s": 2}]})
    rule = LaterRule(monkeypatch)
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        rule.takes_s = 4
        await until(lambda: control.open[run].run.held is not None)
        held = control.open[run].run.held
        assert held is not None
        assert "too late" in held.why
        assert lab.carol.starts == []
        rule.takes_s = 0
        await go_on(control, run)
        assert await ended(control, run) == "finished"


def _group(request: Any) -> GroupRequest:
    """Return the pre-flight of a start."""
    same = ("umrf", "version", "digest", "override", "robots", "lost", "graph")
    fields = {each: getattr(request, each) for each in same}
    return GroupRequest(**fields, engines=(request.engine,))


async def of_carol(control: ExecutionService, request: Any) -> Item:
    """Return what a pre-flight says about indexing on Carol."""
    (found,) = [each for each in await control.look(_group(request)) if each.engine == "Carol"]
    (item,) = [each for each in found.items if each.code == "indexing"]
    return item


@virtual
async def test_an_engine_that_is_seen_to_index_is_not_led_whatever_is_said() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    lab.carol.indexes = True
    async with lab.runner() as control:
        request = led(shared(sequence("task", 2), "Scout", "Carrier"), override=BY_WORD)
        assert "The engine of Carol indexes again and again" in await refused(control, request)
        item = await of_carol(control, request)
        assert (item.verdict, item.overridable) == ("blocked", False)
        # Graphs are handed over to it as before.
        assert await control.start(led_alone("Carol"), ANN)


@virtual
async def test_an_engine_whose_build_can_be_asked_while_it_indexes_is_led() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    lab.carol.indexes = lab.david.indexes = True
    async with lab.runner() as control:
        for name in ("David", "Carol"):
            profile: dict[str, object] = {"hazards": ["H4", "H5"]}
            control.robots.add(Registration(name=name, led=True, profile=profile))
        await anyio.sleep(1)
        run = await control.start(led(shared(sequence("task", 2), "Scout", "Carrier")), ANN)
        assert await ended(control, run.run.id) == "finished"


@virtual
async def test_a_word_about_indexing_counts_for_one_life_of_the_engine() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    lab.carol.indexes = None
    graph = shared(sequence("task", 2), "Scout", "Carrier")
    async with lab.runner() as control:
        assert "How the engine of Carol was started cannot be seen" in await refused(
            control, led(graph)
        )
        run = (await control.start(led(graph, override=BY_WORD), ANN)).run.id
        assert await ended(control, run) == "finished"
        (despite,) = (await control.find(run)).despite
        assert despite.code == "indexing"
        assert despite.text.startswith("How the engine of Carol")
    async with lab.runner() as control:  # another process of the runner, the same engine
        item = await of_carol(control, led(graph))
        assert item.verdict == "passed"
        assert "Ann said" in item.text
        assert "I have started it with rate 0." in item.text
        run = (await control.start(led(graph), ANN)).run.id
        assert await ended(control, run) == "finished"
        lab.carol.engine = engine({"*": [{"after_s": 1}]})
        await anyio.sleep(15)
        assert "cannot be seen" in await refused(control, led(graph))


@virtual
async def test_a_word_that_cannot_be_stored_starts_nothing() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    lab.carol.indexes = None
    async with lab.runner() as control:
        lab.harness.journal.down = True
        request = led(shared(sequence("task", 2), "Scout", "Carrier"), override=BY_WORD)
        with pytest.raises(Refused):
            await control.start(request, ANN)
        lab.harness.journal.down = False
        await anyio.sleep(10)
        assert lab.david.starts == lab.carol.starts == []


def led_alone(robot: str) -> Any:
    """A start of a graph that one robot is handed over."""
    request = led(sequence("alone", 1))
    return msgspec.structs.replace(request, engine=robot, robots={})


@virtual
async def test_two_actors_on_one_robot_are_two_at_once_and_two_on_two_robots_are_not() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    graph = shared(two_ends("task"), "Scout", "Carrier")
    ends = Override(("H12",), "I look.")

    def cast(**robots: str) -> Any:
        return order(graph, engine="conducted", robots=robots, override=ends)

    async with lab.runner() as control:
        why = await refused(control, cast(Scout="David", Carrier="David"))
        assert "Work_0 may run at the same time as Work_1, both on David." in why
        for robots in ({"Scout": "David", "Carrier": "Carol"}, {"Scout": "David"}):
            run = (await control.start(cast(**{"Carrier": "simulator"} | robots), ANN)).run.id
            assert await ended(control, run) == "finished"
        run = (await control.start(cast(Scout="simulator", Carrier="simulator"), ANN)).run.id
        assert await ended(control, run) == "finished"


@virtual
async def test_a_stop_arrow_within_one_robot_has_to_be_accepted_too() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    stop = Conditions(on_true="stop", on_false="stop", on_error="stop")
    line = shared(sequence("task", 2), "Scout")
    one, two = (each.key for each in line.actions)
    relations = tuple(
        msgspec.structs.replace(each, conditions=stop)
        if (each.parent, each.child) == (one, two)
        else each
        for each in line.relations
    )
    async with lab.runner() as control:
        request = order(
            msgspec.structs.replace(line, relations=relations),
            engine="conducted",
            robots={"Scout": "David"},
        )
        assert "Work_0 on David stops Work_1 on David" in await refused(control, request)


@virtual
async def test_the_look_before_a_start_says_which_robots_move() -> None:
    lab = Lab()
    graph = shared(sequence("task", 3), "Scout", "Carrier")
    async with lab.runner() as control:
        for robots, words in (
            (
                ("David", "simulator"),
                "David (2 actions) may begin to move at any time until the run ends. The "
                "simulator plays 1 other action and moves nothing.",
            ),
            (("David", "Carol"), "Carol (1 action), David (2 actions) may begin to move"),
            (("simulator", "simulator"), "Only the simulator plays: nothing moves."),
        ):
            cast = dict(zip(("Scout", "Carrier"), robots, strict=True))
            request = order(graph, engine="conducted", robots=cast)
            same = ("umrf", "version", "digest", "robots", "graph")
            fields = {each: getattr(request, each) for each in same}
            first = (await control.look(GroupRequest(**fields, engines=("conducted",))))[0]
            (item,) = (each for each in first.items if each.code == "moves")
            assert words in item.text
