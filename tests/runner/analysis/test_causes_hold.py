"""No cause contradicts an event of its run, and a person's action comes first. Random histories."""

import re
from collections.abc import Callable, Sequence
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.runner.analysis.cause_texts import cause_sentence
from action_assistant.runner.analysis.causes import OPERATOR, causes
from action_assistant.runner.links.observations import NodeResult, NodeState, Snapshot
from action_assistant.runner.runs.events import (
    AlarmRaised,
    Answered,
    AtRest,
    Ended,
    EngineSaid,
    Observed,
    PauseRequested,
    Proof,
    Published,
    ResumeRequested,
    RunEvent,
    Silent,
    StopRequested,
)
from action_assistant.runner.runs.fold import replay
from runner.analysis.test_cause import FORK, begun
from runner.harness import ANN, BEN
from support.doses import examples

NAMES = ("A_0", "B_0", "Join_0")
S = 1_000_000
ALARMS = (
    "engine_restarted", "stalled", "stop_unconfirmed", "foreign_stop", "foreign_start", "foreign_pause",
    "foreign_other", "moves_again", "start_refused", "half_begun", "echo_differs",
)  # fmt: skip
STATES = ("RUNNING", "FINISHED", "ERROR", "STOPPING", "PAUSED")

STEPS = st.one_of(
    st.tuples(st.just("exact"), st.sampled_from(NAMES), st.sampled_from(STATES)),
    st.tuples(st.just("exact"), st.sampled_from(NAMES), st.sampled_from(STATES)),
    st.tuples(st.just("shown"), st.sampled_from(NAMES), st.sampled_from(STATES)),
    st.tuples(st.just("result"), st.sampled_from(NAMES), st.sampled_from(["on_true", "on_false"])),
    st.tuples(st.just("alarm"), st.sampled_from(ALARMS), st.none()),
    st.tuples(
        st.sampled_from(["sent", "pause", "resume", "stop", "silent", "answers", "proof", "said"]),
        st.none(),
        st.none(),
    ),
)
ENDS = st.sampled_from([None, "finished", "halted", "stopped", "error", "refused", "lost", "rest"])


