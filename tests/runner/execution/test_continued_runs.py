"""Runs that continue one that ended, or begin in the middle: what begins, and what may not."""

import anyio
import msgspec
import pytest

from action_assistant.errors import BadInput, Conflict, Forbidden, NotFound
from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.execution.led_commands import operator_of
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs import queries, views
from action_assistant.runner.runs.earlier import Choice, StartFrom
from action_assistant.runner.runs.earlier_views import EarlierShown, StartFromShown
from action_assistant.runner.runs.events import PieceBegan, PlayBegan
from action_assistant.runner.start.admission import (
    GoOnRequest,
    GroupRequest,
    StartRequest,
)
from action_assistant.runner.start.approvals import ApprovalRequest
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.digest import digest
from action_assistant.umrf.facts import SECOND_PERSON
from action_assistant.umrf.model import Conditions, Parameter, Relation
from action_assistant.web.auth.identity import Token
from runner.execution.test_conductor import Lab, led, shared
from runner.execution.test_led_breakpoints import held_at
from runner.execution.test_led_simulated import giving, simulated, visits
from runner.execution.test_led_steps import now, ready
from runner.harness import (
    ANN,
    BEN,
    Harness,
    carousel,
    ended,
    engine,
    order,
    sequence,
    two_lines,
    until,
    virtual,
)


def begun(harness: Harness, run: str) -> list[str]:
    """Return the actions that have begun in a run, in order."""
    return [
        each.node for each in harness.journal.told(run) if isinstance(each, PlayBegan | PieceBegan)
    ]


def on(start: StartRequest, run: str, /, reason: str = "", **choices: Choice) -> StartRequest:
    """The start once more, to continue a run."""
    since = StartFrom(run=run, choices=choices, reason=reason)
    return msgspec.structs.replace(start, start_from=since, request_id=f"again{run}{len(choices)}")


async def stopped_in(control: ExecutionService, start: StartRequest, node: str) -> str:
    """Start a run, and stop it once an action moves; return its id when it has ended."""
    run = (await control.start(start, ANN)).run.id
    await until(lambda: now(control, run).actions[node].state == "RUNNING")
    await anyio.sleep(0.5)
    await control.stop(run, BEN)
    assert await ended(control, run) == "stopped"
    return run


async def looked(control: ExecutionService, start: StartRequest) -> EarlierShown:
    """Return what the look before a start says that it takes for granted."""
    (look, *_) = await control.look(asked(start), "ann")
    assert look.earlier is not None
    return look.earlier


def asked(start: StartRequest) -> GroupRequest:
    fields = msgspec.structs.asdict(start)
    known = {name: fields[name] for name in GroupRequest.__struct_fields__ if name in fields}
    return GroupRequest(engines=(start.engine,), **known)


# --- continue, in the simulator ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("choice", "then"),
    [("again", ["Work_1", "Work_2", "Work_3"]), ("true", ["Work_2", "Work_3"])],
)
def test_a_stopped_run_is_continued_where_it_was_and_plays_nothing_twice(
    choice: Choice, then: list[str]
) -> None:
    @virtual
    async def lived() -> None:
        harness = Harness()
        async with harness.runner() as control:
            start = simulated(sequence("task", 4))
            first = await stopped_in(control, start, "Work_1")
            request = on(start, first, "I saw it end.", Work_1=choice)
            run = (await control.start(request, ANN)).run.id
            assert await ended(control, run) == "finished"
            assert begun(harness, run) == then
            assert begun(harness, first) == ["Work_0", "Work_1"]
            found = harness.journal.history(run)
            assert found.result == "on_true"
            assert found.actions["Work_0"].visits == ()
            assert (await control.start(request, ANN)).fresh is False

    lived()


