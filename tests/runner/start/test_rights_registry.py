"""Rights of robots where they count: starts, batons that are taken and fall, robots out of service."""

import os
import random
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Final

import anyio
import msgspec
import pytest

from action_assistant.errors import Conflict, Forbidden, NotFound, Refused, Unavailable
from action_assistant.journal.journal import Journal
from action_assistant.kit.clock import utc_us
from action_assistant.runner import projection
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Link
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.rights import BatonPassed, Locked, Operator, RightsEvent, Rules
from action_assistant.runner.robots.robot_events import event_of, stream_of_robot
from action_assistant.runner.runs.events import Author
from action_assistant.runner.start.preflight import Item
from action_assistant.runner.start.rights_registry import GONE_S
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Person, Session
from runner.harness import (
    Harness,
    Robot,
    clock_us,
    engine,
    order,
    run_in_virtual_time,
    sequence,
    until,
    virtual,
)
from runner.registered_robots import NEVER, group

#: Races of the baton in one run of the test.
RACES: Final = int(os.environ.get("TEST_BATON_RACES", "100"))
BATON: Final = Rules(baton=True)
OLGA: Final = Author("olga", "Olga")


def who(name: str, *groups: str) -> Identity:
    session = Session(f"s_{name.lower()}", Person(name.lower(), name, "operator"), 2e9)
    return Identity(session.person, groups=frozenset(groups), session=session)


def author(identity: Identity) -> Author:
    return Author(identity.person.id, identity.person.name)


ANN, BEN, CARL = who("Ann"), who("Ben"), who("Carl")


class Ended:
    """Tells a runner which sessions have ended, by their ids."""

    def __init__(self) -> None:
        self.sessions: set[str] = set()

    def __call__(self, identity: Identity) -> Identity | None:
        """Return the identity; None if its session has ended."""
        session = identity.session
        return None if session is not None and session.id in self.sessions else identity


@asynccontextmanager
async def lab(
    harness: Harness, rules: Rules = BATON, ended: Ended | None = None
) -> AsyncIterator[ExecutionService]:
    """A runner whose robot David has these rules."""
    async with harness.runner(ended or Ended()) as control:
        await control.rights.set_rules("David", rules, OLGA)
        yield control


def david() -> Robot:
    return Robot(engine(NEVER))


async def start(control: ExecutionService, by: Identity, robot: str = "David") -> str:
    started = await control.start(order(sequence(), engine=robot), author(by), by)
    return started.run.id


async def look(control: ExecutionService, by: Identity) -> dict[str, Item]:
    """Return the items of a pre-flight about rights, by code."""
    (found,) = await control.look(group(sequence(), "David"), by.person.id, by)
    return {item.code: item for item in found.items if item.code in {"right", "baton", "service"}}


def events(harness: Harness, robot: str = "David") -> list[RightsEvent]:
    """Return the stored changes of a robot's rights."""
    stored = harness.journal.streams.get(stream_of_robot(robot), [])
    found = (event_of(each) for each in stored)
    return [each for each in found if isinstance(each, RightsEvent)]


@virtual
async def test_a_person_without_the_right_is_refused_in_every_way_that_starts() -> None:
    robot, harness = david(), Harness()
    harness.links = {"David": robot}
    rules = Rules(operators=(Operator("ann", "Ann"), Operator("g1", "Night shift")))
    async with lab(harness, rules) as control:
        items = await look(control, BEN)
        sentence = "You may not start on David: only Ann or Night shift may. Ask Olga."
        assert (items["right"].verdict, items["right"].text) == ("blocked", sentence)
        assert not items["right"].overridable
        with pytest.raises(Forbidden, match="only Ann or Night shift may") as refused:
            await start(control, BEN)
        assert (refused.value.where or {})["item"] == "right"
        with pytest.raises(Refused, match="only Ann or Night shift may"):
            await control.start_group(group(sequence(), "David"), author(BEN), BEN)
        assert robot.starts == []
        assert (await look(control, who("Carl", "g1")))["right"].verdict == "passed"
        run = await start(control, ANN)
        await until(lambda: control.open[run].run.state == "running")
        for command in (
            lambda: control.modify(run, b"{}", author(BEN), BEN),
            lambda: control.resume(run, author(BEN), BEN),
        ):
            with pytest.raises(Forbidden, match="only Ann or Night shift may"):
                await command()
        assert await control.stop(run, author(BEN)) == [run]  # everybody may
        await until(lambda: run not in control.open)


