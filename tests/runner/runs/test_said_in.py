"""A search looks through what the events of a run say: each text that somebody said or was told, and nothing else."""

import pytest

from action_assistant.runner.runs import events
from action_assistant.runner.runs.events import RunEvent, said_in

ADA = events.Author("ada-id", "Ada", by="browser", address="10.0.0.7")
REQUESTED = events.Requested(
    at=1,
    run="run-id",
    number=7,
    author=ADA,
    request_id="request-id",
    graph="graph-id",
    graph_name="Round",
    version="version-id",
    digest="digest",
    engine="atlas",
    simulated=False,
    actions={"Lift_0": "the-aid-of-it"},  # its names are in the run
    umrf='{"graph_name":"not searched"}',
    script='{"also":"not searched"}',
    override=events.Override(codes=("E1",), reason="the gate is blocked today"),
)


@pytest.mark.parametrize(
    ("event", "texts"),
    [
        (REQUESTED, {"Ada", "Round", "atlas", "E1", "the gate is blocked today"}),
        (events.EngineSaid(at=2, text="map::at"), {"map::at"}),
        (events.EngineSaid(at=2, text="map::at", level="warn"), {"map::at", "warn"}),
        (events.AlarmRaised(at=2, code="stalled", text="Lift waits"), {"stalled", "Lift waits"}),
        (events.MovesAgain(at=3, text="Lift moves again"), {"Lift moves again"}),
        (events.Observed(at=4, seen=()), set()),
    ],
)
def test_texts_for_people_are_found_and_ids_are_not(event: RunEvent, texts: set[str]) -> None:
    assert set(said_in(event)) - {""} == texts
