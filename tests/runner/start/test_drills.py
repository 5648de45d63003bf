"""Stop drills, released versions, and the rules of owners that nothing starts against."""

import os
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.errors import BadInput, Conflict, Refused, Unavailable
from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.execution.start_checks import StartSources
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.rights import Drilled, RobotRights, Rules
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest, read_group
from action_assistant.runner.start.drills import DrillRequest, drill_of
from action_assistant.runner.start.rights_registry import ReleaseOf
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.auth.released_versions import Release, ReleasedVersions
from runner.execution.test_conductor import Lab, led, shared
from runner.execution.test_led_rights import SLOW, held
from runner.harness import (
    Harness,
    at_once,
    clock_us,
    ended,
    order,
    run_in_virtual_time,
    sequence,
    until,
    virtual,
)
from runner.registered_robots import group
from runner.start.test_rights_registry import ANN, BEN, OLGA, author, david, lab
from runner.start.test_start_rules import item
from support.doses import examples

DAY_US: Final = 86_400_000_000
NOW: Final = 1_900_000_000_000_000
WEEKLY: Final = Rules(drill_days=7)
SAW_IT: Final = {"saw_it_stop": True, "hardware_stop": True}


def drilled(at: int, **changes: Any) -> Drilled:
    """Return a drill that passed, at this moment."""
    fields: dict[str, Any] = {"run": f"r{at}", "number": 1, "stopped_at": at, "proof_us": 500_000}
    return Drilled(at=at, author=OLGA, **(fields | SAW_IT | changes))


def due(*drills: Drilled) -> str:
    return RobotRights(name="David", rules=WEEKLY, drills=drills).drill_due(NOW / 1e6)


def test_the_last_passed_drill_counts_for_so_many_days_and_no_failed_one_after_it() -> None:
    assert "No Stop drill of David has been made" in due()
    assert due(drilled(NOW - 7 * DAY_US)) == ""
    assert "asks for one within 7 days" in due(drilled(NOW - 7 * DAY_US - 1))
    assert due(drilled(NOW - 8 * DAY_US), drilled(NOW - DAY_US)) == ""
    for failed, why in (
        ({"proof_us": None}, "its Stop was not proven"),
        ({"saw_it_stop": False}, "the robot was not seen to stop"),
        ({"hardware_stop": False}, "the hardware stop was not tried"),
    ):
        assert f"failed: {why}" in due(drilled(NOW - DAY_US), drilled(NOW - 5, **failed))
        assert due(drilled(NOW - DAY_US, **failed), drilled(NOW - 5)) == ""
    assert RobotRights(name="David").drill_due(NOW / 1e6) == ""  # nobody asks for one


def test_a_drill_that_is_dated_in_the_future_proves_nothing() -> None:
    """The clock was ahead while it was recorded."""
    ahead = drilled(NOW + 1)
    assert "No Stop drill of David has been made" in due(ahead)
    assert "was on" in due(drilled(NOW - 8 * DAY_US), ahead)
    assert due(drilled(NOW - DAY_US), ahead) == ""
    assert "failed" in due(drilled(NOW - DAY_US), drilled(NOW + 1, saw_it_stop=False))


async def moving(control: ExecutionService, **fields: object) -> str:
    """Start a run of Ann's on David, and wait until it moves."""
    asked = order(sequence(), engine="David", **fields)
    run = (await control.start(asked, author(ANN), ANN)).run.id
    await until(lambda: bool(control.open[run].run.active))
    return run


async def record(control: ExecutionService, run: str, **words: bool) -> Drilled:
    await control.record_drill("David", DrillRequest(run, **(SAW_IT | words)), author(BEN))
    return control.rights.of("David").drills[-1]