@virtual
async def test_a_person_without_a_new_confirmation_is_refused_in_every_way_that_starts() -> None:
    robot, harness = david(), Harness()
    harness.links = {"David": robot}
    now = clock_us() / 1e6
    new = msgspec.structs.replace(ANN, confirmed_at=now, asked_at=now)
    old = msgspec.structs.replace(ANN, confirmed_at=now - 601, asked_at=now)
    async with lab(harness, Rules(ask_again=10)) as control:
        items = await confirm_item(control, old)
        assert (items.verdict, items.overridable) == ("blocked", False)
        with pytest.raises(Forbidden, match="confirm that it is you") as refused:
            await start(control, old)
        assert (refused.value.where or {})["item"] == "confirm"
        with pytest.raises(Refused, match="confirm that it is you"):
            await control.start_group(group(sequence(), "David"), author(ANN), old)
        assert robot.starts == []
        assert (await confirm_item(control, new)).verdict == "passed"
        run = await start(control, new)
        await until(lambda: control.open[run].run.state == "running")
        for command in (
            lambda: control.modify(run, b"{}", author(ANN), old),
            lambda: control.resume(run, author(ANN), old),
        ):
            with pytest.raises(Forbidden, match="confirm that it is you"):
                await command()
        assert await control.stop(run, author(ANN)) == [run]  # Stop asks nobody
        await until(lambda: run not in control.open)


async def confirm_item(control: ExecutionService, by: Identity) -> Item:
    (found,) = await control.look(group(sequence(), "David"), by.person.id, by)
    return next(item for item in found.items if item.code == "confirm")


@virtual
async def test_a_rule_that_begins_while_a_start_is_stored_keeps_the_start_from_leaving() -> None:
    robot, harness = david(), Harness()
    harness.links = {"David": robot}
    async with lab(harness, Rules()) as control:
        harness.journal.slow = 1.0
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(control.rights.set_rules, "David", Rules(ask_again=10), OLGA)
            with pytest.raises(Refused, match="confirm that it is you"):
                await start(control, ANN)
        assert robot.starts == []


@virtual
async def test_a_robot_without_rules_has_no_items_about_rights() -> None:
    harness = Harness({"David": david()})
    async with harness.runner() as control:
        assert await look(control, BEN) == {}
        assert events(harness) == []


@virtual
async def test_only_the_holder_of_the_baton_starts() -> None:
    robot = david()
    harness = Harness({"David": robot})
    async with lab(harness) as control:
        assert "take it first" in (await look(control, ANN))["baton"].text
        with pytest.raises(Conflict, match="Nobody holds the baton of David") as refused:
            await start(control, ANN)
        assert (refused.value.where or {})["item"] == "baton"
        await control.rights.take("David", ANN, author(ANN))
        assert (await look(control, ANN))["baton"].text == "You hold the baton of David."
        with pytest.raises(Conflict, match=r"Ann has its baton\. Ask Ann to hand it over"):
            await start(control, BEN)
        with pytest.raises(Conflict, match="Ann has the baton"):
            await control.rights.take("David", BEN, author(BEN))
        assert robot.starts == []
        run = await start(control, ANN)
        assert control.open[run].run.batons == ("David",)
        await control.rights.take("David", BEN, author(BEN), "Ann is at lunch.")
        assert control.open[run].run.end is None  # what runs is not stopped by it
        assert control.stop_robot("David", author(CARL))[0] == [run]
        await until(lambda: run not in control.open)
        assert (await control.find(run)).batons == ("David",)
    kinds = [each.how for each in events(harness) if isinstance(each, BatonPassed)]
    assert kinds == ["taken", "forced"]


