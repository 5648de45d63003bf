"""The sight of runs: robots and led runs for a person who may not see a graph, and rules by starts."""

import contextlib
import json
from pathlib import Path

import msgspec
import pytest

from action_assistant.errors import Conflict, Forbidden, Unavailable
from action_assistant.runner.execution.start_checks import StartSources
from action_assistant.runner.robots.registration import HeldGraph, Robot, seen_by
from action_assistant.runner.runs import views
from action_assistant.runner.runs.sight import HIDDEN_NAME, RunGraphs, RunSight, Unseen
from action_assistant.web.auth.graph_rules import OPEN, Rule
from action_assistant.web.auth.graph_seals import GraphSeals, RulesFile, Sight, Statement
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Keys, Person
from runner.execution.test_conductor import Lab, shared
from runner.execution.test_led_rights import SLOW
from runner.harness import ANN, Harness, order, sequence, until, virtual

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
    assert Unseen("", everything=True).hides(RunGraphs("", ()))  # nobody has started nothing
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


KEYS = Keys("t" * 40)
VIC = Identity(Person("vic", "Vic", "viewer"))
CLOSED = Rule(("ann",), ())
NOW = 1_800_000_000_000_000  # microseconds since 1970
HOUR = 3_600_000_000


class Sights:
    """Gives a runner starts and statements, from which it learns rules. `at`: seconds after or before now."""

    def __init__(self, data: Path) -> None:
        self.data, self.now = data, NOW
        self.seals, self.runner = GraphSeals(KEYS), self.begun()

    def begun(self) -> RunSight:
        self.runner = RunSight(self.data, KEYS, lambda: self.now)
        return self.runner

    def say(self, at: int, rule: Rule) -> None:
        """Store a statement."""
        statement = Statement(NOW + at * 1_000_000, (rule,), {"g": 0})
        RulesFile(self.data, KEYS).store(self.seals.sealed(statement))

    async def start(self, at: int, rule: Rule, *graphs: str) -> None:
        """Start a version with its sight."""
        of = graphs or ("g",)
        sight = Sight("v", "d", of, (rule,) * len(of), NOW + at * 1_000_000)
        with contextlib.suppress(Forbidden):
            await self.runner.accept(self.seals.sealed(sight), "v", ("d",), VIC)

    @property
    def is_hidden(self) -> bool:
        return self.runner.hides(RunGraphs("ann", ("g",)), VIC)


async def test_a_sight_that_is_sent_again_later_lets_nobody_see_more(tmp_path: Path) -> None:
    sights = Sights(tmp_path)
    sights.say(-10, CLOSED)
    await sights.start(-5, CLOSED)  # the same as is known, and newer
    await sights.start(-7, OPEN)
    assert sights.is_hidden
    sights.begun()
    await sights.start(-6, OPEN)
    assert sights.is_hidden
    await sights.start(-4, OPEN)
    assert not sights.is_hidden
    await sights.start(-5, CLOSED)
    assert not sights.is_hidden


async def test_after_a_clock_was_set_back_the_narrower_rule_counts(tmp_path: Path) -> None:
    sights = Sights(tmp_path)
    sights.say(-10, CLOSED)
    sights.now = NOW + 2 * HOUR
    await sights.start(3600, OPEN)
    await sights.start(3601, CLOSED, "other")
    assert not sights.is_hidden
    sights.now = NOW
    sights.say(0, CLOSED)
    sights.begun()
    assert sights.is_hidden
    await sights.start(1, OPEN, "other")
    assert sights.runner.hides(RunGraphs("ann", ("other",)), VIC)


async def test_what_starts_teach_is_bounded_and_nothing_hidden_is_forgotten(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("action_assistant.runner.runs.sight._MOST_LEARNED", 3)
    sights = Sights(tmp_path)
    await sights.start(-9, CLOSED)
    await sights.start(-8, CLOSED, "a", "b")
    await sights.start(-7, OPEN, "a")
    await sights.start(-6, CLOSED, "c")
    assert set(json.loads((tmp_path / "graph-sights.json").read_text())) == {"g", "b", "c"}
    with pytest.raises(Unavailable, match="bring it all rules"):
        await sights.start(-5, CLOSED, "d")
    assert sights.is_hidden


@virtual
async def test_a_change_needs_the_sight_of_the_graph_that_is_sent(tmp_path: Path) -> None:
    """The sight of another version, which everybody may see, would show them what nobody has judged."""
    sights, harness = Sights(tmp_path), Harness()
    sights.say(0, CLOSED)
    harness.sources = StartSources(sight=sights.runner)
    first, second = order(sequence(), graph="g1"), order(sequence(actions=4))

    def sight(digest: str) -> Sight:
        at = NOW + 60_000_000
        return sights.seals.sealed(Sight("v1", digest, ("g1",), (OPEN,), at))

    def body(of: Sight) -> bytes:
        fields = {"version": "v1", "digest": second.digest, "umrf": second.umrf, "sight": of}
        return msgspec.json.encode(fields)

    script = msgspec.Raw(b'{"behaviours":{"*":[{"never":true}]}}')
    asked = msgspec.structs.replace(first, sight=sight(first.digest), script=script)
    async with harness.runner() as control:
        run = (await control.start(asked, ANN)).run.id
        await until(lambda: control.open[run].run.state == "running")
        with pytest.raises(Conflict, match="not known who may see"):
            await control.modify(run, body(sight(first.digest)), ANN)
        await control.modify(run, body(sight(second.digest)), ANN)
        assert len(control.open[run].run.actions) == 4
        control.stop_all(ANN)
        await until(lambda: run not in control.open)
