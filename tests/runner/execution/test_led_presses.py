"""*Go on* and an outcome by word count once for each press, also if its answer is lost and it is sent
again."""

from collections.abc import Awaitable, Callable, Sequence
from datetime import UTC, datetime, timedelta
from typing import Literal

import anyio
import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some

from action_assistant.errors import Conflict, OutcomeUnknown, Refused
from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.events import (
    Author,
    Held,
    PieceBegan,
    PieceEnded,
    Released,
    decode,
)
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.views import microseconds, time
from action_assistant.runner.start.admission import GoOnRequest, WaitRequest, WordRequest
from action_assistant.umrf.breakpoints import Breakpoint
from runner.execution.test_conductor import Lab, led, shared
from runner.harness import (
    ANN,
    BEN,
    carousel,
    clock_us,
    ended,
    engine,
    run_in_virtual_time,
    sequence,
    stand_still,
    until,
    virtual,
)
from support.doses import examples


def hold(control: ExecutionService, run: str) -> datetime:
    """Hold a led run now; return the moment as people see it."""
    control._conductors._open[run].gate.hold_run("A robot was lost.")
    held = control.open[run].run.held
    assert held is not None
    return time(held.at)


def now_held(control: ExecutionService, run: str) -> Held:
    """Return why a led run is held now."""
    held = control.open[run].run.held
    assert held is not None
    return held


def released(lab: Lab, run: str) -> list[Released]:
    return [each for each in lab.harness.journal.told(run) if isinstance(each, Released)]


async def waiting_for_a_word(lab: Lab, control: ExecutionService) -> tuple[str, WordRequest]:
    """Start a run that is held, and waits for the outcome of its first action by word."""
    run = await lab.led_run(control, lost="wait")
    lab.david.engine = engine({"*": [{"after_s": 5}]})
    await until(lambda: bool(control.open[run].run.held))
    piece = control.open[run].run.actions["Work_0"].piece
    await control.confirm_rest(piece, RestRequest("I stand beside it."), BEN)
    await until(lambda: "without an outcome" in control.open[run].run.alarms[-1].text)
    word = WordRequest("Work_0", "true", "It stands at the door.", piece, request_id="word 1")
    return run, word


