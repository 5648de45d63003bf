"""A fault in one place keeps Stop from nothing: in a link, in what is kept beside runs, in what looks
back on them. In virtual time."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import anyio
import pytest

from action_assistant.errors import Conflict, Unavailable
from action_assistant.runner.archives.archive_store import ArchiveStore
from action_assistant.runner.archives.retention import Retention
from action_assistant.runner.execution.monitor import Monitor
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Answer, Leaves, NotSent, Order, unwatched
from action_assistant.runner.review.background_loops import SumUpLoop
from action_assistant.runner.review.stored_runs import StoredRuns
from action_assistant.runner.robots.recordings import Recordings
from action_assistant.settings import Keep
from runner.harness import (
    ANN,
    BEN,
    Harness,
    at_once,
    clock_us,
    order,
    run_in_virtual_time,
    sequence,
    until,
    virtual,
)
from runner.registered_robots import NEVER, Open, fleet
from runner.robots_in_network import RobotsInNetwork


class Faulty(Open):
    """A robot whose link fails in ways that nobody foresaw."""

    stops_fail = False
    gets_fail = False

    async def stop(self, graph_name: str) -> None:
        """The middleware breaks after the message has left."""
        await super().stop(graph_name)
        if self.stops_fail:
            raise RuntimeError("the context is not valid")

    async def get(self) -> Answer:
        """The middleware breaks before it has asked."""
        if self.gets_fail:
            raise RuntimeError("the context is not valid")
        return await super().get()


@virtual
async def test_a_link_that_breaks_while_it_stops_is_stopped_by_again_and_told_as_unconfirmed() -> (
    None
):
    david = Faulty(NEVER)
    async with fleet(Harness(), David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await until(lambda: control.open[run.id].run.state == "running")
        david.stops_fail, david.loss = True, 1.0
        await control.stop(run.id, BEN)
        await anyio.sleep(10)
        told = control.open[run.id].run
        assert len(david.stops) > 5
        assert any("not valid" in each.text for each in told.alarms if "unconf" in each.code)
        david.stops_fail, david.loss = False, 0.0
        await until(lambda: not control.open)
        assert (await control.find(run.id)).state == "stopped"


@virtual
async def test_a_link_that_breaks_when_it_asks_leaves_the_run_unknown() -> None:
    david = Faulty(NEVER)
    async with fleet(Harness(), David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await until(lambda: control.open[run.id].run.state == "running")
        david.gets_fail = True
        await anyio.sleep(10)
        assert control.open[run.id].run.state == "unknown"
        assert control.robots.robot("David").state == "busy"
        david.gets_fail = False
        await until(lambda: control.open[run.id].run.state == "running")


@pytest.mark.parametrize("fault", ["stops_fail", "gets_fail"])
def test_a_link_that_breaks_while_a_graph_of_somebody_else_is_stopped_ends_nothing(
    fault: str,
) -> None:
    @virtual
    async def lived() -> None:
        david, eve = Faulty(NEVER), Open(NEVER)
        async with fleet(Harness(), David=david, Eve=eve) as control:
            run = (await control.start(order(sequence(), engine="Eve"), ANN)).run
            await david.engine.start(Order(run="theirs", graph=sequence("cleaning"), umrf=""))
            await anyio.sleep(15)
            setattr(david, fault, True)
            control.stop_robot("David", BEN)
            await anyio.sleep(10)
            assert control.foreign_stops.trouble("David", "cleaning")
            assert control.open[run.id].run.state == "running"
            setattr(david, fault, False)
            await until(lambda: not control.foreign_stops.is_stopping("David"))
            assert not await david.moving("cleaning")

    lived()


@virtual
async def test_a_fault_in_what_watches_a_run_is_told_once_and_the_run_still_stops(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The fault may come again several times."""
    david = Faulty(NEVER)
    left, take = [5], Monitor._take

    def failing(self: Monitor, *answer: Any) -> None:
        left[0] -= 1
        if left[0] >= 0:
            raise RuntimeError("a fault of ours")
        take(self, *answer)

    async with fleet(Harness(), David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await until(lambda: control.open[run.id].run.state == "running")
        monkeypatch.setattr(Monitor, "_take", failing)
        await until(lambda: left[0] < 0)
        (told,) = [each for each in control.open[run.id].run.alarms if each.code == "internal"]
        assert told.text.startswith("The runner has a fault: ")
        assert "a fault of ours" in told.text
        await control.stop(run.id, BEN)
        await until(lambda: not control.open)
        assert (await control.find(run.id)).state == "stopped"
        assert not await david.moving("patrol")


class SlowToGoOn(Open):
    """A robot on whose domain a message that lets a graph go on waits for its turn."""

    pauses = True
    resumed = False

    async def resume(
        self, graph_name: str, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Let the message leave after a while."""
        await anyio.sleep(0.15)
        leaves()
        self.resumed = True


@asynccontextmanager
async def paused(david: Open) -> AsyncIterator[tuple[ExecutionService, str]]:
    """Start a run on David and pause it; give the service and the run."""
    async with fleet(Harness(), David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
        await until(lambda: control.open[run].run.state == "running")
        await control.pause(run, ANN)
        yield control, run


@virtual
async def test_a_resume_that_waits_for_its_turn_does_not_leave_after_a_stop() -> None:
    david = SlowToGoOn(NEVER)
    async with paused(david) as (control, run):

        async def press() -> None:
            with pytest.raises(Unavailable, match="being stopped"):
                await control.resume(run, ANN)

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(press)
            await anyio.sleep(0.02)
            await control.stop(run, BEN)
        assert not david.resumed


@virtual
async def test_a_resume_that_was_kept_back_can_be_made_again() -> None:
    david = SlowToGoOn(NEVER)
    async with paused(david) as (control, run):

        def gone(*_: object) -> None:
            raise NotSent("The baton of David has changed hands.")

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(control.rights, "require_still", gone)
            with pytest.raises(Unavailable, match="changed hands"):
                await control.resume(run, ANN)
        await control.resume(run, BEN)
        assert david.resumed


def test_a_pause_that_cannot_be_sent_is_told_and_the_run_is_stopped_all_the_same() -> None:
    class Unsendable(Open):
        pauses = True

        async def pause(self, graph_name: str) -> None:
            """Nobody is there to hand it to."""
            raise NotSent("nobody listens")

        async def resume(
            self, graph_name: str, continue_from: str = "", leaves: Leaves = unwatched
        ) -> None:
            """Fail, since nobody listens."""
            raise NotSent("nobody listens")

    @virtual
    async def lived() -> None:
        david = Unsendable(NEVER)
        async with fleet(Harness(), David=david) as control:
            run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
            await until(lambda: control.open[run].run.state == "running")
            with pytest.raises(Conflict, match="Only a paused run"):
                await control.resume(run, ANN)
            with pytest.raises(Unavailable, match="could not be sent: nobody listens"):
                await control.pause(run, ANN)
            assert control.open[run].run.state == "running"
            with pytest.raises(Unavailable, match="could not be sent: nobody listens"):
                await control.resume(run, ANN)
            await control.stop(run, BEN)
            await until(lambda: not control.open)

    lived()


def test_a_file_that_somebody_put_beside_recordings_ends_nothing(tmp_path: Path) -> None:
    (tmp_path / "David").mkdir()
    (tmp_path / "David" / "2026-11-21T10 (copy).jsonl.gz").write_bytes(b"")

    async def live() -> None:
        recordings = Recordings(tmp_path, at_once)
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(recordings.run)
            for at in (1, 2):
                said = Answer(
                    asked_at=at, at=at, incarnation="life", graphs=(), texts={"a": f"{at}"}
                )
                recordings.record_answer("David", said)
                await anyio.sleep(5)
            tasks.cancel_scope.cancel()
        assert len(await recordings.listed("David")) == 2
        assert (tmp_path / "David" / "2026-11-21T10 (copy).jsonl.gz").exists()

    run_in_virtual_time(live)


def test_a_recording_that_cannot_be_looked_at_does_not_end_what_puts_old_ones_away(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "recordings" / "David").mkdir(parents=True)
    (tmp_path / "recordings" / "David" / "2026-11-21T10.jsonl.gz").symlink_to("nowhere")

    async def live() -> None:
        retention = Retention(
            Harness().journal,  # type: ignore[arg-type] - nothing of it is asked
            Recordings(tmp_path / "recordings", at_once),
            Keep(folder=tmp_path, raw=1),
            is_open=lambda _: False,
            clock_us=clock_us,
            run_in_worker=at_once,
        )
        retention._may_be_unfinished = False
        with anyio.move_on_after(3 * 3_600) as waited:
            await retention.run()
        assert waited.cancelled_caught
        assert "nowhere" in caplog.text or "No such file" in caplog.text

    run_in_virtual_time(live)


@virtual
async def test_a_run_that_cannot_be_summed_up_is_left_out_and_the_next_one_is_not() -> None:
    harness = Harness()
    async with harness.runner() as control, anyio.create_task_group() as tasks:
        archive_store = ArchiveStore(harness.journal, Path("nowhere"), at_once)  # type: ignore[arg-type]
        stored_runs = StoredRuns(archive_store)
        keyframes, failed = stored_runs.keyframe_store.keyframes, []

        async def fails_once(run: str) -> Any:
            if not failed:
                failed.append(run)
                raise ZeroDivisionError
            return await keyframes(run)

        stored_runs.keyframe_store.keyframes = fails_once  # type: ignore[method-assign]
        sums = SumUpLoop(archive_store, clock_us, stored_runs.summed)
        control.watch(lambda opened: sums.run_changed(opened.run, opened.recorder))
        tasks.start_soon(sums.run)
        for _ in range(2):
            run = (await control.start(order(sequence(actions=1)), ANN)).run
            await until(lambda run=run: run.id not in control.open)
        await until(
            lambda: len([each for each in harness.journal.streams if "about/" in each]) == 2
        )
        tasks.cancel_scope.cancel()


@virtual
async def test_an_answers_states_are_shown_even_if_a_fault_ends_the_conclusions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fails(*_: object) -> None:
        raise RuntimeError("a fault that nobody foresaw")

    monkeypatch.setattr(Monitor, "_conclude", fails)
    here = RobotsInNetwork(5, script=NEVER)
    here.network.show = lambda *_: None  # all feedback is lost
    async with here.played() as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await until(lambda: control.open[run.id].run.active != ())
        assert control.open[run.id].run.state == "running"
