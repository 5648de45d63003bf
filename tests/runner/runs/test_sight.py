"""What is left of robots and led runs for a person who may not see a graph."""

import msgspec

from action_assistant.runner.robots.registration import HeldGraph, Robot, seen_by
from action_assistant.runner.runs import views
from action_assistant.runner.runs.sight import HIDDEN_NAME, RunGraphs, Unseen
from runner.execution.test_conductor import Lab, shared
from runner.execution.test_led_rights import SLOW
from runner.harness import ANN, order, sequence, until, virtual

ANY = Unseen("vic")
SOME = Unseen("vic", frozenset({"secret"}))


def held(graph: str, run: str | None) -> HeldGraph:
    return HeldGraph(graph=graph, state="RUNNING", active=True, run=run, stopping=f"{graph} moves")


ROBOT = Robot(
    name="David",
    simulated=False,
    state="answering",
    holds=(
        held("patrol", "seen"),
        held("patrol__Fetch_1", None),
        held("CanaryErrand", "hidden"),
        held("CanaryErrand__Work_0", None),
        held("CanaryOfOthers", None),
        held("CanaryOfBefore", "forgotten"),
    ),
)


def names(unseen: Unseen | None) -> list[str]:
    runs = {"seen": RunGraphs("ann", ("open",)), "hidden": RunGraphs("ann", ("secret",))}
    found = seen_by(ROBOT, unseen, runs.get)
    assert unseen is not SOME or b"Canary" not in msgspec.json.encode(found)
    return [each.graph for each in found.holds]


def test_a_robot_names_only_graphs_that_the_reader_may_see() -> None:
    every = [each.graph for each in ROBOT.holds]
    assert names(None) == names(ANY) == every
    assert names(SOME) == ["patrol", "patrol__Fetch_1", *[HIDDEN_NAME] * 3]
    own = Unseen("ann", frozenset({"secret"}))  # who started it sees it, and not those of others
    assert names(own) == [*every[:4], *[HIDDEN_NAME] * 2]


def test_a_run_is_hidden_by_each_of_its_graphs_and_never_from_its_starter() -> None:
    of = RunGraphs("ann", ("open", "secret"))
    assert SOME.hides(of)
    assert not ANY.hides(of)
    assert ANY.hides(msgspec.structs.replace(of, unsighted=True))
    assert Unseen("vic", everything=True).hides(RunGraphs("ann", ()))
    for unseen in (SOME, ANY, Unseen("ann", everything=True)):
        assert not msgspec.structs.replace(unseen, person="ann").hides(of)


@virtual
async def test_a_hidden_led_run_shows_its_robots_their_rest_and_who_stopped_it() -> None:
    lab = Lab(SLOW)
    async with lab.runner() as control:
        graph = shared(sequence("CanaryTask", 4), "CanaryScout", "CanaryCarrier")
        robots = {"CanaryScout": "David", "CanaryCarrier": "Carol"}
        asked = order(graph, engine="conducted", robots=robots)
        run = (await control.start(asked, ANN)).run.id
        await until(lambda: lab.harness.journal.history(run).actions["Work_0"].state == "RUNNING")
        going = views.hidden(views.run_view(control.open[run].run))
        assert (going.hidden, going.state, going.graph_name) == (True, "running", HIDDEN_NAME)
        assert set(going.robots or {}) == {"David", "Carol"}
        assert isinstance(going.rests, list)
        assert {each.robot: each.state for each in going.rests} == {
            "David": "going",
            "Carol": "unused",
        }
        await control.stop(run, ANN)
        await until(lambda: run not in control.open)
        over = views.hidden(views.run_view(await control.find(run)))
        assert (over.state, over.stopped_by, over.proof_at is not None) == ("stopped", ANN, True)
        for shown in (going, over):
            text = msgspec.json.encode(shown)
            assert b"Canary" not in text
            assert b"Work" not in text