@virtual
async def test_the_look_lists_what_was_under_way_and_the_age_of_each_outcome() -> None:
    async with Harness().runner() as control:
        start = simulated(sequence("task", 4))
        first = await stopped_in(control, start, "Work_1")
        (look, *_) = await control.look(asked(on(start, first)), "ann")
        assert look.never
        (lacks,) = [each for each in look.items if each.code == "choices"]
        assert lacks.verdict == "blocked"
        assert "Work_1 had begun" in lacks.text
        shown = look.earlier
        assert shown is not None
        assert [(each.action, each.robot) for each in shown.under_way] == [("Work_1", "simulator")]
        assert [(each.action, each.outcome) for each in shown.assumed] == [("Work_0", "true")]
        end = (await control.find(first)).actions["Work_0"].visits[-1].not_after
        assert end is not None
        assert shown.assumed[0].at is not None
        assert abs(views.microseconds(shown.assumed[0].at) - end) < 100_000
        chosen = await looked(control, on(start, first, Work_1="again"))
        assert chosen.begins == ("Work_1",)


@virtual
async def test_nothing_begins_without_a_choice_for_each_action_that_was_under_way() -> None:
    harness = Harness()
    async with harness.runner() as control:
        start = simulated(two_lines())
        first = (await control.start(start, ANN)).run.id
        await anyio.sleep(3)
        going = [n for n, each in now(control, first).actions.items() if each.state == "RUNNING"]
        assert len(going) == 2
        await control.stop(first, BEN)
        assert await ended(control, first) == "stopped"
        for choices in ({}, {going[0]: "again"}):
            with pytest.raises(Conflict, match="had no outcome"):
                await control.start(on(start, first, **choices), ANN)
        with pytest.raises(Conflict, match="was not under way"):
            await control.start(on(start, first, **dict.fromkeys([*going, "No_1"], "again")), ANN)
        with pytest.raises(BadInput, match="how you know"):
            await control.start(on(start, first, **dict.fromkeys(going, "true")), ANN)
        assert len(await control.history.rows(queries.of_start("again"))) == 0
        left = on(start, first, **{going[0]: "leave", going[1]: "again"})
        run = (await control.start(left, ANN)).run.id
        await until(lambda: bool(begun(harness, run)))
        assert begun(harness, run) == [going[1]]
        await anyio.sleep(30)
        assert going[0] not in begun(harness, run)


@virtual
async def test_leaving_an_action_is_refused_where_an_arrow_of_its_stop_leads_on() -> None:
    async with Harness().runner() as control:
        graph = sequence("task", 2)
        after = tuple(
            msgspec.structs.replace(each, conditions=Conditions("run", "run", "run", "run"))
            if each.parent == graph.actions[0].key
            else each
            for each in graph.relations
        )
        start = simulated(msgspec.structs.replace(graph, relations=after))
        first = await stopped_in(control, start, "Work_0")
        with pytest.raises(Conflict, match="Work_1 would begin after Work_0"):
            await control.start(on(start, first, Work_0="leave"), ANN)


@virtual
async def test_what_only_waited_to_begin_begins_without_a_question() -> None:
    harness = Harness()
    async with harness.runner() as control:
        start = simulated(sequence("task", 3), Breakpoint(action="Work_1"))
        first = (await control.start(start, ANN)).run.id
        await held_at(control, first)
        await ready(control, first, "Work_1")
        await control.stop(first, BEN)
        assert await ended(control, first) == "stopped"
        again = msgspec.structs.replace(on(start, first), breakpoints=())
        shown = await looked(control, again)
        assert (shown.under_way, shown.begins) == ((), ("Work_1",))
        run = (await control.start(again, ANN)).run.id
        assert await ended(control, run) == "finished"
        assert begun(harness, run) == ["Work_1", "Work_2"]


@virtual
async def test_visits_and_breakpoints_of_a_loop_count_on() -> None:
    async with Harness().runner() as control:
        graph = carousel()
        start = simulated(graph)
        first = (await control.start(start, ANN)).run.id
        await until(lambda: visits(control, first)["Work_0"] == 3)
        await anyio.sleep(1)
        await control.stop(first, BEN)
        assert await ended(control, first) == "stopped"
        mark = Breakpoint(action="Work_0", visit=5)
        again = msgspec.structs.replace(on(start, first, Work_0="again"), breakpoints=(mark,))
        run = (await control.start(again, ANN)).run.id
        assert await held_at(control, run) == ("breakpoint", "Breakpoint before Work_0, visit 5.")
        assert visits(control, run) == {"Work_0": 2, "Work_1": 2}
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"