@virtual
async def test_the_right_is_looked_at_in_the_step_in_which_the_start_leaves() -> None:
    """The baton goes while the start is being stored, and the message does not leave."""
    robot = david()
    harness = Harness({"David": robot})
    async with lab(harness) as control:
        await control.rights.take("David", ANN, author(ANN))
        harness.journal.slow = 0.5
        async with anyio.create_task_group() as tasks:
            found: list[str] = []

            async def begin() -> None:
                found.append(await start(control, ANN))

            tasks.start_soon(begin)
            await anyio.sleep(0.3)
            tasks.start_soon(control.rights.drop, "David", ANN, author(ANN))
        harness.journal.slow = 0.0
        assert robot.starts == []
        run = await control.find(found[0])
        assert run.end == "refused"
        assert "Nobody holds the baton of David" in run.detail


@virtual
async def test_a_baton_counts_once_it_is_stored_and_one_that_is_dropped_at_once() -> None:
    robot = david()
    harness = Harness({"David": robot})
    async with lab(harness) as control:
        harness.journal.slow = 0.5
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(control.rights.take, "David", ANN, author(ANN))
            await anyio.sleep(0.25)
            assert control.robot_view("David").holder is None
            with pytest.raises(Conflict, match="just changing, and that is not stored yet"):
                await start(control, ANN)
            with pytest.raises(Conflict, match="Ann has the baton"):
                await control.rights.take("David", BEN, author(BEN))
        assert control.robot_view("David").holder is not None
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(control.rights.drop, "David", ANN, author(ANN))
            await anyio.sleep(0.25)
            with pytest.raises(Conflict, match="Nobody holds the baton"):
                await start(control, ANN)
        assert robot.starts == []


@virtual
async def test_a_baton_falls_half_an_hour_after_the_last_page_of_its_holder_was_closed() -> None:
    harness = Harness({"David": david()})
    async with lab(harness) as control:
        await control.rights.take("David", ANN, author(ANN))
        with control.rights.here(ANN):
            await anyio.sleep(2 * GONE_S)
            assert control.rights.holder("David") is not None
            shown = control.robot_view("David").holder
            assert shown is not None
            assert shown.here
            with control.rights.here(ANN):  # a second page
                pass
            shown = control.robot_view("David").holder
            assert shown is not None
            assert shown.here
        await anyio.sleep(GONE_S - 5)
        with control.rights.here(ANN):  # back for a moment
            pass
        await anyio.sleep(GONE_S - 5)
        assert control.rights.holder("David") is not None
        await anyio.sleep(10)
        assert control.rights.holder("David") is None
        fell = events(harness)[-1]
        assert isinstance(fell, BatonPassed)
        assert (fell.how, fell.reason) == ("fell", "No page of Ann was open for 30 minutes.")
        await control.rights.take("David", BEN, author(BEN))  # without a reason


@virtual
async def test_a_baton_falls_when_the_session_of_its_holder_is_ended() -> None:
    harness, ended = Harness({"David": david()}), Ended()
    async with lab(harness, ended=ended) as control:
        await control.rights.take("David", ANN, author(ANN))
        phone = msgspec.structs.replace(ANN, session=msgspec.structs.replace(ANN.session, id="p"))
        with control.rights.here(phone):
            ended.sessions.add("s_ann")
            await anyio.sleep(5)
            assert control.rights.holder("David") is not None  # another page of hers is open
            ended.sessions.add("p")
            await anyio.sleep(2)
        assert control.rights.holder("David") is None
        assert "was ended" in getattr(events(harness)[-1], "reason", "")
        with pytest.raises(Forbidden, match="not signed in any more"):
            await start(control, ANN)


@virtual
async def test_a_baton_survives_a_restart_of_the_runner_and_its_time_counts_anew() -> None:
    harness = Harness({"David": david()})
    async with lab(harness) as control:
        await control.rights.take("David", ANN, author(ANN))
        await anyio.sleep(GONE_S - 60)
    async with harness.runner() as control:
        assert control.rights.holder("David") is not None
        with pytest.raises(Conflict, match="Ann has its baton"):
            await start(control, BEN)
        await anyio.sleep(GONE_S - 60)
        assert control.rights.holder("David") is not None
        await anyio.sleep(120)
        assert control.rights.holder("David") is None
    async with harness.runner() as control:
        assert control.rights.holder("David") is None


