"""Visible pages of operators: who counts, what is held and stopped without one, what opens again."""

import os
import random
from collections import Counter
from contextlib import suppress
from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import Conflict
from action_assistant.runner.api.live import Hub, Outbox
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.robots.rights import Rules
from action_assistant.runner.runs.events import Held, StopRequested
from action_assistant.runner.runs.page_presence import PagePresence
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest, GroupRequest
from action_assistant.web.auth.identity import Identity, Token
from action_assistant.web.auth.keys import Person, Session
from runner.execution.test_conductor import Lab, led, shared
from runner.execution.test_led_rights import begin, go_on, held, sent
from runner.harness import clock_us, ended, order, sequence, stand_still, until, virtual
from runner.start.test_rights_registry import ANN, BEN, OLGA, Ended, author

RULE = PagePresence(wait_s=5.0, stop_s=20.0)
RULES = Rules(page_presence=RULE)
SLOW: dict[str, Any] = {"*": [{"after_s": 8}]}
HISTORIES = int(os.environ.get("TEST_PAGE_HISTORIES", "20"))
LONG: dict[str, Any] = {"*": [{"after_s": 200}]}


class Page:
    """A page that answers each second while it is visible."""

    def __init__(self, control: ExecutionService, of: Identity = ANN) -> None:
        self._control, self._of = control, of
        self.is_visible = True

    async def run(self) -> None:
        """Answer until cancelled."""
        while True:
            if self.is_visible:
                self._control.rights.see(self._of, anyio.current_time())
            await anyio.sleep(1)


async def rules(control: ExecutionService, *robots: str, given: Rules = RULES) -> None:
    for robot in robots:
        await control.rights.set_rules(robot, given, OLGA)


async def whole(control: ExecutionService, by: Identity = ANN) -> str:
    """Start a run that David's engine gets whole, and wait until it moves."""
    run = (await control.start(order(sequence(), engine="David"), author(by), by)).run.id
    await until(lambda: control.open[run].run.state == "running")
    return run


def alarms(lab: Lab, run: str) -> list[str]:
    return [each.code for each in lab.harness.journal.history(run).alarms]


@virtual
async def test_a_missing_page_closes_the_gate_and_its_return_opens_nothing() -> None:
    lab = Lab(SLOW)
    async with lab.runner() as control, anyio.create_task_group() as tasks:
        await rules(control, "David")
        page = Page(control)
        tasks.start_soon(page.run)
        run = await begin(lab, control)
        await anyio.sleep(10)
        assert (sent(lab), held(control, run)) == (2, "")
        page.is_visible = False
        at = anyio.current_time()
        await until(lambda: held(control, run) != "")
        assert 4 <= anyio.current_time() - at < 5.5
        page.is_visible = True
        before = sent(lab)
        assert (
            held(control, run) == "No visible page of Ann has answered for 5 s: David asks for one."
        )
        await anyio.sleep(60)
        assert sent(lab) == before
        assert control.open[run].run.desired == "running"  # it waits, and is not stopped
        await go_on(control, run, ANN)
        assert await ended(control, run) == "finished"
        assert sent(lab) == 4
        tasks.cancel_scope.cancel()


@virtual
async def test_a_led_run_whose_page_stays_away_is_stopped() -> None:
    lab = Lab(LONG)
    async with lab.runner() as control:
        await rules(control, "David")
        run = await begin(lab, control)
        at = anyio.current_time()
        assert await ended(control, run) == "stopped"
        assert 15 <= anyio.current_time() - at < 25
        told = lab.harness.journal.told(run)
        first = next(each for each in told if isinstance(each, Held | StopRequested))
        (stop,) = (each for each in told if isinstance(each, StopRequested))
        assert isinstance(first, Held)
        assert stop.author.name == "the watch for pages of David"
        assert alarms(lab, run)[-1] == "page_missing"


@virtual
async def test_a_run_that_an_engine_got_whole_is_stopped_alone_until_that_is_proven() -> None:
    lab = Lab(LONG)
    async with lab.runner() as control, anyio.create_task_group() as tasks:
        await rules(control, "David")
        page = Page(control)
        tasks.start_soon(page.run)
        run = await whole(control)
        await anyio.sleep(60)
        page.is_visible = False
        lab.david.loss = 0.9  # most Stops are lost
        await anyio.sleep(18)
        assert control.open[run].run.desired == "running"
        await anyio.sleep(4)
        assert control.open[run].run.desired == "stopped"
        page.is_visible = True  # that takes nothing back
        assert await ended(control, run) == "stopped"
        assert len(lab.david.stops) > 1
        assert alarms(lab, run).count("page_missing") == 1
        tasks.cancel_scope.cancel()