@virtual
async def test_a_repeated_go_on_opens_no_gate_that_has_closed_since() -> None:
    lab = Lab({"*": [{"after_s": 20}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        press = GoOnRequest(hold(control, run), request_id="press 1")
        assert (await control.go_on(run, press, BEN)).held is None
        assert (await control.go_on(run, press, BEN)).held is None
        await anyio.sleep(1)
        hold(control, run)
        repeated = await control.go_on(run, press, BEN)
        assert repeated.held is not None
        await anyio.sleep(60)
        assert control.open[run].run.held is not None
        assert lab.carol.starts == []
    async with lab.runner() as control:
        await anyio.sleep(10)
        assert (await control.go_on(run, press, BEN)).held is not None
        assert control.open[run].run.held is not None
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"
        assert (await control.go_on(run, press, BEN)).state == "stopped"
    assert [each.request_id for each in released(lab, run)] == ["press 1"]


@virtual
async def test_a_go_on_that_is_sent_twice_at_once_is_answered_twice_and_counts_once() -> None:
    lab = Lab({"*": [{"after_s": 20}]})
    lab.david.old = lab.carol.old = 0.5  # a look takes so long
    answers: list[Run] = []
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        press = GoOnRequest(hold(control, run), request_id="press 1")

        async def send() -> None:
            answers.append(await control.go_on(run, press, BEN))

        async with anyio.create_task_group() as tasks:
            for _ in range(3):
                tasks.start_soon(send)
                await anyio.sleep(0.05)
        assert [each.held for each in answers] == [None] * 3
        await control.stop(run, BEN)
        await ended(control, run)
    assert len(released(lab, run)) == 1


@virtual
async def test_a_request_id_of_another_press_is_refused_by_name() -> None:
    lab = Lab({"*": [{"after_s": 20}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        press = GoOnRequest(hold(control, run), request_id="press 1")
        await control.go_on(run, press, BEN)
        later = msgspec.structs.replace(press, since=press.since + timedelta(seconds=1))
        word = WordRequest("Work_0", "true", "I saw it.", request_id="press 1")
        for refusing in (
            control.go_on(run, press, ANN),
            control.go_on(run, later, BEN),
            control.give_outcome(run, word, BEN),
        ):
            with pytest.raises(Conflict, match="belongs to another request") as refused:
                await refusing
            assert refused.value.where == {"path": "/request_id"}
        await control.stop(run, BEN)
        await ended(control, run)


@virtual
async def test_a_refused_go_on_has_not_counted_and_is_looked_at_anew() -> None:
    lab = Lab({"*": [{"after_s": 20}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        lab.david.silent = True
        await until(lambda: control.open[run].run.held is not None)
        held = control.open[run].run.held
        assert held is not None
        press = GoOnRequest(time(held.at), request_id="press 1")
        with pytest.raises(Conflict):
            await control.go_on(run, press, BEN)
        lab.david.silent = False
        await anyio.sleep(5)
        assert (await control.go_on(run, press, BEN)).held is None
        assert await ended(control, run) == "finished"


async def refused_meanwhile(
    lab: Lab, control: ExecutionService, run: str, happens: Callable[[], Awaitable[object]]
) -> Held:
    """Press *Go on* while the robot takes a while to answer, and let something happen meanwhile; return the
    reason for which the run is held then."""
    since = hold(control, run)
    lab.david.old = 1.5
    refusals: list[str] = []

    async def press() -> None:
        try:
            await control.go_on(run, GoOnRequest(since, request_id="go"), BEN)
        except Conflict as why:
            refusals.append(why.detail)

    async with anyio.create_task_group() as tasks:
        tasks.start_soon(press)
        await anyio.sleep(0.05)
        await happens()
    assert [why for why in refusals if "another reason to wait" in why], refusals
    held = control.open[run].run.held
    assert held is not None
    return held


@virtual
async def test_a_wait_that_is_pressed_while_go_on_asks_the_robots_counts() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        waiting = WaitRequest(request_id="wait", reason="somebody walks in")
        held = await refused_meanwhile(lab, control, run, lambda: control.wait(run, waiting, ANN))
        told = [each for each in lab.harness.journal.told(run) if isinstance(each, Held)]
        assert (told[-1].by, told[-1].reason) == (ANN, "somebody walks in")
        assert held.why == f"A robot was lost. {ANN.name} made it wait: somebody walks in"
        assert held.how == "trouble", "whoever lets it go on has seen both"
        await anyio.sleep(30)
        assert lab.carol.starts == []
        await control.wait(run, waiting, ANN)
        assert control.open[run].run.held == held, "a repeated press changes nothing"


@virtual
async def test_a_runner_that_stands_still_while_go_on_asks_the_robots_lets_nothing_begin() -> None:
    async def stands_still() -> None:
        stand_still(6)

    lab = Lab({"*": [{"after_s": 20}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        held = await refused_meanwhile(lab, control, run, stands_still)
        assert "stood still" in held.why
        await anyio.sleep(30)
        assert lab.carol.starts == []


@virtual
async def test_a_second_wait_with_the_same_words_counts_as_well() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        await control.wait(run, WaitRequest(request_id="first"), ANN)
        first = control.open[run].run.held
        assert first is not None
        lab.david.old = 1.5
        refusals: list[str] = []

        async def press() -> None:
            try:
                await control.go_on(run, GoOnRequest(time(first.at), request_id="go"), BEN)
            except Conflict as why:
                refusals.append(why.detail)

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(press)
            await anyio.sleep(0.05)
            await control.wait(run, WaitRequest(request_id="second"), ANN)
        held = control.open[run].run.held
        assert held is not None, "Ann was answered that it waits"
        assert held.why == first.why
        assert len(refusals) == 1
        assert {"first", "second"} <= control.open[run].run.pressed.keys()
        await anyio.sleep(10)
        assert lab.carol.starts == []


@virtual
async def test_a_fault_behind_a_wait_is_nobodys_press() -> None:
    lab = Lab({"*": [{"after_s": 50}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        hold(control, run)
        await control.wait(run, WaitRequest(request_id="wait"), ANN)
        stand_still(6)
        await anyio.sleep(3)
        told = [each for each in lab.harness.journal.told(run) if isinstance(each, Held)]
        assert [each.by for each in told] == [None, ANN, None]
        assert {each.how for each in told} == {"trouble"}
        assert "made it wait. The runner stood still" in told[-1].why


@virtual
async def test_a_breakpoint_that_is_reached_during_trouble_is_seen_with_it() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        graph = shared(sequence("task", 3), "Scout", "Carrier")
        point = Breakpoint(action="Work_0", outcomes=("true",))
        started = await control.start(led(graph, lost="wait", breakpoints=(point,)), ANN)
        run = started.run.id
        await until(lambda: bool(lab.david.starts))
        hold(control, run)
        await until(lambda: "Breakpoint" in (now_held(control, run).why))
        held = now_held(control, run)
        assert held.why.startswith("A robot was lost. Breakpoint after Work_0")
        await control.go_on(run, GoOnRequest(time(held.at)), BEN)
        assert control.open[run].run.held is None


@virtual
async def test_the_same_reason_again_refuses_no_go_on() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        since = hold(control, run)
        lab.david.old = 0.5
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(control.go_on, run, GoOnRequest(since, request_id="go"), BEN)
            await anyio.sleep(0.05)
            assert hold(control, run) == since
        assert control.open[run].run.held is None


@virtual
async def test_a_repeated_word_counts_once_also_after_a_restart() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        run, word = await waiting_for_a_word(lab, control)
        await control.give_outcome(run, word, BEN)
        words = [each for each in lab.harness.journal.told(run) if isinstance(each, PieceEnded)]
        assert [(each.how, each.request_id) for each in words] == [("word", "word 1")]
        await control.give_outcome(run, word, BEN)
        await control.give_outcome(run, msgspec.structs.replace(word, piece=""), BEN)
        other = msgspec.structs.replace(word, outcome="false")
        with pytest.raises(Conflict, match="belongs to another request"):
            await control.give_outcome(run, other, BEN)
    async with lab.runner() as control:
        await anyio.sleep(5)
        await control.give_outcome(run, word, BEN)
        held = control.open[run].run.held
        assert held is not None
        await control.go_on(run, GoOnRequest(time(held.at)), BEN)
        assert await ended(control, run) == "finished"
        assert (await control.give_outcome(run, word, BEN)).state == "finished"
    told = [each for each in lab.harness.journal.told(run) if isinstance(each, PieceEnded)]
    assert [each.how for each in told] == ["word", "shape"]


@virtual
async def test_a_word_that_cannot_be_stored_is_not_called_stored() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        run, word = await waiting_for_a_word(lab, control)
        lab.harness.journal.down = True
        with pytest.raises(OutcomeUnknown, match="could not be stored yet"):
            await control.give_outcome(run, word, BEN)
        lab.harness.journal.down = False
        await until(lambda: control.open[run].recorder.flushed is not None)
        await anyio.sleep(5)
        await control.give_outcome(run, word, BEN)
        await control.stop(run, BEN)
        await ended(control, run)
    told = [each for each in lab.harness.journal.told(run) if isinstance(each, PieceEnded)]
    assert [each.request_id for each in told if each.how == "word"] == ["word 1"]


def test_events_of_earlier_versions_name_no_press() -> None:
    old = b'{"at":5,"author":{"id":"ben","name":"Ben"}}'
    assert decode(Released.kind, old) == Released(at=5, author=BEN)
    assert msgspec.json.encode(Released(at=5, author=BEN)) == old


def test_a_moment_without_an_offset_counts_as_utc() -> None:
    moment = datetime(2026, 11, 28, 9, 0, 0, 7, tzinfo=UTC)
    assert time(microseconds(moment)) == moment
    assert microseconds(moment.replace(tzinfo=None)) == microseconds(moment)


class Sent(msgspec.Struct, frozen=True):
    """A press: who, which of the moments of holding that were seen, and when each copy arrives."""

    who: Author
    request_id: str
    back: int
    arrivals: tuple[float, ...]


Step = Sent | Literal["hold", "wait", "restart", "silence"]
_DELAYS = some.sampled_from((0.0, 0.1, 0.3, 1.0, 4.0))
_SENT = some.builds(
    Sent,
    some.sampled_from((ANN, BEN)),
    some.sampled_from(("a", "b", "c", "d")),
    some.integers(0, 1),
    some.lists(_DELAYS, min_size=1, max_size=3).map(tuple),
)
_STEPS = some.lists(
    some.one_of(_SENT, some.sampled_from(("hold", "wait", "restart", "silence"))),
    min_size=3,
    max_size=9,
)


class History:
    """A run that never ends, and presses of two people whose copies arrive in any order."""

    def __init__(self) -> None:
        self.lab = Lab({"*": [{"after_s": 8}]})
        self.lab.david.old = self.lab.carol.old = 0.3
        self.control: ExecutionService | None = None
        self.run = ""
        self.seen: list[datetime] = []
        self.answers: list[tuple[Sent, datetime, bool]] = []

    async def live(self, steps: Sequence[Step]) -> None:
        async with anyio.create_task_group() as wires:
            rest = list(steps)
            while True:
                async with self.lab.runner() as control:
                    if not self.run:
                        graph = shared(carousel(), "Scout", "Carrier")
                        started = await control.start(led(graph, lost="wait"), ANN)
                        self.run = started.run.id
                    self.control = control
                    await anyio.sleep(3)
                    while rest and rest[0] != "restart":
                        await self._take(rest.pop(0), wires.start_soon)
                    if not rest:
                        await anyio.sleep(7)
                        await control.stop(self.run, BEN)
                        await ended(control, self.run)
                        return
                    rest.pop(0)
                    self.control = None

    async def _take(self, step: Step, start_soon: Callable[..., object]) -> None:
        assert self.control is not None
        now = self.control.open[self.run].run
        if now.held is not None and time(now.held.at) not in self.seen:
            self.seen.append(time(now.held.at))
        match step:
            case "hold":
                if now.held is None:
                    self.seen.append(hold(self.control, self.run))
            case "silence":
                self.lab.david.silent = True
                await anyio.sleep(5)
                self.lab.david.silent = False
            case Sent(back=back, arrivals=arrivals) if len(self.seen) > back:
                for after in arrivals:
                    start_soon(self._arrive, step, self.seen[-1 - back], after)
            case _:
                await anyio.sleep(2)

    async def _arrive(self, sent: Sent, since: datetime, after: float) -> None:
        await anyio.sleep(after)
        if self.control is None or self.run not in self.control.open:
            return
        asked = GoOnRequest(since, request_id=sent.request_id)
        try:
            await self.control.go_on(self.run, asked, sent.who)
        except Refused:
            self.answers.append((sent, since, False))
        else:
            self.answers.append((sent, since, True))

    def check(self) -> None:
        """Raise AssertionError if a press has counted twice, has opened another gate than its person
        saw, or a repeat was refused after it had counted."""
        told = self.lab.harness.journal.told(self.run)
        held: Held | None = None
        counted: dict[str, tuple[str, int]] = {}
        for event in told:
            match event:
                case Held():
                    held = event
                case Released():
                    assert held is not None
                    assert event.since == held.at
                    assert event.request_id not in counted
                    counted[event.request_id] = event.author.id, event.since
                    held = None
                case PieceBegan():
                    assert held is None
        for sent, since, is_taken in self.answers:
            press = sent.who.id, microseconds(since)
            if is_taken:
                assert counted[sent.request_id] == press
        taken: set[tuple[str, str, datetime]] = set()
        for sent, since, is_taken in self.answers:  # a repeat is answered as the first one
            asked = sent.request_id, sent.who.id, since
            assert is_taken or asked not in taken
            if is_taken:
                taken.add(asked)


@settings(max_examples=examples(6), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(_STEPS)
def test_no_order_of_presses_and_repeats_lets_a_run_go_on_twice_for_one(steps: list[Step]) -> None:
    async def main() -> None:
        history = History()
        await history.live(steps)
        history.check()

    run_in_virtual_time(main)


def test_the_clock_of_the_runner_gives_moments_that_people_can_send_back() -> None:
    async def main() -> None:
        assert microseconds(time(clock_us())) == clock_us()

    run_in_virtual_time(main)


@virtual
async def test_of_many_reasons_the_first_and_the_newest_are_shown_and_the_others_counted() -> None:
    lab = Lab()
    async with lab.runner() as control:
        run = await lab.led_run(control)
        for number in range(60):
            control._conductors._open[run].gate.hold_run(f"{number:02}: a robot was lost there.")
        why = now_held(control, run).why
        assert why.startswith("00: a robot was lost there. 01: ")
        assert why.endswith(" 59: a robot was lost there.")
        shown = why.count("a robot was lost there.")
        assert f"{60 - shown} more stand in the events of the run." in why
        assert 30 < shown < 60
        assert len(why) < 1200
        await control.stop(run, ANN)
        await ended(control, run)