@virtual
async def test_a_drill_takes_its_time_to_proof_from_the_run_and_outlives_the_runner() -> None:
    robot = david()
    harness = Harness({"David": robot})
    async with lab(harness, WEEKLY) as control:
        assert (await item(control, "drill"))[0] == "blocked"
        with pytest.raises(Conflict, match="No Stop drill of David has been made") as refused:
            await control.start(order(sequence(), engine="David"), author(ANN), ANN)
        assert (refused.value.where or {})["item"] == "drill"
        verdict, text = await item(control, "drill", drill=True)
        assert (verdict, "press Stop while it moves" in text) == ("warned", True)
        assert robot.starts == []
        run = await moving(control, drill=True)
        with pytest.raises(Conflict, match="Nobody has pressed Stop"):
            await record(control, run)
        await control.stop(run, author(BEN))
        await until(lambda: run not in control.open)
        found = await control.find(run)
        told = await record(control, run)
        assert (told.author, told.failure, told.run) == (author(BEN), "", run)
        assert found.proof_at is not None
        assert found.stop_requested_at is not None
        assert told.proof_us == found.proof_at - found.stop_requested_at > 0
        for words in ({}, {"saw_it_stop": True}):
            with pytest.raises(Conflict, match="recorded already"):
                await record(control, run, **words)
        assert (await item(control, "drill"))[0] == "passed"
        shown = control.robot_view("David")
        assert (shown.drill_due, shown.drills[0].number) == ("", found.number)
    async with harness.runner() as control:
        assert control.rights.of("David").drills == (told,)
        run = await moving(control)
        assert not control.open[run].run.drill
        await control.stop(run, author(BEN))
        await until(lambda: run not in control.open)
        assert (await record(control, run, saw_it_stop=False)).failure != ""
        assert len(control.robot_view("David").drills) == 2
        with pytest.raises(Conflict, match="was not seen to stop"):
            await control.start(order(sequence(), engine="David"), author(ANN), ANN)


@virtual
async def test_the_run_of_a_drill_is_changed_like_another_one() -> None:
    """The change needs no earlier drill; a run that was started with one needs that it still counts."""
    robot = david()
    robot.pauses = True
    async with lab(Harness({"David": robot}), WEEKLY) as control:
        changed = order(sequence(actions=4))
        body = {"version": "v2", "digest": changed.digest, "umrf": changed.umrf}
        run = await moving(control, drill=True)
        await control.modify(run, msgspec.json.encode(body), author(ANN), ANN)
        assert control.open[run].run.version == "v2"
        await control.stop(run, author(BEN))
        await until(lambda: run not in control.open)
        assert (await record(control, run)).failure == ""
        later = await moving(control)
        await control.rights.set_rules("David", Rules(drill_days=0), author(BEN))
        with pytest.raises(Conflict, match="asks for one within 0 days"):
            await control.modify(later, msgspec.json.encode(body), author(ANN), ANN)
        await control.stop(later, author(BEN))
        await until(lambda: later not in control.open)


@virtual
async def test_a_stop_that_is_not_proven_makes_a_failed_drill() -> None:
    robot = david()
    harness = Harness({"David": robot})
    async with lab(harness, WEEKLY) as control:
        run = await moving(control, drill=True)
        robot.silent = True
        await control.stop(run, author(BEN))
        with pytest.raises(Conflict, match="may still be proven"):
            await record(control, run)
        await until(lambda: clock_us() > control.open[run].run.stop_requested_at + 11_000_000)
        told = await record(control, run)
        assert (told.proof_us, told.failure) == (None, "its Stop was not proven")
        await control.confirm_rest(run, RestRequest("I looked at it."), author(BEN))
        with pytest.raises(Conflict, match="recorded already"):  # nor made good by a word
            await record(control, run)
        robot.silent = False
        await until(lambda: run not in control.open)
        with pytest.raises(Conflict, match="its Stop was not proven"):
            await control.start(order(sequence(), engine="David"), author(ANN), ANN)