@virtual
async def test_the_holder_of_the_baton_counts_and_nobody_else_by_whatever_name() -> None:
    lab = Lab(LONG)
    double = Identity(
        Person("other", "Ann", "operator"),
        session=Session("s_other", Person("other", "Ann", "operator"), 2e9),
    )
    async with lab.runner() as control, anyio.create_task_group() as tasks:
        await rules(control, "David", given=Rules(baton=True, page_presence=RULE))
        await control.rights.take("David", ANN, author(ANN))
        run = await whole(control)
        ben = Page(control, BEN)
        tasks.start_soon(ben.run)
        tasks.start_soon(Page(control, double).run)
        await anyio.sleep(10)
        await control.rights.take("David", BEN, author(BEN), "Ann has left.")
        await anyio.sleep(60)
        assert control.open[run].run.desired == "running"
        ben.is_visible = False
        await anyio.sleep(15)
        await control.rights.drop("David", BEN, author(BEN))
        await until(lambda: control.open[run].run.desired == "stopped", 30)
        assert await ended(control, run) == "stopped"
        tasks.cancel_scope.cancel()


@virtual
async def test_a_program_is_nobody_who_is_there() -> None:
    lab = Lab(SLOW)
    robot = Token("t", "robot", ANN.person, frozenset({"operate"}))
    program = msgspec.structs.replace(ANN, session=None, token=robot)
    async with lab.runner() as control, anyio.create_task_group() as tasks:
        await rules(control, "David")
        tasks.start_soon(Page(control, program).run)
        request = led(shared(sequence("task", 4), "Scout", "Carrier"))
        run = (await control.start(request, author(ANN), program)).run.id
        await until(lambda: held(control, run) != "")
        assert held(control, run).startswith("It is unknown whether Ann is there")
        with pytest.raises(Conflict, match="no visible page has answered yet"):
            await go_on(control, run, program)
        await go_on(control, run, ANN)
        await control.stop(run, author(ANN))
        assert await ended(control, run) == "stopped"
        tasks.cancel_scope.cancel()


@virtual
async def test_a_runner_that_stood_still_calls_no_page_missing_for_that_time() -> None:
    lab = Lab(LONG)
    async with lab.runner() as control, anyio.create_task_group() as tasks:
        await rules(control, "David")
        page = Page(control)
        tasks.start_soon(page.run)
        run = await whole(control)
        stand_still(300)
        await anyio.sleep(15)
        assert control.open[run].run.desired == "running"
        assert alarms(lab, run) == ["page_asked_anew"]
        stand_still(60)
        page.is_visible = False  # nobody answers what was asked anew
        await anyio.sleep(12)
        assert control.open[run].run.desired == "running"
        assert await ended(control, run) == "stopped"
        tasks.cancel_scope.cancel()


@virtual
async def test_after_a_restart_it_is_unknown_who_is_there_and_the_time_counts_anew() -> None:
    lab = Lab(LONG)
    async with lab.runner() as control:
        await rules(control, "David")
        run = await whole(control)
        await anyio.sleep(15)
    async with lab.runner() as control:
        await anyio.sleep(15)
        assert control.open[run].run.desired == "running"
        assert await ended(control, run) == "stopped"
    found = lab.harness.journal.history(run)
    assert "It is unknown whether Ann is there" in found.alarms[-1].text


@virtual
async def test_a_led_run_that_a_restart_holds_is_stopped_later_too() -> None:
    lab = Lab(LONG)
    async with lab.runner() as control:
        await rules(control, "David")
        run = await begin(lab, control)
    async with lab.runner() as control:
        await anyio.sleep(15)
        assert held(control, run).startswith("The runner was restarted")
        assert control.open[run].run.desired == "running"
        assert await ended(control, run) == "stopped"


@virtual
async def test_without_the_rule_and_in_the_simulator_nobody_has_to_be_there() -> None:
    lab = Lab(LONG)
    async with lab.runner() as control:
        run = await whole(control)
        await rules(control, "Carol")
        never: Any = {"*": [{"never": True}]}
        simulated = (await control.start(order(sequence("other"), script=never), author(ANN))).run
        await anyio.sleep(60)
        for each in (run, simulated.id):
            assert control.open[each].run.desired == "running"
        await rules(control, "David")  # from now on
        await anyio.sleep(15)
        assert control.open[run].run.desired == "running"
        await rules(control, "David", given=Rules())
        await anyio.sleep(60)
        assert control.open[run].run.desired == "running"
        control.stop_all(author(ANN))
        await until(lambda: not control.open)