@virtual
async def test_a_continued_run_takes_its_values_and_can_be_continued_again() -> None:
    harness = Harness()
    async with harness.runner() as control:
        graph = giving(sequence("task", 4), "force")
        second = msgspec.structs.replace(
            graph.actions[1], inputs=(Parameter("force", '{"pvf_type": "number"}'),)
        )
        graph = msgspec.structs.replace(
            graph, actions=(graph.actions[0], second, *graph.actions[2:])
        )
        start = simulated(graph, Work_0=[{"after_s": 2, "outputs": {"force": 70}}])
        first = await stopped_in(control, start, "Work_1")
        again = on(start, first, Work_1="again")
        (value,) = (await looked(control, again)).values
        assert (value.action, value.name, value.source, value.text) == (
            "Work_1",
            "force",
            "Work_0",
            "70.0",
        )
        run = await stopped_in(control, again, "Work_2")
        taken = harness.journal.history(run).actions["Work_1"].visits[-1].inputs
        assert taken == {"force": "70"}
        third = on(start, run, Work_2="again")
        ages = {each.action: each.at for each in (await looked(control, third)).assumed}
        assert ages["Work_0"] < ages["Work_1"]
        last = (await control.start(third, ANN)).run.id
        assert await ended(control, last) == "finished"
        assert begun(harness, last) == ["Work_2", "Work_3"]


@virtual
async def test_a_run_is_continued_once() -> None:
    async with Harness().runner() as control:
        start = simulated(sequence("task", 3))
        first = await stopped_in(control, start, "Work_1")
        again = on(start, first, Work_1="again")
        second = (await control.start(again, ANN)).run
        other = msgspec.structs.replace(again, request_id="another press")
        with pytest.raises(Conflict, match=f"Run {second.number} has continued run"):
            await control.start(other, ANN)
        assert await ended(control, second.id) == "finished"


@virtual
async def test_of_two_people_who_continue_a_run_at_once_one_is_refused() -> None:
    refused: list[str] = []
    async with Harness().runner() as control:
        start = simulated(sequence("task", 3))
        first = await stopped_in(control, start, "Work_1")
        again = on(start, first, Work_1="again")

        async def press(request_id: str) -> None:
            try:
                await control.start(msgspec.structs.replace(again, request_id=request_id), ANN)
            except Conflict as why:
                refused.append(str(why))

        async with anyio.create_task_group() as people:
            people.start_soon(press, "Ann's press")
            people.start_soon(press, "Ben's press")
        assert len(refused) == 1
        assert "has continued run" in refused[0]


@virtual
async def test_only_a_led_run_of_this_version_that_is_over_is_continued() -> None:
    async with Harness().runner() as control:
        start = simulated(sequence("task", 3))
        whole = (await control.start(order(sequence("task", 3)), ANN)).run
        assert await ended(control, whole.id) == "finished"
        with pytest.raises(Conflict, match="was not led"):
            await control.start(on(start, whole.id), ANN)
        with pytest.raises(NotFound):
            await control.start(on(start, "nobody"), ANN)
        going = (await control.start(start, ANN)).run.id
        with pytest.raises(Conflict, match="is not over"):
            await control.start(on(start, going), ANN)
        assert await ended(control, going) == "finished"
        with pytest.raises(Conflict, match="Nothing would begin"):
            await control.start(on(start, going), ANN)
        stopped = await stopped_in(
            control, msgspec.structs.replace(start, request_id="once more"), "Work_1"
        )
        other = on(simulated(sequence("task", 4)), stopped, Work_1="again")
        with pytest.raises(Conflict, match="another version"):
            await control.start(other, ANN)
        values = msgspec.structs.replace(
            on(start, stopped, Work_1="again"), values={"Work_0": {"force": 1.0}}
        )
        with pytest.raises((Conflict, BadInput)):
            await control.start(values, ANN)
        elsewhere = msgspec.structs.replace(on(start, stopped, Work_1="again"), graph="g2")
        with pytest.raises(Conflict, match="another graph"):
            await control.start(elsewhere, ANN)
        plain = msgspec.structs.replace(
            on(start, stopped, Work_1="again"), engine="simulator", robots={}
        )
        with pytest.raises(BadInput, match="led step by step"):
            await control.start(plain, ANN)