@virtual
async def test_nobody_holds_a_baton_of_which_it_could_not_be_stored_who_has_it() -> None:
    harness = Harness({"David": david()})
    async with lab(harness) as control:
        await control.rights.take("David", ANN, author(ANN))
        harness.journal.down = True
        with pytest.raises(Unavailable):
            await control.rights.take("David", BEN, author(BEN), "Ann is away.")
        assert control.rights.of("David").holder is None
        harness.journal.down = False
        await anyio.sleep(5)
        for each in (ANN, BEN):
            with pytest.raises(Conflict, match="Nobody holds the baton"):
                await start(control, each)
        await control.rights.take("David", BEN, author(BEN))
    async with harness.runner() as control:
        decided = control.rights.of("David").holder
        assert decided is not None
        assert decided.person.id == "ben"


@virtual
async def test_rights_that_cannot_be_read_let_nobody_start() -> None:
    harness = Harness({"David": david()})
    async with lab(harness) as control:
        await control.rights.take("David", ANN, author(ANN))

    class Row:
        name = "David"
        rules, set_by, holder, locks, drills = {"baton": "?"}, None, None, (), ()

    async with harness.runner() as control:
        row: Any = Row()
        control.rights.take_up([row])
        with pytest.raises(Conflict, match="cannot be read"):
            await start(control, ANN)
        await control.rights.set_rules("David", Rules(), OLGA)
        run = await start(control, ANN)
        control.stop_all(author(ANN))
        await until(lambda: run not in control.open)


@virtual
async def test_a_baton_is_handed_to_somebody_who_has_a_page_open() -> None:
    harness = Harness({"David": david()})
    async with lab(harness) as control:
        await control.rights.take("David", ANN, author(ANN))
        with pytest.raises(Conflict, match="no page open"):
            await control.rights.hand("David", "ben", ANN, author(ANN))
        with control.rights.here(BEN):
            assert [each.person.id for each in control.rights.people_here()] == ["ben"]
            await control.rights.hand("David", "ben", ANN, author(ANN))
            holder = control.rights.holder("David")
            assert holder is not None
            assert holder.person.name == "Ben"
            with pytest.raises(Conflict, match="not you"):
                await control.rights.hand("David", "ben", ANN, author(ANN))


@virtual
async def test_a_robot_out_of_service_takes_no_start_and_its_run_can_be_stopped() -> None:
    robot = david()
    harness = Harness({"David": robot})
    async with lab(harness, Rules()) as control:
        run = await start(control, ANN)
        await until(lambda: control.open[run].run.state == "running")
        await control.rights.lock("David", CARL, author(CARL), "It leaks oil.")
        assert control.open[run].run.state == "running"  # it is not stopped by this
        (lock,) = control.robot_view("David").locks
        assert (lock.by.name, lock.reason) == ("Carl", "It leaks oil.")
        for command in (
            lambda: control.resume(run, author(ANN), ANN),
            lambda: control.modify(run, b"{}", author(ANN), ANN),
        ):
            with pytest.raises(Conflict, match=r"David is out of service\. Carl: “It leaks oil”"):
                await command()
        assert await control.stop(run, author(BEN)) == [run]
        await until(lambda: run not in control.open)
        assert (await look(control, ANN))["service"].verdict == "blocked"
        with pytest.raises(Conflict, match="out of service"):
            await start(control, ANN)
        with pytest.raises(Forbidden):
            await control.rights.unlock("David", ANN, author(ANN))
    async with harness.runner() as control:
        with pytest.raises(Conflict, match="out of service"):
            await start(control, ANN)
        await control.rights.unlock("David", CARL, author(CARL))
        run = await start(control, ANN)
        control.stop_all(author(ANN))
        await until(lambda: run not in control.open)
    assert len(robot.starts) == 2