@virtual
async def test_the_look_before_a_start_says_what_happens_without_a_page() -> None:
    lab = Lab(SLOW)
    async with lab.runner() as control:
        await rules(control, "David")
        ask = led(shared(sequence("task", 2), "Scout", "Carrier"))
        same = ("umrf", "version", "digest", "robots", "lost", "graph")
        fields = {each: getattr(ask, each) for each in same}
        looks = await control.look(GroupRequest(**fields, engines=("conducted",)), "ann", ANN)
        items = {each.engine: {i.code: i for i in each.items} for each in looks}
        assert "after 5 s nothing further begins" in items["David"]["present"].text
        assert items["David"]["present"].verdict == "warned"  # no page has answered yet
        assert "present" not in items["Carol"]
        control.rights.see(ANN, anyio.current_time())
        alone = order(sequence())
        fields = {each: getattr(alone, each) for each in ("umrf", "version", "digest", "graph")}
        (look,) = await control.look(GroupRequest(**fields, engines=("David",)), "ann", ANN)
        (item,) = (each for each in look.items if each.code == "present")
        assert (item.verdict, "cannot be made to wait" in item.text) == ("passed", True)
        assert "no enabling device" in item.text


@virtual
async def test_only_the_open_page_of_an_operator_with_a_session_is_asked_and_counts() -> None:
    lab, end = Lab(LONG), Ended()
    viewer = Person("vera", "Vera", "viewer")
    vera = Identity(viewer, session=Session("s_vera", viewer, 2e9))
    robot = Token("t", "robot", BEN.person, frozenset({"operate"}))
    program = msgspec.structs.replace(BEN, session=None, token=robot)
    async with lab.runner(end) as control, anyio.create_task_group() as tasks:
        hub = Hub(control, clock_us, identity_now=end)
        asked: dict[str, list[str]] = {"ann": [], "vera": [], "program": [], "expired": []}
        boxes = {
            "ann": Outbox(hub, lambda: True, ANN),
            "vera": Outbox(hub, lambda: True, vera),
            "program": Outbox(hub, lambda: True, program),
            "expired": Outbox(hub, lambda: False, BEN),
        }

        async def deliver(name: str) -> None:
            async def send(text: str) -> None:
                if text.startswith('{"type":"there"'):
                    asked[name].append(text)

            await boxes[name].deliver(send)

        for name in boxes:
            tasks.start_soon(deliver, name)
        await anyio.sleep(5)
        assert asked["ann"] == []  # no robot asks for it
        await rules(control, "David")
        await anyio.sleep(30)
        assert 15 <= len(asked["ann"]) <= 30
        assert asked["vera"] + asked["program"] + asked["expired"] == []
        for number in (0, 10_000, -1):  # too old, and never asked
            await hub.follow(f'{{"type":"here","number":{number}}}', OLGA, here=boxes["ann"].here)
        assert control.rights.seen_at("ann") is None
        newest = asked["ann"][-1].replace("there", "here")
        assert await hub.follow(newest, OLGA, here=boxes["ann"].here) == ""
        seen_at = control.rights.seen_at("ann")
        assert seen_at is not None
        assert anyio.current_time() - 1.6 < seen_at <= anyio.current_time()
        await anyio.sleep(3)
        end.sessions.add("s_ann")
        await hub.follow(asked["ann"][-1].replace("there", "here"), OLGA, here=boxes["ann"].here)
        assert control.rights.seen_at("ann") == seen_at
        tasks.cancel_scope.cancel()


@virtual
async def test_whoever_gets_a_run_has_the_whole_time_from_then_on() -> None:
    lab = Lab(SLOW)
    async with lab.runner() as control:
        await rules(control, "David", "Carol", given=Rules(baton=True, page_presence=RULE))
        for name in ("David", "Carol"):
            await control.rights.take(name, ANN, author(ANN))
        run = await begin(lab, control)
        await anyio.sleep(3)
        with control.rights.here(BEN):  # a page that is open, and not visible
            await control.hand_over(run, "ben", author(ANN), ANN)
            await anyio.sleep(4)
            assert held(control, run) == ""
            await anyio.sleep(2)
            assert held(control, run).startswith("It is unknown whether Ben is there")
        assert await ended(control, run) == "stopped"


