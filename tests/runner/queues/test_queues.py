"""The queues of robots: a person starts each entry once, in order, and a doubt closes a queue at once."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import anyio
import anyio.lowlevel
import msgspec
import pytest

from action_assistant.errors import BadInput, Conflict, Forbidden, NotFound, Refused, Unavailable
from action_assistant.runner.api.live import Hub, Outbox, QueueMessage
from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.execution.start_checks import StartChecks
from action_assistant.runner.links.port import Registration
from action_assistant.runner.queues.entry import (
    MOST_OF_ONE,
    MoveRequest,
    OpenQueueRequest,
    QueueReady,
    QueueRequest,
    TurnRequest,
    closing_of,
    stream_of,
)
from action_assistant.runner.queues.robot_queue import Entry, RobotQueue
from action_assistant.runner.queues.service import Queues
from action_assistant.runner.queues.views import queue_view
from action_assistant.runner.robots.rights import Operator, Rules
from action_assistant.runner.runs.doubts import Doubt
from action_assistant.runner.runs.events import Requested
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sight import Unseen
from action_assistant.runner.runs.sight import run_graphs as _of
from action_assistant.runner.start.preflight import Preflight
from action_assistant.web.auth.identity import Identity
from action_assistant.web.workers.lanes import Crashed
from runner.execution.test_conductor import led, shared
from runner.harness import (
    Harness,
    Robot,
    at_once,
    clock_us,
    engine,
    order,
    sequence,
    until,
    virtual,
)
from runner.start.test_rights_registry import ANN, BEN, OLGA, Ended, author

QUICK = {"*": [{"after_s": 1}]}


class Lab:
    """A runner with queues and two robots, in a place that outlives it."""

    def __init__(self, script: dict[str, Any] | None = None) -> None:
        self.david, self.carol = Robot(engine(script or QUICK)), Robot(engine(script or QUICK))
        self.harness = Harness({"David": self.david, "Carol": self.carol})
        self.ended = Ended()

    @asynccontextmanager
    async def runner(self) -> AsyncIterator[tuple[ExecutionService, Queues]]:
        async with (
            self.harness.runner(self.ended) as control,
            Queues.opened(
                control, self.harness.journal, clock_us=clock_us, run_in_worker=at_once
            ) as queues,
        ):
            for name in ("David", "Carol"):
                control.robots.add(Registration(name=name, led=True))
            await anyio.sleep(1)
            yield control, queues

    def starts(self) -> list[Requested]:
        """The stored starts of all runs, in order."""
        streams = self.harness.journal.streams
        runs = [name.removeprefix("run/") for name in streams if name.startswith("run/")]
        first = [self.harness.journal.told(run)[0] for run in runs]
        return [each for each in first if isinstance(each, Requested)]

    def told_of_turns(self, entry: Entry) -> int:
        stored = self.harness.journal.streams[stream_of(entry.id)]
        return sum(each.kind == QueueReady.kind for each in stored)


def on(robot: str, name: str = "task", **changes: Any) -> QueueRequest:
    start = order(sequence(name), engine=robot, **changes)
    return QueueRequest(start=start)


async def put(queues: Queues, request: QueueRequest, by: Identity = ANN) -> Entry:
    entry, fresh = await queues.put(request, author(by), by)
    assert fresh
    return entry


async def started(queues: Queues, entry: Entry, by: Identity = ANN) -> str:
    """Look at an entry as people do, and start it; return the id of its run."""
    look = await queues.look(entry.id, {}, by)
    asked = TurnRequest(look.digest)
    return (await queues.start(entry.id, asked, author(by), by)).run.id


def queue_of(queues: Queues, robot: str) -> RobotQueue:
    return next(each for each in queues.robot_queues if each.name == robot)


async def reopened(queues: Queues, robot: str, by: Identity = BEN) -> None:
    closed = queue_of(queues, robot).closed
    assert closed is not None
    await queues.open(robot, OpenQueueRequest(closing_of(closed)), author(by), by)


def why_closed(queues: Queues, robot: str) -> str:
    closed = queue_of(queues, robot).closed
    return "" if closed is None else closed.why


async def over(control: ExecutionService, run: str) -> None:
    await until(lambda: run not in control.open, 3600)


async def direct(control: ExecutionService, robot: str) -> str:
    """Start a run on a robot past the queue."""
    return (await control.start(order(sequence("other"), engine=robot), author(BEN), BEN)).run.id


@virtual
async def test_a_start_waits_for_its_robot_and_then_for_a_person() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        run = await direct(control, "David")
        first, second = await put(queues, on("David")), await put(queues, on("David"), BEN)
        assert [(each.why, each.run) for each in first.waits] == [("run", run)]
        assert [each.why for each in second.waits] == ["behind", "run"]
        with pytest.raises(Conflict, match="not free"):
            await started(queues, first)
        await over(control, run)
        await anyio.sleep(600)
        assert len(lab.david.starts) == 1
        assert first.ready_at is not None
        assert lab.told_of_turns(first) == 1
        with pytest.raises(Conflict, match="1 before it"):
            await started(queues, second, BEN)
        made = await started(queues, first, BEN)  # whoever may start there
        assert (await control.find(made)).author.id == BEN.person.id
        assert queues.entries == (second,)
        await over(control, made)
        await started(queues, second, BEN)
        assert queues.entries == ()
        assert len(lab.david.starts) == 3


@virtual
async def test_of_a_graph_out_of_sight_robot_state_and_person_are_shown_and_nothing_else() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        run = await direct(control, "David")
        await put(queues, on("David", "secret", graph="hidden"))

        def run_of(run: str) -> Run:
            return control.open[run].run

        unseen = Unseen(BEN.person.id, frozenset({"hidden", "g1"}))
        for reader in (None, unseen):
            shown = queue_view(queues, run_of, reader)
            (entry,) = shown.entries
            text = msgspec.json.encode(shown).decode()
            assert (entry.robots, entry.state, entry.author.name) == (("David",), "waiting", "Ann")
            assert ("secret" in text, entry.digest != "") == (reader is None, reader is None)
            assert entry.waits[0].run == run
            assert "by Ben." in entry.waits[0].text
            assert ("running other" in text) == (
                reader is None or not reader.hides(_of(run_of(run)))
            )
        control.stop_robot("David", author(BEN))
        text = msgspec.json.encode(queue_view(queues, run_of, unseen)).decode()
        assert '"closed":{"closing":' in text
        assert "secret" not in text


@virtual
async def test_nobody_puts_a_start_where_they_may_not_start() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        rules = Rules(operators=(Operator(BEN.person.id, "Ben"),))
        await control.rights.set_rules("David", rules, OLGA)
        with pytest.raises(Conflict, match="may not start on David"):
            await put(queues, on("David"))
        entry = await put(queues, on("David"), BEN)
        with pytest.raises(Refused, match="may not start on David"):
            await started(queues, entry)
        await started(queues, entry, BEN)


@virtual
async def test_pages_are_told_how_much_waits_and_whose_turn_it_is() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        hub = Hub(control, clock_us, queues=queues)
        run = await direct(control, "David")
        await put(queues, on("David"))
        assert hub.queue(ANN.person.id) == QueueMessage(1, 0, None)
        box = Outbox(hub, lambda: True, BEN)
        hub.boxes.add(box)
        sent: list[str] = []

        async def send(text: str) -> None:
            if '"queue"' in text:
                sent.append(text)

        async with anyio.create_task_group() as pages:
            pages.start_soon(box.deliver, send)
            await over(control, run)
            await anyio.sleep(1)
            pages.cancel_scope.cancel()
        assert [each.startswith('{"type":"queue","number":1,"yours":0') for each in sent] == [
            True
        ] * len(sent)
        assert len(sent) >= 2
        assert (hub.queue(ANN.person.id).yours, hub.queue(BEN.person.id).yours) == (1, 0)


@virtual
async def test_many_presses_of_one_entry_start_it_once_and_are_answered_with_its_run() -> None:
    lab = Lab()
    lab.david.old = 0.5
    async with lab.runner() as (control, queues):
        entry = await put(queues, on("David"))
        runs: list[str] = []

        async def press() -> None:
            runs.append(await started(queues, entry))

        async with anyio.create_task_group() as people:
            for _ in range(3):
                people.start_soon(press)
        assert len(set(runs)) == 1
        assert len(lab.david.starts) == 1
        await over(control, runs[0])
        again = await queues.start(entry.id, TurnRequest(""), author(ANN), ANN)
        assert (again.run.id, again.fresh) == (runs[0], False)
        assert len(lab.david.starts) == 1
    async with lab.runner() as (_, queues):
        assert queues.entries == ()
        again = await queues.start(entry.id, TurnRequest(""), author(ANN), ANN)
        assert (again.run.id, again.fresh) == (runs[0], False)


@virtual
async def test_twenty_starts_over_two_robots_go_on_where_no_robot_was_lost() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        entries = [
            await put(queues, on("David" if number % 2 else "Carol", f"task_{number}"))
            for number in range(20)
        ]
        for number in range(6):
            await over(control, await started(queues, entries[number]))
        run = await started(queues, entries[7])
        await until(lambda: control.open[run].run.state == "running")
        lab.david.engine = engine(QUICK)  # its process was started anew
        await until(lambda: why_closed(queues, "David") == "lost", 600)
        for number in range(6, 20, 2):
            await over(control, await started(queues, entries[number]))
        assert len(lab.carol.starts) == 10
        assert len(lab.david.starts) == 4
        waiting = [each for each in entries if each.entered.robots == ("David",)][4:]
        assert list(queues.entries) == waiting
        for each in waiting:
            with pytest.raises(Conflict, match="queue of David is closed"):
                await started(queues, each)
        with pytest.raises(Conflict):  # nobody has looked at the robot
            await reopened(queues, "David")
        await until(lambda: bool(control.open[run].run.lost), 600)
        await control.confirm_rest(run, RestRequest(how="It stands still."), author(BEN))
        await over(control, run)
        await anyio.sleep(600)
        assert len(lab.david.starts) == 4
        await reopened(queues, "David")
        for each in waiting:
            await over(control, await started(queues, each))
        assert len(lab.david.starts) == 10
        assert queues.entries == ()


@virtual
async def test_every_kind_of_stop_closes_the_queues_of_its_robots_alone() -> None:
    async def stop_all(control: ExecutionService, _run: str) -> None:
        control.stop_all(author(BEN))

    async def stop_robot(control: ExecutionService, _run: str) -> None:
        control.stop_robot("David", author(BEN))

    async def stop_run(control: ExecutionService, run: str) -> None:
        await control.stop(run, author(BEN))

    for stop in (stop_all, stop_robot, stop_run):
        for is_over in (False, True):
            lab = Lab()
            async with lab.runner() as (control, queues):
                run = await direct(control, "David")
                entry = await put(queues, on("David"))
                await put(queues, on("Carol"))
                if is_over:
                    await over(control, run)
                await stop(control, run)
                closed = queue_of(queues, "David").closed
                assert closed is not None
                assert (closed.why, closed.by) == ("stop", author(BEN))
                assert bool(why_closed(queues, "Carol")) == (stop is stop_all)
                await until(lambda c=control: not c.open)
                await anyio.sleep(60)
                with pytest.raises(Conflict, match="Ben pressed Stop"):
                    await started(queues, entry)
                assert len(lab.david.starts) == 1


@virtual
async def test_a_stop_that_comes_while_an_entry_is_being_started_lets_nothing_leave() -> None:
    for names_run in (False, True):
        lab = Lab()
        async with lab.runner() as (control, queues):
            run = await direct(control, "David")
            await over(control, run)
            entry, later = await put(queues, on("David")), await put(queues, on("David"))
            look = await queues.look(entry.id, {}, ANN)
            lab.harness.journal.slow = 1.0
            async with anyio.create_task_group() as people:
                asked = TurnRequest(look.digest)
                people.start_soon(queues.start, entry.id, asked, author(ANN), ANN)
                await anyio.sleep(0.5)
                if names_run:
                    await control.stop(run, author(BEN))
                else:
                    control.stop_robot("David", author(BEN))
            lab.harness.journal.slow = 0.0
            await until(lambda c=control: not c.open)
            assert len(lab.david.starts) == 1
            assert queues.entries == (later,)
            assert why_closed(queues, "David") == "stop"


@virtual
async def test_a_start_that_was_pressed_before_a_stop_does_not_leave_when_the_queue_is_open_again() -> (
    None
):
    lab = Lab()
    async with lab.runner() as (control, queues):
        entry = await put(queues, on("David"))
        look = await queues.look(entry.id, {}, ANN)
        found: list[object] = []

        async def press() -> None:
            try:
                found.append(
                    await queues.start(entry.id, TurnRequest(look.digest), author(ANN), ANN)
                )
            except Conflict as refused:
                found.append(refused.detail)

        async with anyio.create_task_group() as people, entry.turn:  # it is being removed, say
            people.start_soon(press)
            await anyio.sleep(0.5)
            control.stop_robot("David", author(BEN))
            await reopened(queues, "David")
            assert queue_of(queues, "David").closed is None
        assert found == ["Its queue was closed since, or a robot was not free. Look again."]
        await anyio.sleep(60)
        assert lab.david.starts == []


@virtual
async def test_what_changes_while_a_queue_is_being_opened_leaves_it_closed() -> None:
    lab = Lab()
    async with lab.runner() as (_, queues):
        await put(queues, on("David"))
        queues.close("David", author(BEN))
        lab.harness.journal.slow = 10.0
        async with anyio.create_task_group() as people:

            async def press() -> None:
                with pytest.raises(Conflict, match="opened or closed meanwhile"):
                    await reopened(queues, "David")

            people.start_soon(press)
            await anyio.sleep(1)
            lab.david.engine = engine(QUICK)  # its process was started anew
            await anyio.sleep(5)
        assert why_closed(queues, "David") == "person"


@virtual
async def test_a_run_that_moves_again_closes_a_queue_each_time() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        run = await direct(control, "David")
        await over(control, run)
        await put(queues, on("David"))
        known = await control.find(run)
        for at in (1, 2):
            queues._doubts.look_at(msgspec.structs.replace(known, moves_again_at=at))
            assert why_closed(queues, "David") == "moves"
            queues._doubts.look_at(msgspec.structs.replace(known, moves_again_at=at))
            await reopened(queues, "David")


@virtual
async def test_a_failed_run_a_baton_a_word_of_rest_and_a_person_close_a_queue() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        await control.rights.set_rules("David", Rules(baton=True), OLGA)
        await control.rights.take("David", ANN, author(ANN))
        first, _ = await put(queues, on("David")), await put(queues, on("David"))
        await control.rights.take("David", BEN, author(BEN), "my turn")
        assert why_closed(queues, "David") == "baton"
        with pytest.raises(Conflict, match="baton"):
            await reopened(queues, "David", ANN)
        await reopened(queues, "David", BEN)
        with pytest.raises(Conflict, match="baton"):
            await started(queues, first, ANN)
        run = await started(queues, first, BEN)
        await control.stop(run, author(BEN))
        await until(lambda: not control.open)
        assert why_closed(queues, "David") == "stop"
        queues.close("David", author(BEN))  # it is closed already
        assert why_closed(queues, "David") == "stop"
        await reopened(queues, "David")
        queues.close("David", author(BEN))
        assert why_closed(queues, "David") == "person"
        with pytest.raises(Conflict, match="closed again"):
            await queues.open("David", OpenQueueRequest("7"), author(BEN), BEN)


@virtual
async def test_an_entry_that_waits_for_a_closed_queue_keeps_nobody_waiting() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        graph = shared(sequence("together", 2), "Scout", "Carrier")
        both = await put(queues, QueueRequest(start=led(graph)))
        alone = await put(queues, on("Carol"))
        assert both.entered.robots == ("Carol", "David")
        assert (both.waits, [each.why for each in alone.waits]) == ((), ["behind"])
        control.stop_robot("David", author(BEN))
        assert [each.why for each in both.waits] == ["closed"]
        assert alone.waits == ()
        await reopened(queues, "David")
        assert both.waits == ()
        run = await started(queues, both)
        assert [each.why for each in alone.waits] == ["run"]
        await over(control, run)
        await over(control, await started(queues, alone))


@virtual
async def test_after_a_restart_the_entries_are_there_and_their_queues_are_closed() -> None:
    lab = Lab()
    async with lab.runner() as (_, queues):
        first, second = await put(queues, on("David")), await put(queues, on("David"))
        third = await put(queues, on("David"))
        await queues.move(third.id, MoveRequest(second.id), author(ANN), ANN)
        waiting_there = await put(queues, QueueRequest(start=order(sequence(), script=QUICK)))
    async with lab.runner() as (control, queues):
        await anyio.sleep(600)
        waiting = [each.id for each in queues.entries]
        assert waiting == [first.id, third.id, second.id, waiting_there.id]
        assert why_closed(queues, "David") == why_closed(queues, "simulator") == "restart"
        with pytest.raises(Conflict, match="started again"):
            await started(queues, queues.entries[0])
        await reopened(queues, "David")
        await until(lambda: bool(queues.entries[0].differs))
        assert "started again" in queues.entries[0].differs[0]
        await over(control, await started(queues, queues.entries[0]))
        assert len(lab.david.starts) == 1


@virtual
async def test_in_the_simulator_entries_start_by_themselves_one_after_the_other() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        with pytest.raises(BadInput, match="A person starts"):
            await put(queues, QueueRequest(start=on("David").start, by_itself=True))
        for number in range(3):
            start = order(sequence(f"task_{number}"), script=QUICK)
            await put(queues, QueueRequest(start=start, by_itself=True))
        await until(lambda: len(control.open) == 1)
        assert len(queues.entries) == 2
        await until(lambda: not queues.entries and not control.open, 600)
        assert [each.graph_name for each in lab.starts()] == ["task_0", "task_1", "task_2"]
        failing = order(sequence(), script={"*": [{"after_s": 2, "result": "on_error"}]})
        await put(queues, QueueRequest(start=failing, by_itself=True))
        last = await put(
            queues, QueueRequest(start=order(sequence(), script=QUICK), by_itself=True)
        )
        await until(lambda: why_closed(queues, "simulator") == "run")
        await anyio.sleep(600)
        assert queues.entries == (last,)
        await reopened(queues, "simulator")
        await until(lambda: not queues.entries and not control.open, 600)
        assert len(lab.starts()) == 5


@virtual
async def test_what_starts_by_itself_does_so_no_longer_than_its_person_is_signed_in() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        for _ in range(2):
            start = order(sequence(), script=QUICK)
            await put(queues, QueueRequest(start=start, by_itself=True))
        await until(lambda: len(control.open) == 1)
        lab.ended.sessions.add(ANN.session.id if ANN.session else "")
        await anyio.sleep(600)
        assert len(lab.starts()) == 1
        assert "not signed in" in queues.entries[0].differs[0]


@virtual
async def test_what_has_changed_since_is_said_and_has_to_be_looked_at_anew() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        entry = await put(queues, on("David"))
        seen = await queues.look(entry.id, {}, ANN)
        assert seen.differs == ()
        await control.rights.set_rules("David", Rules(drill_days=7), OLGA)
        with pytest.raises(Conflict, match="The rules of David have changed") as refused:
            await queues.start(entry.id, TurnRequest(seen.digest), author(ANN), ANN)
        assert refused.value.where is not None
        assert refused.value.where["path"] == "/look"
        with pytest.raises(Conflict):  # a Stop drill is due
            await started(queues, entry)
        await control.rights.set_rules("David", Rules(watched=True), OLGA)
        look = await queues.look(entry.id, {}, ANN)
        with pytest.raises(Conflict, match="watch"):
            await queues.start(entry.id, TurnRequest(look.digest), author(ANN), ANN)
        asked = TurnRequest(look.digest, {"David": True})
        assert (await queues.start(entry.id, asked, author(ANN), ANN)).fresh


@virtual
async def test_at_its_turn_the_runner_looks_and_says_what_differs() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        run = await direct(control, "David")
        entry = await put(queues, on("David"))
        await control.rights.set_rules("David", Rules(watched=True), OLGA)
        await over(control, run)
        await until(lambda: bool(entry.differs))
        assert "The rules of David have changed." in entry.differs


@virtual
async def test_why_a_queue_is_closed_quotes_no_run_and_no_refusal_to_who_may_not_see_all() -> None:
    lab = Lab()
    async with lab.runner() as (_, queues):
        await put(queues, on("David"))
        unseen = Unseen(BEN.person.id, frozenset({"hidden"}))
        for doubt in (Doubt("refused", "Pick secret."), Doubt("lost", "Pick secret.", run="r")):
            queues._doubts.meet(queue_of(queues, "David"), doubt)
            for reader in (None, unseen):
                shown = queue_view(queues, lambda _: None, reader)
                text = msgspec.json.encode(shown).decode()
                assert ("secret" in text) == (reader is None)
            await reopened(queues, "David")


@virtual
async def test_a_worker_that_dies_in_the_look_at_a_turn_ends_nothing_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def dies(*_: object) -> Preflight:
        raise Crashed("The process that worked on this has died; nothing came of it.")

    lab = Lab()
    async with lab.runner() as (control, queues):
        run = await direct(control, "David")
        entry = await put(queues, on("David"))
        with monkeypatch.context() as broken:
            broken.setattr(StartChecks, "_look", dies)
            await over(control, run)
            await until(lambda: bool(entry.differs))
        assert entry.differs == ("The process that worked on this has died; nothing came of it.",)
        await started(queues, entry)


@virtual
async def test_what_is_put_there_again_after_a_failure_stays(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def away(*_: object, **__: object) -> int:
        raise Unavailable("the disk is away")

    lab = Lab()
    async with lab.runner() as (_, queues):
        request = on("David")
        with monkeypatch.context() as broken:
            broken.setattr(lab.harness.journal, "append", away)
            broken.setattr(lab.harness.journal, "newest", away)
            with pytest.raises(Unavailable):
                await put(queues, request)
            await anyio.sleep(0.5)
        entry = await put(queues, request)
        await anyio.sleep(60)
    async with lab.runner() as (_, queues):
        assert [each.id for each in queues.entries] == [entry.id]


@virtual
async def test_people_move_and_remove_their_own_and_owners_any() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        await direct(control, "David")
        anns = [await put(queues, on("David")) for _ in range(2)]
        bens = [await put(queues, on("David"), BEN) for _ in range(2)]
        elsewhere = await put(queues, on("Carol"), BEN)
        with pytest.raises(Forbidden, match="Ann put this"):
            await queues.move(anns[0].id, MoveRequest(), author(BEN), BEN)
        with pytest.raises(Forbidden, match="before the start of Ann"):
            await queues.move(bens[0].id, MoveRequest(anns[1].id), author(BEN), BEN)
        await queues.move(bens[1].id, MoveRequest(bens[0].id), author(BEN), BEN)
        await queues.move(elsewhere.id, MoveRequest(anns[0].id), author(BEN), BEN)
        await queues.move(anns[0].id, MoveRequest(), author(ANN), ANN)
        expected = [elsewhere, anns[1], bens[1], bens[0], anns[0]]
        assert list(queues.entries) == expected
        olga = msgspec.structs.replace(
            ANN, person=msgspec.structs.replace(ANN.person, id="olga", role="owner")
        )
        await queues.move(bens[0].id, MoveRequest(anns[1].id), author(olga), olga)
        with pytest.raises(Forbidden, match="Ann put this"):
            await queues.remove(anns[1].id, author(BEN), BEN)
        await queues.remove(anns[1].id, author(olga), olga)
        await queues.remove(anns[0].id, author(ANN), ANN)
        with pytest.raises(NotFound):
            await started(queues, anns[0])
        assert list(queues.entries) == [elsewhere, bens[0], bens[1]]


@virtual
async def test_what_cannot_wait_is_refused_and_one_request_is_put_there_once() -> None:
    lab = Lab()
    async with lab.runner() as (_, queues):
        with pytest.raises(BadInput, match="Stop drill"):
            await put(queues, on("David", drill=True))
        with pytest.raises(BadInput, match="watch"):
            await put(queues, on("David", watching={"David": True}))
        with pytest.raises(Conflict, match="digest"):
            await put(queues, on("David", digest="0" * 64))
        request = on("David")
        lab.harness.journal.down = True
        with pytest.raises(Unavailable):
            await put(queues, request)
        lab.harness.journal.down = False
        assert queues.entries == ()
        entry = await put(queues, request)
        assert await queues.put(request, author(ANN), ANN) == (entry, False)
        with pytest.raises(Conflict, match="another entry"):
            await queues.put(request, author(BEN), BEN)
        await queues.remove(entry.id, author(ANN), ANN)
        with pytest.raises(Conflict, match="has left"):
            await put(queues, request)
        for _ in range(MOST_OF_ONE):
            await put(queues, on("David"))
        with pytest.raises(Conflict, match="starts of yours wait"):
            await put(queues, on("David"))


@virtual
async def test_a_start_that_cannot_be_stored_leaves_its_entry_where_it_is() -> None:
    lab = Lab()
    async with lab.runner() as (control, queues):
        entry = await put(queues, on("David"))
        lab.harness.journal.down = True
        with pytest.raises(Refused):
            await started(queues, entry)
        lab.harness.journal.down = False
        assert queues.entries == (entry,)
        await over(control, await started(queues, entry))
        assert len(lab.david.starts) == 1