@virtual
async def test_a_lock_counts_while_the_journal_stores_nothing() -> None:
    harness = Harness({"David": david()})
    async with lab(harness, Rules()) as control:
        harness.journal.down = True
        with pytest.raises(Unavailable):
            await control.rights.lock("David", CARL, author(CARL), "It leaks oil.")
        harness.journal.down = False
        with pytest.raises(Conflict, match="out of service"):
            await start(control, ANN)
        await anyio.sleep(5)
    assert isinstance(events(harness)[-1], Locked)


@virtual
async def test_rights_of_a_robot_that_was_forgotten_are_those_of_its_next_registration() -> None:
    harness = Harness({"David": david()})
    async with lab(harness) as control:
        registered = control.robots.registration("David")
        await control.remove("David", OLGA)
        with pytest.raises(NotFound):
            await control.rights.take("David", ANN, author(ANN))
        await control.register(registered, author(BEN))
        with pytest.raises(Conflict, match="Nobody holds the baton"):
            await start(control, BEN)


# --- races ------------------------------------------------------------------------------------

Racer = Callable[[], Coroutine[Any, Any, None]]


class Race:
    """People who want the baton of David at once. `won`: those who were told that they have it."""

    def __init__(self, control: ExecutionService, chance: random.Random) -> None:
        self.control = control
        self.chance = chance
        self.won: list[str] = []

    async def try_it(self, person: str, command: Racer) -> None:
        """Carry out a command of a person after a moment, and note if it succeeded."""
        await anyio.sleep(self.chance.choice((0, 0, 0, 0.001)))
        try:
            await command()
        except (Conflict, Forbidden):
            return
        self.won.append(person)

    async def run(self, *racers: tuple[str, Racer]) -> None:
        """Let all of them go at once."""
        order = list(racers)
        self.chance.shuffle(order)
        async with anyio.create_task_group() as tasks:
            for person, command in order:
                tasks.start_soon(self.try_it, person, command)

    def take(self, person: Identity, reason: str = "") -> tuple[str, Racer]:
        rights = self.control.rights
        return person.person.id, lambda: rights.take("David", person, author(person), reason)

    def hand(self, giver: Identity, to: Identity) -> tuple[str, Racer]:
        rights = self.control.rights
        return to.person.id, lambda: rights.hand("David", to.person.id, giver, author(giver))

    def drop(self, person: Identity) -> tuple[str, Racer]:
        return "", lambda: self.control.rights.drop("David", person, author(person))

    async def free(self) -> None:
        """Let nobody hold the baton."""
        holder = self.control.rights.of("David").holder
        if holder is not None:
            await self.control.rights.drop("David", self.named(holder.person.id), OLGA)
        self.won.clear()

    def named(self, person: str) -> Identity:
        return next(each for each in (ANN, BEN, CARL) if each.person.id == person)

    def able(self) -> list[str]:
        """Return who may start on David now."""
        rights = self.control.rights
        people = (each for each in (ANN, BEN, CARL) if not rights.refusals("David", each))
        return [each.person.id for each in people]


def check_chain(found: list[RightsEvent]) -> None:
    """Check that each change of the baton was decided on the one before."""
    holder = None
    for each in found:
        if isinstance(each, BatonPassed):
            assert each.was == holder, f"{each} was decided on another holder than {holder}"
            holder = each.holder


async def one_race(race: Race, kind: int) -> None:
    """Live through one race from a free baton, and check that it has one winner at most."""
    rights = race.control.rights
    await race.free()
    if kind == 0:  # taken by three at once
        await race.run(race.take(ANN), race.take(BEN), race.take(CARL))
        assert len(race.won) == 1
    else:
        await rights.take("David", ANN, author(ANN))
        racers = {
            1: (race.hand(ANN, BEN), race.hand(ANN, CARL), race.drop(ANN)),
            2: (race.hand(ANN, BEN), race.take(CARL, "I need it.")),
            3: (race.drop(ANN), race.take(BEN), race.take(CARL)),
        }[kind]
        await race.run(*racers)
    holder = rights.holder("David")
    assert race.able() == ([] if holder is None else [holder.person.id])
    if kind == 1:  # one thing becomes of Ann's baton
        assert len(race.won) == 1
    if kind == 2:
        assert holder is not None
        assert holder.person.id in race.won
        if len(race.won) == 2:  # handed first, then taken over: in this order only
            assert holder.person.id == "carl"