def told_by(steps: Sequence[tuple[str, Any, Any]], end: str | None) -> list[RunEvent]:
    """The events of such a history, half a second apart."""
    told: list[RunEvent] = [begun(FORK)]
    for number, step in enumerate(steps, 1):
        told.append(_event(step, number * S // 2))
    at = (len(steps) + 1) * S // 2
    if end == "rest":
        told.append(Ended(at, "error", None, "it may move", AtRest(BEN, at, "I looked")))
    elif end is not None:
        told.append(Ended(at, end, None, "some reason"))  # type: ignore[arg-type]
    return told


def _event(step: tuple[str, Any, Any], at: int) -> RunEvent:
    match step:
        case ("exact", name, state):
            return Observed(at, (NodeState(at, "task", name, state),))
        case ("shown", name, state):
            nodes = {name: state}
            asked = at - S // 10
            shown = Snapshot(
                at=at, graph="task", state="RUNNING", nodes=nodes, run="r", asked_at=asked
            )
            return Observed(at, (shown,))
        case ("result", name, result):
            return Observed(at, (NodeResult(at, "task", name, result),))
        case ("alarm", code, _):
            return AlarmRaised(at, code, f"{code} UNCONFIRMED" if "unconfirmed" in code else code)
        case ("sent", _, _):
            return Published(at, "life")
        case ("pause", _, _):
            return PauseRequested(at, BEN)
        case ("resume", _, _):
            return ResumeRequested(at, BEN)
        case ("stop", _, _):
            return StopRequested(at, ANN)
        case ("silent", _, _):
            return Silent(at, at, "no answer")
        case ("answers", _, _):
            return Answered(at)
        case ("proof", _, _):
            return Proof(at, at, "h")
        case _:
            return EngineSaid(at, "origin [in startGraphA]: Could not resolve graph 'task'")


class Evidence:
    """The facts that the events of a history show, read without the fold."""

    def __init__(self, told: Sequence[RunEvent]) -> None:
        self.stop = next((each.at for each in told if isinstance(each, StopRequested)), None)
        self.end = next((each for each in told if isinstance(each, Ended)), None)
        self.sent = [each.at for each in told if isinstance(each, Published)]
        self.proofs = [each.at for each in told if isinstance(each, Proof)]
        self.alarms = [each for each in told if isinstance(each, AlarmRaised)]
        self.states: dict[str, list[tuple[int, str]]] = {name: [] for name in NAMES}
        for event in told:
            for seen in event.seen if isinstance(event, Observed) else ():
                if isinstance(seen, NodeState):
                    self.states[seen.node].append((event.at, seen.state))
                elif isinstance(seen, Snapshot):
                    for name, state in seen.nodes.items():
                        self.states[name].append((event.at, state))

    def at(self, name: str, moment: int) -> str | None:
        """The state that was shown last by that moment."""
        known = [state for at, state in self.states[name] if at <= moment]
        return known[-1] if known else None

    def ran(self, name: str) -> bool:
        return any(state not in {"UNINITIALIZED", "INITIALIZED"} for _, state in self.states[name])


ACTIVE = {"RUNNING", "STOPPING", "PAUSED", "PAUSE_REQUESTED"}
CLAIMS: list[tuple[str, Callable[[Evidence, re.Match[str]], bool]]] = [
    (r"^Ann pressed Stop .*?(\w+) ran \([^)]*\)",
     lambda seen, said: seen.at(f"{said[1]}_0", seen.stop or 0) in ACTIVE),
    (r"before anything was sent", lambda seen, _: not seen.sent),
    (r"before any action was seen to run",
     lambda seen, _: not any(seen.at(name, seen.stop or 0) in ACTIVE for name in NAMES)),
    (r"^(\w+) ended in error",
     lambda seen, said: any(state == "ERROR" for _, state in seen.states[f"{said[1]}_0"])),
    (r"waits for (\w+)_0, which has not run", lambda seen, said: not seen.ran(f"{said[1]}_0")),
    (r"waited for (\w+), which had not been seen to end",
     lambda seen, said: seen.at(f"{said[1]}_0", seen.stop or 1 << 60) in ACTIVE or seen.stop is None),
    (r"UNCONFIRMED", lambda seen, _: not any(
        proof >= max(each.at for each in seen.alarms if "unconf" in each.code)
        for proof in seen.proofs if seen.end is None or proof <= seen.end.at)),
    (r"ended by it", lambda seen, _: seen.stop is None and seen.end is not None
        and not any(each.code == "engine_restarted" for each in seen.alarms)),
    (r"refused the start", lambda seen, _: bool(seen.sent) or seen.end is None or seen.end.state != "refused"),
]  # fmt: skip


@settings(max_examples=examples(150))
@given(st.lists(STEPS, max_size=14), ENDS)
def test_no_cause_contradicts_an_event_and_what_a_person_did_comes_first(
    steps: list[tuple[str, Any, Any]], end: str | None
) -> None:
    told = told_by(steps, end)
    run = replay(told)
    assert run is not None
    named = causes(run, FORK)
    texts = [cause_sentence(each, run) for each in named]
    seen = Evidence(told)
    kinds = [isinstance(each, OPERATOR) for each in named]
    assert kinds == sorted(kinds, reverse=True), texts
    if seen.stop is not None and named:
        assert texts[0].startswith("Ann pressed Stop"), texts
    for text in texts:
        assert "never reported" not in text
        for pattern, holds in CLAIMS:
            said = re.search(pattern, text)
            assert said is None or holds(seen, said), (text, told)
    latest = max(getattr(each, "at", 0) for each in told)
    assert all(run.requested_at <= each.at <= latest + S for each in named), named