@virtual
async def test_a_program_that_takes_and_drops_the_baton_gives_a_run_no_time() -> None:
    lab = Lab(LONG)
    token = Identity(BEN.person, token=Token("t", "Script", BEN.person, frozenset({"operate"})))
    async with lab.runner() as control, anyio.create_task_group() as tasks:
        await rules(control, "David", given=Rules(baton=True, page_presence=RULE))
        await control.rights.take("David", ANN, author(ANN))
        page = Page(control)
        tasks.start_soon(page.run)
        run = await whole(control)
        await anyio.sleep(5)
        page.is_visible = False
        at = anyio.current_time()
        while anyio.current_time() - at < 60:
            opened = control.open.get(run)
            if opened is None or opened.run.desired == "stopped":
                break
            with suppress(Conflict):
                await control.rights.take("David", token, author(token), "Again.")
            await anyio.sleep(2)
            with suppress(Conflict):
                await control.rights.drop("David", token, author(token))
            await anyio.sleep(2)
        assert anyio.current_time() - at < 26
        assert await ended(control, run) == "stopped"
        tasks.cancel_scope.cancel()


@virtual
async def test_a_robot_that_is_registered_again_is_watched_again() -> None:
    lab = Lab(LONG)
    async with lab.runner() as control:
        await rules(control, "David")
        await anyio.sleep(1)
        known = control.robots.registration("David")
        await control.remove("David", author(ANN))
        await anyio.sleep(5)
        await control.register(known, author(ANN))
        await until(lambda: control.robots.robot("David").heard_at is not None)
        run = await whole(control)
        assert await ended(control, run) == "stopped"


class Starts(list[Any]):
    """The messages that a robot got, with their times."""

    def __init__(self, times: list[float]) -> None:
        super().__init__()
        self._times = times

    def append(self, order: Any) -> None:
        """Note a message, and when it left."""
        self._times.append(anyio.current_time())
        super().append(order)


class Chance:
    """A page that comes and goes by chance in front of a runner that stands still at times. `there`: when
    Ann was last there; `stalls`: when each stall was over, and its length."""

    def __init__(self, seed: int) -> None:
        self.pick = random.Random(seed)
        self.there: list[float] = []
        self.stalls: list[tuple[float, float]] = []

    async def live(self, control: ExecutionService, run: str, steps: int) -> None:
        """Live through so many steps, or until the run is over."""
        is_visible = True
        for step in range(steps):
            opened = control.open.get(run)
            if opened is None:
                return
            if self.pick.random() < 0.03:
                is_visible = not is_visible
            if is_visible and step % 5 == 0:
                control.rights.see(ANN, anyio.current_time())
                self.there.append(anyio.current_time())
            if self.pick.random() < 0.01:
                long = self.pick.choice([0.6, 2.0, 10.0])
                stand_still(long)
                self.stalls.append((anyio.current_time(), long))
            now = opened.run.held
            if now is not None and is_visible and self.pick.random() < 0.1:
                self.there.append(anyio.current_time())
                with suppress(Conflict):
                    await control.go_on(run, GoOnRequest(time(now.at)), author(ANN), ANN)
            await anyio.sleep(0.2)

    def missing_s(self, at: float) -> float:
        """Return for how long nobody had been there at a time, without stalls and what follows each."""
        last = max(each for each in self.there if each <= at)
        return at - last - sum(long + 2.5 for over, long in self.stalls if last < over <= at)


@virtual
async def test_no_action_begins_while_a_page_is_missing_and_none_begins_twice() -> None:
    """Random pages, presses of *go on*, stalls and a restart."""
    counts = Counter[str]()
    for seed in range(HISTORIES):
        chance = Chance(seed)
        lab = Lab({"*": [{"after_s": chance.pick.choice([0.5, 2, 6])}]})
        left: list[float] = []
        lab.david.starts, lab.carol.starts = Starts(left), Starts(left)
        async with lab.runner() as control:
            await rules(control, "David", "Carol")
            chance.there.append(anyio.current_time())
            request = led(shared(sequence("task", 6), "Scout", "Carrier"))
            run = (await control.start(request, author(ANN), ANN)).run.id
            await chance.live(control, run, chance.pick.choice([40, 150]))
        async with lab.runner() as control:
            await chance.live(control, run, 300)
            control.stop_all(author(ANN))
            await until(lambda: not control.open, 60)
        assert [at for at in left if chance.missing_s(at) > RULE.wait_s + 0.5] == [], seed
        sent_as = [each.run for each in (*lab.david.starts, *lab.carol.starts)]
        assert len(set(sent_as)) == len(sent_as), seed
        told = lab.harness.journal.told(run)
        counts["sent"] += len(left)
        counts["held"] += sum(
            isinstance(each, Held) and "visible page" in each.why for each in told
        )
        counts["missing"] += "page_missing" in alarms(lab, run)
        counts[lab.harness.journal.history(run).state] += 1
    assert counts["held"] > 5, counts