def stopped(**changes: Any) -> Run:
    """Return a run on David whose Stop was proven within half a second."""
    return msgspec.convert(
        {
            "id": "r1", "number": 1, "request_id": "q", "author": {"id": "a", "name": "A"},
            "graph": None, "graph_name": "g", "version": "v", "digest": "d", "engine": "David",
            "simulated": False, "requested_at": NOW - 90, "desired": "stopped", "end": "stopped",
            "stop_requested_at": NOW - 60_000_000, "proof_at": NOW - 59_500_000,
            "interventions": [{
                "kind": "stop", "at": NOW - 60_000_000, "by": {"id": "a", "name": "A"},
                "state": "running", "active": ["Work_0"],
            }],
        } | changes,
        Run,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"engine": "Carol"}, "was not on David alone"),
        ({"simulated": True}, "was not on David alone"),
        ({"piece": {"run": "r", "call": 1, "node": "n"}}, "was not on David alone"),
        ({"led": {"robots": {}, "players": {}}}, "was not on David alone"),
        ({"stop_requested_at": None}, "Nobody has pressed Stop"),
        ({"stop_requested_at": NOW - DAY_US - 1}, "older than a day"),
        ({"stop_requested_at": NOW + 1}, "clock has jumped"),
        ({"proof_at": NOW - 61_000_000}, "clock has jumped"),
        ({"end": "finished"}, "came to its end by itself"),
        ({"interventions": []}, "Nothing was seen moving"),
        ({"end": None, "proof_at": None, "stop_requested_at": NOW - 9_000_000}, "may still be"),
    ],
)
def test_a_run_that_shows_nothing_about_a_stop_there_is_no_drill(
    changes: dict[str, Any], why: str
) -> None:
    asked = DrillRequest("r1", **SAW_IT)
    assert drill_of(stopped(), "David", asked, OLGA, NOW).proof_us == 500_000
    with pytest.raises(Conflict, match=why):
        drill_of(stopped(**changes), "David", asked, OLGA, NOW)


def test_a_drill_is_made_on_one_robot() -> None:
    body = msgspec.json.encode(
        {"umrf": {}, "engines": ["David", "Carol"], "drill": True}  # several
    )
    with pytest.raises(BadInput, match="one robot at a time"):
        read_group(body)


@virtual
async def test_neither_the_simulator_nor_a_led_run_is_a_drill() -> None:
    lab_ = Lab()
    async with lab_.runner() as control:
        for asked in (
            order(sequence(), drill=True),
            led(shared(sequence(), "Scout", "Carrier"), drill=True),
        ):
            with pytest.raises(BadInput, match="A Stop drill is made"):
                await control.start(asked, author(ANN), ANN)


# --- released versions --------------------------------------------------------------------------


def release(digest: str, version: str = "v1") -> Release:
    by = PersonRef("olga", "Olga")
    return Release(version=version, digest=digest, by=by, at=datetime(2026, 11, 28, tzinfo=UTC))


def test_files_release_exactly_what_they_name(tmp_path: Path) -> None:
    released, one, other = ReleasedVersions(tmp_path), release("a" * 64), release("b" * 64, "v2")
    assert released.of(one.digest) is None
    released.add(one)
    released.add(one)
    released.add(release("a" * 64, "v3"))
    assert ReleasedVersions(tmp_path).of(one.digest) is not None
    assert released.of(other.digest) is None
    released.remove("v1")
    assert released.of(one.digest) == release("a" * 64, "v3")  # another version of the same graph
    released.make_equal([other])
    assert (released.of(one.digest), released.of(other.digest)) == (None, other)
    (file,) = (tmp_path / "released").iterdir()
    assert file.stat().st_mode & 0o077 == 0
    file.write_bytes(b"{}")
    assert released.of(other.digest) is None  # damaged: it releases nothing
    file.write_bytes(msgspec.json.encode(one))
    assert released.of(one.digest) is released.of(other.digest) is None  # under a wrong name
    for digest, version in (("../" + "a" * 61, "v"), ("a" * 64, "../v"), ("A" * 64, "v")):
        with pytest.raises(BadInput):
            released.add(release(digest, version))


class Published:
    """The released graphs of a test, by digest. `down`: they cannot be read."""

    def __init__(self, *digests: str) -> None:
        self.digests = set(digests)
        self.down = False

    def __call__(self, digest: str) -> Release | None:
        """Return a release of this graph. Raise Unavailable while they cannot be read."""
        if self.down:
            raise Unavailable("Which versions are released cannot be read now: no disk.")
        return release(digest) if digest in self.digests else None