@virtual
async def test_a_program_states_no_outcome() -> None:
    async with Harness().runner() as control:
        start = simulated(sequence("task", 3))
        first = await stopped_in(control, start, "Work_1")
        token = msgspec.structs.replace(
            operator_of(ANN),
            token=Token("t", "nightly", operator_of(ANN).person, frozenset({"simulate"})),
        )
        with pytest.raises(Forbidden, match="takes a person"):
            await control.start(on(start, first, "The log says so.", Work_1="true"), ANN, token)
        assert (await control.start(on(start, first, Work_1="again"), ANN, token)).fresh


# --- continue, on robots ------------------------------------------------------------------------------


@pytest.mark.parametrize("choice", ["again", "true", "false"])
def test_robots_get_what_was_under_way_again_only_if_a_person_chose_that(choice: Choice) -> None:
    @virtual
    async def lived() -> None:
        lab = Lab({"*": [{"after_s": 5}]})
        async with lab.runner() as control:
            start = led(shared(sequence("task", 4), "Scout", "Carrier"))
            first = await stopped_in(control, start, "Work_1")
            before = len(lab.david.starts), len(lab.carol.starts)
            assert before == (1, 1)
            request = on(start, first, "The pallet stands there.", Work_1=choice)
            run = (await control.start(request, ANN)).run.id
            assert await ended(control, run) == "finished"
            sent_now = [each.graph.name for each in lab.carol.starts[1:]]
            is_again = choice == "again"
            assert sent_now == (["task--Work_1"] if is_again else []) + ["task--Work_3"]
            assert [each.graph.name for each in lab.david.starts[1:]] == ["task--Work_2"]
            found = lab.harness.journal.history(run)
            assert found.result == "on_true"
            assert found.rests.keys() == {f"{run}.{n}" for n in (2, 3)} or not is_again

    lived()


@virtual
async def test_nothing_is_continued_until_each_robot_is_at_rest_or_was_looked_at() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        start = led(shared(sequence("task", 3), "Scout", "Carrier"))
        run = (await control.start(start, ANN)).run.id
        await until(lambda: now(control, run).actions["Work_0"].state == "RUNNING")
        piece = now(control, run).actions["Work_0"].piece
        lab.david.engine = engine({"*": [{"after_s": 5}]})  # it was restarted
        await until(lambda: now(control, run).desired == "stopped")
        await anyio.sleep(30)
        again = on(start, run, Work_0="again")
        with pytest.raises(Conflict, match="is not over"):
            await control.start(again, ANN)
        await control.confirm_rest(piece, RestRequest("I stand beside it."), BEN)
        assert await ended(control, run) == "error"
        shown = await looked(control, again)
        assert [each.action for each in shown.under_way] == ["Work_0"]
        async with anyio.create_task_group() as engines:
            engines.start_soon(lab.david.engine.run)
            second = (await control.start(again, ANN)).run.id
            assert await ended(control, second) == "finished"
            engines.cancel_scope.cancel()
        assert begun(lab.harness, second) == ["Work_0", "Work_1", "Work_2"]


