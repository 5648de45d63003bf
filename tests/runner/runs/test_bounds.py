"""Bounds of visits contain what really happened, however much is lost or late."""

import os
from itertools import accumulate
from random import Random
from typing import Any

import msgspec
from hypothesis import HealthCheck, Phase, example, given, settings
from hypothesis import strategies as st

from action_assistant.runner.execution.evidence import newer_than_answers
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.runs.counts import visit_counts
from action_assistant.runner.runs.events import Observed, Published
from action_assistant.runner.runs.fold import follow, is_news, replay, thin
from action_assistant.runner.runs.run import Run
from runner.bounds import GRAPHS, NetworkFaults, Real, fit_apart, fits, lived
from runner.runs.test_runs import REQUESTED
from support.doses import examples

CALL = st.fixed_dictionaries(
    {
        "after_s": st.one_of(st.floats(0.01, 0.4), st.floats(0.4, 7.0)),
        "result": st.sampled_from(["on_true", "on_true", "on_true", "on_false", "on_error"]),
        "stop_s": st.sampled_from([0.05, 0.5, 4.0]),
    },
    optional={"ignores_stop": st.just(True)},
)
SCRIPTS = st.dictionaries(
    st.sampled_from(["Work_0", "Work_1", "Work_2", "*"]),
    st.lists(CALL, min_size=1, max_size=3),
    max_size=4,
)
NETWORKS = st.builds(
    NetworkFaults,
    loss=st.sampled_from([0.0, 0.15, 0.5, 0.95]),
    get_loss=st.sampled_from([0.0, 0.0, 0.3]),
    old_s=st.sampled_from([0.0, 0.05, 0.9]),
    feedback_s=st.sampled_from([0.0, 0.02, 1.5]),
    seed=st.integers(0, 10_000),
)
CALM = NetworkFaults()


@settings(
    max_examples=int(os.environ.get("BOUNDS_HISTORIES", "20")),
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    phases=[Phase.explicit, Phase.reuse, Phase.generate, Phase.shrink],
)
@given(
    graph=st.sampled_from(sorted(GRAPHS)),
    script=SCRIPTS,
    network=NETWORKS,
    stop=st.none() | st.floats(0.1, 15.0),
)
@example(graph="line", script={"*": [{"after_s": 0.1}]}, network=CALM, stop=None)
@example(graph="line", script={"*": [{"after_s": 3.0}]}, network=CALM, stop=None)
@example(
    graph="line", script={"*": [{"after_s": 20.0, "ignores_stop": True}]}, network=CALM, stop=3.0
)
@example(graph="loop", script={"*": [{"after_s": 0.2}]}, network=NetworkFaults(loss=0.5), stop=14.0)
@example(
    graph="loop",
    script={"*": [{"after_s": 0.3}]},
    network=NetworkFaults(feedback_s=1.5, seed=3),
    stop=12.0,
)
@example(  # late feedback of nine laps, seven of which were real
    graph="loop",
    script={"*": [{"after_s": 1.2}]},
    network=NetworkFaults(feedback_s=1.5, seed=0),
    stop=15.0,
)
@example(graph="sub", script={"*": [{"after_s": 0.3}]}, network=CALM, stop=None)
@example(graph="sub", script={"*": [{"after_s": 0.1}]}, network=CALM, stop=None)
@example(graph="stuck", script={"*": [{"after_s": 0.2}]}, network=CALM, stop=6.0)
@example(graph="sub_loop", script={"*": [{"after_s": 0.4}]}, network=CALM, stop=12.0)
def test_every_visit_holds_what_the_code_of_the_action_did(
    graph: str, script: dict[str, list[dict[str, Any]]], network: NetworkFaults, stop: float | None
) -> None:
    loops = graph in {"loop", "sub_loop"}
    if (loops or graph == "stuck") and stop is None:
        stop = 12.0  # else it never ends
    told = lived(graph, script, network, stop)
    for name, action in told.run.actions.items():
        real = told.real[name]
        count = visit_counts(told.run)[name]
        assert action.older + len(action.visits) <= count.least <= len(real), (name, count)
        if not count.at_least and told.run.proof_at is not None:
            assert count.least == len(real), (name, count)
        if not loops:
            assert len(real) <= 1
        assert fit_apart(action.visits, real), (name, action.visits, real)
        for visit in action.visits:
            assert any(fits(visit, each) for each in real), (name, visit, real)
            assert visit.not_before <= visit.start
            assert visit.not_after is None or visit.start <= visit.not_after
            assert visit.not_after is None or (visit.until or 0) <= visit.not_after
            assert visit.least >= 0
            assert visit.most is None or visit.least <= visit.most


def test_an_action_of_three_seconds_is_not_said_to_have_taken_none() -> None:
    told = lived("line", {"*": [{"after_s": 3.0}]}, CALM, None)
    for action in told.run.actions.values():
        (visit,) = action.visits
        assert visit.most is not None
        assert 1_000_000 <= visit.least <= 3_000_000 <= visit.most <= 5_000_000