@pytest.fixture
def releasing(monkeypatch: pytest.MonkeyPatch) -> Published:
    """Let all runners of a test take these releases."""
    published = Published()
    monkeypatch.setattr("runner.harness.NO_SOURCES", StartSources(release_of=published))
    return published


def test_releases_are_listed_once_and_a_withdrawn_one_never_counts_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lists = 0
    scandir = os.scandir

    def listed(path: Path) -> Any:
        nonlocal lists
        lists += 1
        return scandir(path)

    monkeypatch.setattr(os, "scandir", listed)
    ours, editors = ReleasedVersions(tmp_path), ReleasedVersions(tmp_path)
    digests = [f"{number:064x}" for number in range(3)]
    assert ours.of(digests[0]) is None
    for digest in digests[:2]:
        editors.add(msgspec.structs.replace(release(digest), version=f"v{digest[-1]}"))
    assert ours.of(digests[0]) is not None
    os.utime(tmp_path / "released", (1_000, 1_000))  # it has not changed for long
    assert ours.of(digests[1]) is not None
    before = lists
    assert [ours.of(each) is not None for each in digests] == [True, True, False]
    assert lists == before
    (tmp_path / "released" / f"{digests[0]}-v0.json").unlink()
    os.utime(tmp_path / "released", (1_000, 1_000))  # as if nobody had seen the folder change
    assert [ours.of(each) is not None for each in digests] == [False, True, False]
    editors.add(msgspec.structs.replace(release(digests[2]), version="v2"))
    assert ours.of(digests[2]) is not None


RELEASED: Final = Rules(released_only=True)


@virtual
async def test_only_what_an_owner_released_starts_and_unread_releases_start_nothing(
    releasing: Published,
) -> None:
    robot = david()
    harness = Harness({"David": robot})
    async with lab(harness, RELEASED) as control:
        asked = order(sequence(), engine="David")
        sentence = "David takes only versions that an owner has released, and this is none of them."
        assert await item(control, "released") == ("blocked", sentence)
        with pytest.raises(Conflict, match="and this is none of them"):
            await control.start(asked, author(ANN), ANN)
        releasing.digests.add(asked.digest)
        releasing.down = True
        with pytest.raises(Conflict, match="cannot be read now: no disk"):
            await control.start(asked, author(ANN), ANN)
        releasing.down = False
        assert await item(control, "released") == (
            "passed",
            "This version was released by Olga.",
        )
        other = order(sequence("other"), engine="David")
        with pytest.raises(Conflict, match="and this is none of them"):
            await control.start(other, author(ANN), ANN)
        assert robot.starts == []
        robot.pauses = True
        run = (await control.start(asked, author(ANN), ANN)).run.id
        await until(lambda: control.open[run].run.state == "running")
        changed = order(sequence(actions=4))
        body = {"version": "v2", "digest": changed.digest, "umrf": changed.umrf}
        with pytest.raises(Conflict, match="and this is none of them"):
            await control.modify(run, msgspec.json.encode(body), author(ANN), ANN)
        await control.pause(run, author(ANN))
        await until(lambda: control.open[run].run.state == "paused")
        releasing.digests.clear()
        with pytest.raises(Conflict, match="and this is none of them"):
            await control.resume(run, author(ANN), ANN)
        releasing.digests.add(asked.digest)
        await control.resume(run, author(ANN), ANN)
        await control.stop(run, author(BEN))
        await until(lambda: run not in control.open)