def test_of_people_who_race_for_a_baton_one_has_it() -> None:
    async def main() -> None:
        chance, harness = random.Random(11), Harness({"David": david()})
        async with lab(harness) as control:
            with control.rights.here(BEN), control.rights.here(CARL):
                race = Race(control, chance)
                for number in range(RACES):
                    harness.journal.slow = chance.choice((0.0, 0.001, 0.01))
                    await one_race(race, number % 4)
            harness.journal.slow = 0.0
        check_chain(events(harness))

    run_in_virtual_time(main)


def test_a_baton_that_falls_while_people_take_it_has_one_holder() -> None:
    async def main() -> None:
        chance, harness, ended = random.Random(12), Harness({"David": david()}), Ended()
        async with lab(harness, ended=ended) as control:
            with control.rights.here(BEN), control.rights.here(CARL):
                race = Race(control, chance)
                for _ in range(RACES):
                    harness.journal.slow = chance.choice((0.0, 0.001, 0.01))
                    ended.sessions.clear()
                    await race.free()
                    await control.rights.take("David", ANN, author(ANN))
                    await anyio.sleep(chance.random())
                    ended.sessions.add("s_ann")  # noticed within a second
                    await anyio.sleep(chance.choice((0.0, chance.random())))
                    racers = [race.take(BEN), race.take(CARL), race.take(BEN, "She has left.")]
                    await race.run(*racers)
                    await anyio.sleep(1.1)
                    holder = control.rights.holder("David")
                    assert race.able() == ([] if holder is None else [holder.person.id])
                    assert holder is None or holder.person.id != "ann"
                    assert (holder is None) == (race.won == [])
            harness.journal.slow = 0.0
        check_chain(events(harness))

    run_in_virtual_time(main)


def test_a_restart_in_the_middle_of_a_race_leaves_one_holder_or_none() -> None:
    async def main() -> None:
        chance, harness = random.Random(13), Harness({"David": david()})
        harness.journal.streams.clear()
        async with lab(harness):
            pass
        for _ in range(RACES):
            won: list[str] = []
            async with harness.runner() as control:
                race = Race(control, chance)
                await race.free()
                harness.journal.slow = chance.choice((0.0, 0.01, 0.05))
                with anyio.move_on_after(chance.random() * 0.1):
                    await race.run(race.take(ANN), race.take(BEN), race.take(CARL))
                won = list(race.won)
            harness.journal.slow = 0.0
            async with harness.runner() as control:
                holder = control.rights.holder("David")
                race = Race(control, chance)
                assert race.able() == ([] if holder is None else [holder.person.id])
                if won:  # who was told so has it also after the restart
                    assert holder is not None
                    assert won == [holder.person.id]
        check_chain(events(harness))

    run_in_virtual_time(main)


@pytest.mark.anyio
async def test_races_with_the_real_journal_have_one_winner_too(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'runner.db'}"
    Journal.prepare(url, "runner")
    journal = await Journal.open(url, branch="runner", fold=projection.fold)
    chance, links = random.Random(14), dict[str, Link](David=Robot(engine(NEVER)))

    @asynccontextmanager
    async def real() -> AsyncIterator[ExecutionService]:
        async with ExecutionService.opened(journal, Robots(links), clock_us=utc_us) as control:
            yield control

    try:
        async with real() as control:
            await control.rights.set_rules("David", BATON, OLGA)
            with control.rights.here(BEN), control.rights.here(CARL):
                race = Race(control, chance)
                for number in range(max(20, RACES // 10)):
                    await one_race(race, number % 4)
            holder = control.rights.holder("David")
        async with real() as control:
            assert control.rights.holder("David") == holder
        stored = await journal.read(stream_of_robot("David"))
        found = [event_of(each) for each in stored]
        check_chain([each for each in found if isinstance(each, RightsEvent)])
    finally:
        await journal.close()
