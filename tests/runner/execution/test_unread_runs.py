"""Led runs of whose events some are missing or cannot be read after a restart: no piece is left alone."""

from collections.abc import Sequence
from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import Conflict, Unavailable
from action_assistant.journal.events import Draft
from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.events import (
    Observed,
    PieceBegan,
    PieceSeen,
    Published,
    Requested,
)
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest
from runner.execution.test_conductor import Lab, alarms, led, refused, rests, shared
from runner.harness import (
    ANN,
    BEN,
    MemoryJournal,
    ended,
    engine,
    order,
    sequence,
    until,
    virtual,
)


def damage(journal: MemoryJournal, run: str, kind: str) -> None:
    """Make the first stored event of this kind in a run unreadable."""
    events = journal.streams[f"run/{run}"]
    number = next(n for n, each in enumerate(events) if each.kind == kind)
    events[number] = msgspec.structs.replace(events[number], body=b"{")


@pytest.mark.parametrize("kind", [Published.kind, PieceBegan.kind, PieceSeen.kind])
@virtual
async def test_the_pieces_of_a_run_that_cannot_be_read_are_followed_and_stopped(kind: str) -> None:
    lab = Lab({"*": [{"after_s": 60, "stop_s": 1}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        await anyio.sleep(1)
    damage(lab.harness.journal, run, kind)
    async with lab.runner() as control:
        found = control.open[run].run
        assert found.state == "unknown"
        assert len(alarms(found, "led_unread")) == 1
        piece = control.open[f"{run}.1"]
        await anyio.sleep(5)
        assert piece.run.state == "running"
        assert control.open[run].run.state == "unknown"
        assert control.open[run].run.actions["Work_0"].state == "RUNNING"
        assert "is taken by run 1" in await refused(control, order(sequence("o"), engine="Carol"))
        with pytest.raises(Conflict):
            await control.confirm_rest(run, RestRequest("I stand beside it."), BEN)
        await control.stop(run, BEN)
        assert await lab.david.moving("task--Work_0")
        assert control.open[run].run.end is None
        await until(lambda: run not in control.open)
        assert not await lab.david.moving("task--Work_0")
        last = next(each for _, each in reversed(lab.harness.shown) if each.id == run)
        assert last.state == "stopped"
        assert last.proof_at is not None
        assert (await control.find(f"{run}.1")).proof_at is not None
        assert len(lab.david.starts) == 1
        assert lab.carol.starts == []


@virtual
async def test_a_piece_that_cannot_be_read_is_never_sent_again() -> None:
    lab = Lab({"*": [{"after_s": 5, "stop_s": 1}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        await anyio.sleep(1)
    damage(lab.harness.journal, f"{run}.1", Observed.kind)
    async with lab.runner() as control:
        await anyio.sleep(20)
        found = control.open[run].run
        assert found.state == "unknown"
        assert found.actions["Work_0"].state == "FINISHED"
        assert len(lab.david.starts) == 1
        assert lab.carol.starts == []
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"


@virtual
async def test_the_pieces_of_a_run_whose_start_cannot_be_read_are_runs_of_their_own() -> None:
    lab = Lab({"*": [{"after_s": 60, "stop_s": 1}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        await anyio.sleep(1)
    damage(lab.harness.journal, run, Requested.kind)
    async with lab.runner() as control:
        piece = f"{run}.1"
        assert piece in control.shown
        assert len(alarms(control.open[piece].run, "led_unread")) == 1
        assert control.stop_all(BEN).runs == [piece]
        assert await ended(control, piece) == "stopped"
        assert not await lab.david.moving("task--Work_0")


async def led_after_a_refusal(
    lab: Lab, control: ExecutionService, monkeypatch: pytest.MonkeyPatch
) -> str:
    """Lead a run whose piece 1 the journal refuses; return its id once piece 2 moves on David."""
    journal = lab.harness.journal
    append = journal.append

    async def refusing(stream: str, drafts: Sequence[Draft], **more: Any) -> int:
        if stream.endswith(".1"):
            raise Unavailable("no space left on device")
        return await append(stream, drafts, **more)

    monkeypatch.setattr(journal, "append", refusing)
    graph = shared(sequence("task", 2), "Scout", "Carrier")
    run = (await control.start(led(graph, lost="wait"), ANN)).run.id
    await until(lambda: control.open[run].run.held is not None)
    held = control.open[run].run.held
    assert held is not None
    await control.go_on(run, GoOnRequest(time(held.at)), BEN)
    await until(lambda: journal.history(run).actions["Work_0"].state == "RUNNING")
    assert f"run/{run}.1" not in journal.streams
    assert journal.history(run).actions["Work_0"].piece == f"{run}.2"
    return run


@virtual
async def test_a_piece_behind_one_that_could_not_be_stored_is_followed_and_stopped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lab = Lab({"*": [{"after_s": 60, "stop_s": 1}]})
    async with lab.runner() as control:
        run = await led_after_a_refusal(lab, control, monkeypatch)
    damage(lab.harness.journal, run, PieceSeen.kind)
    async with lab.runner() as control:
        assert control.open[f"{run}.2"].run.state == "running"
        await control.stop(run, BEN)
        assert await lab.david.moving("task--Work_0")
        assert control.open[run].run.end is None
        await until(lambda: run not in control.open)
        assert not await lab.david.moving("task--Work_0")
        last = next(each for _, each in reversed(lab.harness.shown) if each.id == run)
        assert last.state == "stopped"


@virtual
async def test_a_piece_that_left_and_was_not_noted_is_not_sent_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lab = Lab({"*": [{"after_s": 20}]})
    journal = lab.harness.journal
    async with lab.runner() as control:
        run = await led_after_a_refusal(lab, control, monkeypatch)
    events = journal.streams[f"run/{run}"]
    del events[next(n for n, each in enumerate(events) if each.kind == PieceBegan.kind) :]
    async with lab.runner() as control:
        assert control.open[f"{run}.2"].run.state == "running"
        await anyio.sleep(40)
        assert journal.history(f"{run}.2").end == "finished"
        held = control.open[run].run.held
        assert held is not None
        await control.go_on(run, GoOnRequest(time(held.at)), BEN)
        assert await ended(control, run) == "finished"
        assert [each.run for each in lab.david.starts] == [f"{run}.2"]
        assert [each.run for each in lab.carol.starts] == [f"{run}.3"]


async def moved_again(lab: Lab, control: ExecutionService) -> str:
    """Lead a run until its first piece, which had ended, moves again; return the run's id."""
    graph = shared(sequence("task", 2), "Scout", "Carrier")
    run = (await control.start(led(graph, lost="wait"), ANN)).run.id
    await until(lambda: bool(lab.carol.starts), 200)
    await anyio.sleep(5)
    await lab.david.engine.start(lab.david.starts[0])
    await until(lambda: control.open[run].run.held is not None)
    return run


@pytest.mark.parametrize("stops", [False, True])
@virtual
async def test_a_piece_that_moves_again_is_not_forgotten_by_a_restarted_runner(stops: bool) -> None:
    lab = Lab({"*": [{"after_s": 100, "stop_s": 1}]})
    async with lab.runner() as control:
        run = await moved_again(lab, control)
        if stops:
            await control.stop(run, BEN)
            await anyio.sleep(0.05)
    async with lab.runner() as control:
        if not stops:
            await anyio.sleep(5)
            assert control.open[f"{run}.1"].run.state == "running"
            assert rests(control, run)["David"] == "going"
            await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"
        assert not await lab.david.moving("task--Work_0")
        assert not await lab.carol.moving("task--Work_1")
        assert lab.harness.journal.history(f"{run}.1").end == "stopped"


@virtual
async def test_the_word_for_the_rest_of_a_piece_that_moves_again_is_no_proof_of_its_run() -> None:
    lab = Lab({"*": [{"after_s": 100, "stop_s": 1}]})
    async with lab.runner() as control:
        run = await moved_again(lab, control)
        lab.david.engine = engine({"*": [{"after_s": 60}]})
        piece = f"{run}.1"
        await until(lambda: bool(control.open[piece].run.lost))
        await control.stop(run, BEN)
        await anyio.sleep(10)
        await control.confirm_rest(piece, RestRequest("I stand beside it."), BEN)
        assert await ended(control, run) == "error"
        found = lab.harness.journal.history(run)
        assert found.proof_at is None
        assert found.at_rest is not None
        assert found.at_rest.by == BEN


@virtual
async def test_one_press_sends_one_stop_to_a_robot_that_holds_the_piece_no_more() -> None:
    lab = Lab({"*": [{"after_s": 60}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
    damage(lab.harness.journal, run, PieceSeen.kind)
    lab.david.engine = engine({"*": [{"after_s": 60}]})
    async with lab.runner() as control:
        await until(lambda: bool(control.open[f"{run}.1"].run.lost))
        for presses in (1, 2):
            await control.stop(run, BEN, f"press {presses}")
            await anyio.sleep(20)
            assert len(lab.david.stops) == presses
        assert control.open[run].run.end is None