@virtual
async def test_a_led_run_is_released_as_a_whole_and_held_when_that_is_withdrawn(
    releasing: Published,
) -> None:
    lab_ = Lab(SLOW)
    async with lab_.runner() as control:
        await control.rights.set_rules("Carol", RELEASED, OLGA)
        request = led(shared(sequence("task", 4), "Scout", "Carrier"))
        with pytest.raises(Refused, match="Carol takes only versions"):
            await control.start(request, author(ANN), ANN)
        releasing.digests.add(request.digest)
        run = (await control.start(request, author(ANN), ANN)).run.id
        await until(lambda: len(lab_.carol.starts) == 1)
        releasing.digests.clear()
        await until(lambda: held(control, run) != "")
        assert "Carol takes only versions that an owner has released" in held(control, run)
        found = control.open[run].run
        assert (len(lab_.carol.starts), found.desired) == (1, "running")
        asked = GoOnRequest(time(found.held.at))
        with pytest.raises(Conflict, match="and this is none of them"):
            await control.go_on(run, asked, author(BEN), BEN)
        releasing.digests.add(request.digest)
        await control.go_on(run, asked, author(BEN), BEN)
        assert await ended(control, run) == "finished"


# --- rules x starts -----------------------------------------------------------------------------


class Case(msgspec.Struct, frozen=True):
    """Rules of a robot, what is true of it, and what a start says."""

    rules: Rules
    drill_age: int | None  # days; below 0 in the future
    is_failed: bool
    is_released: bool
    watching: bool
    is_drill: bool
    way: str

    @property
    def may_start(self) -> bool:
        """Return whether the rules allow the start, decided apart from the product."""
        rules, age = self.rules, self.drill_age
        if rules.watched and not self.watching:
            return False
        if rules.released_only and not self.is_released:
            return False
        if rules.drill_days is None or self.is_drill:
            return True
        return age is not None and not self.is_failed and 0 <= age < rules.drill_days


CASES = st.builds(
    Case,
    rules=st.builds(
        Rules,
        watched=st.booleans(),
        drill_days=st.none() | st.integers(1, 5),
        released_only=st.booleans(),
    ),
    drill_age=st.none() | st.integers(-2, 8),
    is_failed=st.booleans(),
    is_released=st.booleans(),
    watching=st.booleans(),
    is_drill=st.booleans(),
    way=st.sampled_from(["alone", "group", "ruled late"]),
)


async def begin(case: Case) -> tuple[int, int, str]:
    """Try to start; return how many starts the robot got, how many Stops were heard of it, and why
    nothing started."""
    robot, asked, rules = david(), order(sequence(), engine="David"), case.rules
    harness = Harness({"David": robot})
    published = Published(*([asked.digest] if case.is_released else []))
    release_of: ReleaseOf = published
    async with ExecutionService.opened(
        harness.journal,
        Robots(harness.links),
        clock_us=clock_us,
        run_in_worker=at_once,
        sources=StartSources(release_of=release_of),
    ) as control:
        if case.drill_age is not None:
            at = clock_us() - case.drill_age * DAY_US - 1
            await control.rights.record_drill("David", drilled(at, saw_it_stop=not case.is_failed))
        more = {"watching": {"David": case.watching}, "drill": case.is_drill}
        await control.rights.set_rules(
            "David", Rules() if case.way == "ruled late" else rules, OLGA
        )
        why = ""
        if case.way == "ruled late":  # while the start is being stored
            append = harness.journal.append

            async def appended(stream: str, *args: Any, **fields: Any) -> int:
                if stream.startswith("run/") and control.rights.of("David").rules == Rules():
                    await control.rights.set_rules("David", rules, OLGA)
                return await append(stream, *args, **fields)

            harness.journal.append = appended
        try:
            if case.way == "group":
                many = group(sequence(), "David", **more)
                run = (await control.start_group(many, author(ANN), ANN)).runs[0].id
            else:
                one = msgspec.structs.replace(asked, **more)
                run = (await control.start(one, author(ANN), ANN)).run.id
        except Refused as refused:
            why = refused.detail
        else:
            opened = control.open.get(run)
            why = "" if opened is None else opened.run.detail
            await control.stop(run, author(BEN))  # whatever the rules are
            await until(lambda: run not in control.open)
        return len(robot.starts), len(robot.stops), why


@settings(max_examples=examples(150), deadline=None)
@given(CASES)
def test_nothing_starts_against_a_rule_and_everything_else_does(case: Case) -> None:
    starts, stops, why = run_in_virtual_time(lambda: begin(case))
    assert starts == (1 if case.may_start else 0), why
    assert stops >= starts