def test_an_action_that_outlasts_a_stop_has_no_end() -> None:
    script = {"*": [{"never": True, "ignores_stop": True}]}
    told = lived("line", script, CALM, 2.0)
    (visit,) = told.run.actions["Work_0"].visits
    assert told.real["Work_0"][0][1] is None
    assert visit.not_after is None


def test_no_bound_is_lost_when_it_is_stored(tmp_path: Any) -> None:
    told = lived("join", {"*": [{"after_s": 0.7}]}, NetworkFaults(loss=0.3), None)
    events = told.place.harness.journal.told(told.run.id)
    seen = [item for event in events for item in getattr(event, "seen", ())]
    assert any(item.source == "feedback" and item.since_asked is not None for item in seen)
    assert any(item.source == "get" and item.since_asked is not None for item in seen)
    assert msgspec.json.decode(msgspec.json.encode(seen[0]), type=type(seen[0])) == seen[0]


ENDINGS = ("FINISHED", "FINISHED", "FINISHED", "ERROR", "STOPPING")


@st.composite
def arrivals(draw: st.DrawFn) -> tuple[dict[str, list[Real]], list[Snapshot]]:
    """Visits of two actions, and the snapshots of them in the order in which they came: answers one
    after the other, and feedback of each change, in its order and late; some of both are lost."""
    chance = Random(draw(st.integers(0, 2**32)))
    states: dict[str, list[tuple[float, str]]] = {}
    real: dict[str, list[Real]] = {}
    for name in ("Go_0", "Grip_0"):
        states[name], real[name], now = [(0.0, "UNINITIALIZED")], [], 0.0
        usual = draw(st.sampled_from([0.2, 1.0, 3.0]))
        for _ in range(draw(st.integers(1, 12))):
            begun = now + chance.expovariate(1 / usual)
            motion, ending = chance.expovariate(1 / usual), chance.choice(ENDINGS)
            now = begun + motion
            states[name].append((begun, "RUNNING"))
            if ending == "STOPPING":
                states[name].append((now - motion / 2, ending))
            states[name].append((now, "ERROR" if ending == "ERROR" else "FINISHED"))
            real[name].append((_us(begun), _us(now)))

    def shown(at: float, moment: float, **fields: Any) -> Snapshot:
        nodes = {
            name: [state for since, state in each if since <= moment][-1]
            for name, each in states.items()
        }
        return Snapshot(_us(at), "patrol", "RUNNING", nodes, run="r1", **fields)

    changes = sorted(since for each in states.values() for since, _ in each if since)
    late, loss = draw(st.sampled_from([0.0, 0.05, 0.5, 1.5, 3.0])), draw(st.sampled_from([0, 0.5]))
    came = accumulate((since + chance.random() * late for since in changes), max)
    seen = [
        shown(at, since, source="feedback")
        for at, since in zip(came, changes, strict=True)
        if chance.random() >= loss
    ]
    way, pace = draw(st.sampled_from([0.002, 0.9])), draw(st.sampled_from([0.3, 1.0, 5.0]))
    lost, asked = draw(st.sampled_from([0, 0.5, 0.9])), 0.0
    while asked < changes[-1] + 3:
        moment = asked + chance.random() * way
        at = moment + chance.random() * way
        if chance.random() >= lost:
            seen.append(shown(at, moment, asked_at=_us(asked)))
        asked = at + chance.random() * pace
    return real, sorted(seen, key=lambda each: each.at)


def _us(at: float) -> int:
    return 1_000_000_000 + round(at * 1e6)


def watched(run: Run, seen: list[Snapshot]) -> Run:
    """Return the run after what a monitor records of these snapshots."""
    asked, is_answered = None, False
    for each in seen:
        item = msgspec.structs.replace(each, since_asked=asked)
        asked = each.asked_at or asked
        is_overtaken = is_answered and not newer_than_answers(run, (item,))
        is_answered = each.source == "get"
        if is_news(run, item) and (is_answered or not is_overtaken):
            run = follow(run, Observed(item.at, thin(run, (item,))))
    return run


@settings(max_examples=examples(100), deadline=None)
@given(arrivals())
def test_no_mixture_of_answers_and_late_feedback_makes_up_a_visit(
    came: tuple[dict[str, list[Real]], list[Snapshot]],
) -> None:
    real, seen = came
    run = replay([msgspec.structs.replace(REQUESTED, at=_us(0)), Published(_us(0), "life")])
    assert run is not None
    run = watched(run, seen)
    for name, count in visit_counts(run).items():
        action = run.actions[name]
        assert action.older + len(action.visits) <= count.least <= len(real[name])
        assert fit_apart(action.visits, real[name]), (action.visits, real[name])
