"""The page shows only observed states of a run on a robot, live and afterwards alike, whatever
gets lost."""

from typing import Any

import anyio
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from action_assistant.runner.emulator.engine import EmulatedEngine
from action_assistant.runner.emulator.messages import EngineTraits, index_of
from action_assistant.runner.links.observations import ACTIVE, Snapshot
from action_assistant.runner.links.port import Feedback, Report
from action_assistant.runner.runs import views
from action_assistant.runner.runs.fold import replay
from action_assistant.runner.runs.run import ENDED
from runner import harness
from runner.fake_network import now_ms
from runner.harness import BEN, run_in_virtual_time, sequence
from runner.record_streams import Place
from runner.robots_in_network import all_over
from support.doses import examples

RESULTS = ("on_true", "on_false", "on_error")
CALLS = st.fixed_dictionaries(
    {
        "after_s": st.floats(0.02, 4.0),
        "result": st.sampled_from(RESULTS),
        "stop_s": st.just(0.3),
    }
)


class Witness:
    """Records all that a link has reported, and all that people were shown."""

    def __init__(self, place: Place) -> None:
        self.active: set[str] = set()
        self.place = place
        link: Any = place.harness.links["Robin"]
        asked = link.get

        async def get() -> Any:
            answer = await asked()
            self._saw(answer.graphs)
            return answer

        link.get = get
        self.listening = link.listen(self._hear)

    def _hear(self, report: Report) -> None:
        if isinstance(report, Feedback):
            self._saw(report.snapshots)

    def _saw(self, snapshots: tuple[Snapshot, ...]) -> None:
        for shown in snapshots:
            self.active |= {node for node, state in shown.nodes.items() if state in ACTIVE}


async def lived(calls: list[dict[str, Any]], loss: float, seed: int, stop: float | None) -> Witness:
    """A sequence of such actions on a robot, up to its end."""
    script = {f"Work_{i}": [call] for i, call in enumerate(calls)}
    place = Place(script)
    witness = Witness(place)
    async with place.network.running():
        robot = EmulatedEngine(
            "Robin",
            script=place.script,
            index=index_of([], []),
            quirks=EngineTraits(loss=loss),
            seed=seed,
            born_ms=now_ms(),
            epoch_ms=harness.EPOCH // 1000,
        )
        place.network.join(robot, "/Robin")
        await anyio.sleep(0.5)
        async with place.harness.runner() as place.control:
            await anyio.sleep(1.5)
            with witness.listening:
                run = await place.start(sequence("told", len(calls)))
                if stop is not None:
                    await anyio.sleep(stop)
                    await place.control.stop(run, BEN)
                with anyio.move_on_after(120):
                    await all_over(place.control)
    return witness


@settings(max_examples=examples(15), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    calls=st.lists(CALLS, min_size=1, max_size=5),
    loss=st.sampled_from([0.0, 0.3, 0.9]),
    seed=st.integers(0, 1000),
    stop=st.none() | st.floats(0.1, 8.0),
)
@example(  # the stop comes when the second action fails
    calls=[
        {"after_s": 2.5, "result": "on_true", "stop_s": 0.3},
        {"after_s": 2.0, "result": "on_error", "stop_s": 0.3},
        {"after_s": 1.0, "result": "on_true", "stop_s": 0.3},
    ],
    loss=0.0,
    seed=0,
    stop=4.5,
)
def test_only_observed_states_are_shown_and_live_agrees_with_the_history(
    calls: list[dict[str, Any]], loss: float, seed: int, stop: float | None
) -> None:
    witness: Witness = run_in_virtual_time(lambda: lived(calls, loss, seed, stop))
    journal = witness.place.harness.journal
    (stream,) = [each for each in journal.streams if each.startswith("run/")]
    events = journal.told(stream.removeprefix("run/"))
    run = replay(events)
    assert run is not None
    if run.state not in ENDED:
        # An action failed when the stop came, and its code may go on; or the feedback was lost that tells
        # who was not triggered, and another may still be loading.
        assert run.doubt
        assert stop is not None
        assert run.loading or any(call["result"] == "on_error" for call in calls)
    for number, call in enumerate(calls):
        visits = run.actions[f"Work_{number}"].visits
        assert len(visits) <= 1  # every action runs once
        for visit in visits:
            assert visit.how == "inferred" or f"Work_{number}" in witness.active
            assert visit.inputs is None or f"Work_{number}" in witness.active
            failed = call["result"] == "on_error"
            assert visit.result in {None, "stopped", *(["error"] if failed else [])}
    live = [views.run_view(shown) for _, shown in witness.place.harness.shown]
    later = [
        views.run_view(found) for n in range(1, len(events) + 1) if (found := replay(events[:n]))
    ]
    assert list(_changes(live)) == list(_changes(later))


def _changes(shown: list[views.RunShown]) -> list[views.RunShown]:
    return [each for n, each in enumerate(shown) if n == 0 or each != shown[n - 1]]