@virtual
async def test_a_runner_that_restarts_takes_a_continued_run_up_where_it_was() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    start = led(shared(sequence("task", 5), "Scout", "Carrier"))
    async with lab.runner() as control:
        first = await stopped_in(control, start, "Work_1")
        run = (await control.start(on(start, first, Work_1="again"), ANN)).run.id
        await until(lambda: now(control, run).actions["Work_2"].state == "RUNNING")
    async with lab.runner() as control:
        await anyio.sleep(30)
        held = now(control, run).held
        assert held is not None
        assert begun(lab.harness, run) == ["Work_1", "Work_2"]
        await control.go_on(run, GoOnRequest(views.time(held.at)), ANN)
        assert await ended(control, run) == "finished"
        assert begun(lab.harness, run) == [f"Work_{n}" for n in range(1, 5)]
        assert len(lab.david.starts) + len(lab.carol.starts) == 6


@virtual
async def test_a_run_is_continued_on_its_own_robots() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        start = led(shared(sequence("task", 3), "Scout", "Carrier"))
        first = await stopped_in(control, start, "Work_1")
        swapped = msgspec.structs.replace(
            on(start, first, Work_1="again"), robots={"Scout": "Carol", "Carrier": "David"}
        )
        with pytest.raises(Conflict, match="had other robots"):
            await control.start(swapped, ANN)


@virtual
async def test_an_action_that_an_arrow_stops_is_stopped_in_the_continued_run_too() -> None:
    """An action that an arrow has stopped counts as stopped, never as done."""
    harness = Harness()
    async with harness.runner() as control:
        graph = sequence("task", 3)
        first, second, third = (each.key for each in graph.actions)
        after_stop = Conditions(on_stopped="run")
        entry = next(each for each in graph.relations if each.child == first)
        relations = (
            entry,
            msgspec.structs.replace(entry, child=second, parent_order=1.0),
            Relation(parent=first, child=second, conditions=Conditions("stop"), required=False),
            Relation(parent=second, child=third, conditions=after_stop, required=False),
            *(each for each in graph.relations if each.parent == third),
        )
        graph = msgspec.structs.replace(graph, relations=relations)
        start = simulated(graph, Work_1=[{"never": True, "stop_s": 0.2}])
        run = await stopped_in(control, start, "Work_2")
        shown = await looked(control, on(start, run, Work_2="again"))
        outcomes = {each.action: each.outcome for each in shown.assumed}
        assert outcomes == {"Work_0": "true", "Work_1": "stopped"}
        again = (await control.start(on(start, run, Work_2="again"), ANN)).run.id
        assert await ended(control, again) == "finished"
        assert begun(harness, again) == ["Work_2"]


# --- the part of a graph ------------------------------------------------------------------------------


def part(start: StartRequest, *at: str, run: str = "", only: bool = False) -> StartRequest:
    return msgspec.structs.replace(
        start, start_from=StartFrom(run=run, at=at, only=only), request_id=f"part{at}{only}"
    )


@pytest.mark.parametrize("engine", ["conducted", "simulator"])
def test_a_run_begins_at_an_action_and_says_so(engine: str) -> None:
    @virtual
    async def lived() -> None:
        harness = Harness()
        async with harness.runner() as control:
            graph = sequence("task", 4)
            start = simulated(graph) if engine == "conducted" else order(graph)
            run = (await control.start(part(start, "Work_2"), ANN)).run
            assert await ended(control, run.id) == "finished"
            found = harness.journal.history(run.id)
            assert set(found.actions) == {"Work_2", "Work_3"}
            assert all(each.visits for each in found.actions.values())
            assert found.digest == digest(graph)
            assert found.sent_digest not in {"", found.digest}
            assert found.earlier is not None
            assert found.earlier.skipped == ("Work_0", "Work_1")
            assert [each.action for each in found.earlier.assumed] == ["Work_1"]
            shown = views.run_view(found).start_from
            assert isinstance(shown, StartFromShown)
            assert (shown.at, shown.only, shown.number) == (("Work_2",), False, 0)

    lived()


