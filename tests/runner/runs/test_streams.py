"""Streams that older versions wrote tell the same for ever."""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from action_assistant.journal.events import Event
from action_assistant.runner.runs.events import Observed, decode
from action_assistant.runner.runs.fold import replay, thin
from action_assistant.runner.runs.run import ENDED
from runner.record_streams import Line, as_told, expected, recorded

FOLDERS = sorted(path for path in (Path(__file__).parents[2] / "data" / "streams").iterdir())
STREAMS = [path for folder in FOLDERS for path in sorted(folder.glob("*.jsonl"))]


def events_of(path: Path) -> list[Event]:
    lines = [msgspec.json.decode(text, type=Line) for text in path.read_bytes().splitlines()]
    return [
        Event("run/x", seq, line.kind, line.author, line.at, bytes(line.body), seq)
        for seq, line in enumerate(lines, 1)
    ]


#: Lower bounds, of which those that older versions told may have been too high, and upper ones.
LOWER, UPPER = ("not_before", "until"), ("from", "not_after")


def assert_tells(now: Any, then: Any, place: str = "") -> None:
    """Check that the fold tells at least what it told then: there may be more, and bounds may be
    further apart."""
    match then:
        case str() if place.rpartition("/")[2] in LOWER and "/visits/" in place:
            assert now <= then, place
        case str() if place.rpartition("/")[2] in UPPER and "/visits/" in place:
            assert now is None or now >= then, place
        case dict():
            assert then.keys() <= now.keys(), place
            for name, value in then.items():
                assert_tells(now[name], value, f"{place}/{name}")
        case list() if place.endswith("/visits") and len(now) < len(then):
            for visit in then:  # late feedback was taken for one more
                assert any(
                    each["not_before"] <= visit["not_before"]
                    and each["not_after"] >= visit["not_after"]
                    for each in now
                ), place
        case list():
            assert len(now) == len(then), place
            for number, value in enumerate(then):
                assert_tells(now[number], value, f"{place}/{number}")
        case _:
            assert now == then, place


@pytest.mark.parametrize("path", STREAMS, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_an_old_stream_tells_what_it_told(path: Path) -> None:
    then = msgspec.json.decode(path.with_suffix(".expected.json").read_bytes())
    assert_tells(expected(events_of(path)), then)


@pytest.mark.parametrize("path", STREAMS, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_an_old_stream_would_be_the_same_run_if_it_were_written_now(path: Path) -> None:
    run = None
    told = [decode(event.kind, event.body) for event in events_of(path)]
    for number, event in enumerate(told):
        if run is not None and isinstance(event, Observed):
            told[number] = Observed(event.at, thin(run, event.seen))
        run = replay(told[: number + 1])
    assert run is not None
    assert as_told(run) == expected(events_of(path))


def test_there_is_a_stream_of_every_kind_of_run() -> None:
    names = {path.stem for path in STREAMS}
    assert {"finished", "stopped", "failed", "engine_lost", "foreign", "paused"} <= names
    assert {"runner_restarted", "together1", "together2", "laps", "simulated"} <= names


def test_new_streams_show_no_visit_twice() -> None:
    for name, events in recorded():
        told = expected(events)
        assert told["state"] in ENDED
        if name != "laps":
            visits = [len(action["visits"]) for action in told["actions"].values()]
            assert max(visits) == 1, name