@virtual
async def test_only_the_robots_of_a_part_are_needed_and_kept() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        start = led(shared(sequence("task", 4), "Scout", "Carrier"))
        run = (await control.start(part(start, "Work_1", only=True), ANN)).run
        assert run.robots == ("Carol",)
        assert await ended(control, run.id) == "finished"
        assert lab.david.starts == []
        assert [each.graph.name for each in lab.carol.starts] == ["task--Work_1"]
        again = await control.start(part(start, "Work_1", only=True), ANN)
        assert (again.fresh, again.run.id) == (False, run.id)


@virtual
async def test_a_part_takes_the_values_of_an_earlier_run() -> None:
    harness = Harness()
    async with harness.runner() as control:
        graph = giving(sequence("task", 3), "force")
        second = msgspec.structs.replace(
            graph.actions[1], inputs=(Parameter("force", '{"pvf_type": "number"}'),)
        )
        graph = msgspec.structs.replace(
            graph, actions=(graph.actions[0], second, *graph.actions[2:])
        )
        start = simulated(graph, Work_0=[{"after_s": 2, "outputs": {"force": 70}}])
        first = (await control.start(start, ANN)).run.id
        assert await ended(control, first) == "finished"
        run = (await control.start(part(start, "Work_1", run=first), ANN)).run.id
        assert await ended(control, run) == "finished"
        found = harness.journal.history(run)
        assert found.earlier is not None
        assert [each.outcome for each in found.earlier.assumed] == ["on_true"]
        assert found.actions["Work_1"].visits[-1].inputs == {"force": "70"}


@virtual
async def test_a_value_that_no_run_has_given_is_asked_for_and_never_made_up() -> None:
    async with Harness().runner() as control:
        graph = giving(sequence("task", 3), "force")
        second = msgspec.structs.replace(
            graph.actions[1], inputs=(Parameter("force", '{"pvf_type": "number"}'),)
        )
        graph = msgspec.structs.replace(
            graph, actions=(graph.actions[0], second, *graph.actions[2:])
        )
        start = simulated(graph)
        with pytest.raises(Conflict, match="force"):
            await control.start(part(start, "Work_1"), ANN)
        given = msgspec.structs.replace(part(start, "Work_1"), values={"Work_1": {"force": 3.0}})
        run = (await control.start(given, ANN)).run.id
        assert await ended(control, run) == "finished"


@virtual
async def test_the_yes_of_a_second_person_covers_where_a_run_begins() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        for name in ("David", "Carol"):
            robot = control.robots.registration(name)
            control.robots.add(
                msgspec.structs.replace(robot, profile=robot.profile | {SECOND_PERSON: True})
            )
        await anyio.sleep(1)
        start = led(shared(sequence("task", 4), "Scout", "Carrier"))
        orders = set[str]()
        for each in (
            start,
            part(start, "Work_1"),
            part(start, "Work_2"),
            part(start, "Work_1", only=True),
        ):
            orders |= {look.order_digest for look in await control.look(asked(each), "ann")} - {""}
        assert len(orders) == 4
        (look, *_) = [
            each
            for each in await control.look(asked(part(start, "Work_2", only=True)), "ann")
            if each.order_digest
        ]
        await control.approvals.give(ApprovalRequest(digest=look.order_digest), BEN)
        with pytest.raises(Conflict, match="nobody else has said yes"):
            await control.start(part(start, "Work_1"), ANN)
        run = (await control.start(part(start, "Work_2", only=True), ANN)).run.id
        assert await ended(control, run) == "finished"


@virtual
async def test_a_start_that_says_no_place_to_begin_is_refused() -> None:
    async with Harness().runner() as control:
        start = simulated(sequence("task", 3))
        with pytest.raises(BadInput, match="no action Nobody_0"):
            await control.start(part(start, "Nobody_0"), ANN)
        since = StartFrom(run="r", at=("Work_1",), choices={"Work_0": "again"})
        with pytest.raises(BadInput, match="Choices are for"):
            await control.start(msgspec.structs.replace(start, start_from=since), ANN)
        with pytest.raises(BadInput, match="which run is continued"):
            await control.start(msgspec.structs.replace(start, start_from=StartFrom()), ANN)
