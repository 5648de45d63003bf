"""A real engine is killed, frozen or started anew in the middle of a led run: the run ends as its starter
has chosen, the other robots are proven at rest, nothing is called ended that moves, and nothing begins
after the gate has closed. The code of the actions writes down what it does.

Needs ENGINE_LAB, the folder of a built engine, and UMRF_SHARED, which has the program that starts it.
`TEST_LED_FAULTS` is how often each fault is tried with each choice (default 1), from the seed
`TEST_LED_FROM` on; `TEST_LED_DOMAIN` the first domain. Figures are printed with `-s`.
"""

import os
import random
import sys
from collections import Counter
from contextlib import suppress
from pathlib import Path

import anyio
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.errors import Refused
from action_assistant.runner.execution.interventions import RestRequest, confirm_rest
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.runs.events import (
    Ended,
    Held,
    PieceBegan,
    PieceEnded,
    Published,
    Released,
    StopRequested,
)
from action_assistant.runner.runs.views import time as as_text
from action_assistant.runner.start.admission import GoOnRequest
from ros.led_engines import ACCEPTED, LATE_S, Engines, Line, as_led, over, watch
from ros.led_runner import clock_us, is_over
from runner.harness import ANN, BEN, MemoryJournal, until
from support.real_engine import needs_engine

FAULTS = int(os.environ.get("TEST_LED_FAULTS", "1"))
FROM = int(os.environ.get("TEST_LED_FROM", "0"))
DOMAIN = int(os.environ.get("TEST_LED_DOMAIN", "190"))

pytestmark = [needs_engine, pytest.mark.timeout(0)]


class Told:
    """The events of a led run and of its pieces."""

    def __init__(self, journal: MemoryJournal, run: str) -> None:
        self.run = journal.told(run)
        self.pieces = {
            each.piece: (each.engine, each.node, journal.told(each.piece))
            for each in self.run
            if isinstance(each, PieceBegan)
        }

    def closed(self) -> list[tuple[int, float]]:
        """Return from when to when nothing was to begin, in microseconds UTC."""
        found: list[tuple[int, float]] = []
        since: int | None = None
        for each in self.run:
            if isinstance(each, Held | StopRequested) and since is None:
                since = each.at
            elif isinstance(each, Released) and since is not None:
                found.append((since, each.at))
                since = None
        return [*found, *([(since, float("inf"))] if since is not None else [])]

    def published(self) -> list[tuple[int, str, str]]:
        """Return when which piece left for which robot."""
        return [
            (event.at, piece, engine)
            for piece, (engine, _, events) in self.pieces.items()
            for event in events
            if isinstance(event, Published)
        ]

    def ends(self, engine: str = "") -> list[tuple[int, str, str]]:
        """Return when which piece was called ended, and how; of one robot or of all."""
        return [
            (event.at, piece, event.state)
            for piece, (robot, _, events) in self.pieces.items()
            for event in events
            if isinstance(event, Ended) and engine in {"", robot}
        ]


def faults_of(told: Told, engines: Engines, run_over_at: int) -> list[str]:
    """Return the faults that the journal and the entries of the code show."""
    found: list[str] = []
    lines = engines.lines()
    closed = told.closed()
    left = told.published()
    found += [
        f"{piece} left for {engine} {(at - since) / 1e6:.3f} s after the gate had closed"
        for at, piece, engine in left
        for since, until in closed
        if since < at < until
    ]
    nodes = {node for _, node, _ in told.pieces.values()}
    for node in nodes:
        begun = sum(line.what == "begin" and line.action == node for line in lines)
        sent = sum(told.pieces[piece][1] == node for _, piece, _ in left)
        if begun > sent:
            found.append(f"{node} has begun {begun} times and was sent {sent} times")
    found += [
        f"{line.action} began {line.second - since / 1e6:.3f} s after the gate had closed"
        for line in lines
        if line.what == "begin" and not was_under_way(line, told, engines)
        for since, until in closed
        if since / 1e6 + LATE_S < line.second < until / 1e6
    ]
    found += [
        f"{line.what} of {line.action} {line.second - run_over_at / 1e6:.3f} s after the run's end"
        for line in lines
        if line.second > run_over_at / 1e6
    ]
    for at, piece, state in told.ends():
        began = next(
            each.at for each in told.run if isinstance(each, PieceBegan) and each.piece == piece
        )
        node = told.pieces[piece][1]
        following = [
            each.at
            for each in told.run
            if isinstance(each, PieceBegan) and each.node == node and each.at > began
        ]
        until = min(following, default=run_over_at + 10_000_000)
        found += [
            f"{piece} was {state} {line.second - at / 1e6:.3f} s before {line.what} of {node}"
            for line in lines
            if line.action == node and at < line.second * 1e6 < until
        ]
    for each in told.run:
        if isinstance(each, PieceEnded) and each.how == "shape" and each.outcome != "on_stopped":
            meant = "on_false" if each.node.endswith("_2") else "on_true"
            if each.outcome != meant:
                found.append(f"{each.node} was {each.outcome}, and its code {meant}")
    return found


def was_under_way(line: Line, told: Told, engines: Engines) -> bool:
    """Return whether the start of what began had left for an engine that was frozen then, or froze before
    it could begin. Such an engine begins it when it goes on; nobody can call a start message back."""
    at, robot = max(
        (at, engine)
        for at, piece, engine in told.published()
        if told.pieces[piece][1] == line.action and at / 1e6 < line.second
    )
    return any(
        since - LATE_S < at / 1e6 < until < line.second < until + LATE_S
        for since, until in engines.frozen.get(robot, ())
    )


class Scene:
    """One led run on three real engines, one of which fails."""

    def __init__(self, fault: str, lost: str, seed: int, folder: Path, domain: int) -> None:
        self.fault, self.lost = fault, lost
        self.chance = random.Random(f"{seed} {fault} {lost}")
        self.engines = Engines(folder, domain, 3)
        self.victim = self.chance.choice(["Ann", "Bob", "Cy"])
        self.others = [each for each in self.engines.names if each != self.victim]
        self.proven_s: list[float] = []
        self.by_word = 0
        self.went_on = 0
        self.state = ""

    async def live(self) -> list[str]:
        """Live through the fault; return what was found wrong."""
        async with self.engines.led() as (control, journal):
            self.control, self.journal = control, journal
            asked = as_led(watch("watch"), lost=self.lost, override=ACCEPTED)
            self.run = (await control.start(asked, ANN)).run.id
            await until(lambda: len({line.action for line in self.engines.lines()}) == 3)
            await anyio.sleep(self.chance.uniform(0.0, 0.6))
            await self._fail()
            if self.lost == "wait":
                await self._wait_and_go_on()
                await control.stop(self.run, BEN)
            await self._others_rest()
            if self.fault == "frozen":
                await anyio.sleep(0.5)
                is_open = self.run in control.open
                assert is_open or not self._of_victim(), "it ended while a robot was frozen"
                self.engines.thaw(self.victim)
            await self._end()
            ended = clock_us()
            await anyio.sleep(1)
            return faults_of(Told(journal, self.run), self.engines, ended)

    def _of_victim(self) -> list[OpenRun]:
        """Return the pieces of the robot that has failed which may still be moving."""
        return [
            each
            for each in self.control.open.values()
            if each.run.piece is not None and each.run.engine == self.victim
        ]

    async def _fail(self) -> None:
        """Let the engine fail; wait until the runner acts on it."""
        match self.fault:
            case "killed":
                self.engines.kill(self.victim)
            case "started anew":
                self.engines.kill(self.victim)
                self.engines.start(self.victim)
            case _:
                self.engines.freeze(self.victim)
        opened = self.control.open[self.run]
        await until(lambda: opened.run.held is not None or opened.run.desired == "stopped")
        chosen = opened.run.held is None if self.lost == "stop" else opened.run.desired == "running"
        assert chosen, opened.run

    async def _wait_and_go_on(self) -> None:
        """A held run begins nothing, also when its robot is back, until a person lets it go on."""
        assert self.control.open[self.run].run.state == "running"
        await anyio.sleep(1)
        if self.fault == "frozen":
            self.engines.thaw(self.victim)
            await anyio.sleep(2)
        held = self.control.open[self.run].run.held
        assert held is not None, "it went on by itself"
        before = len(Told(self.journal, self.run).published())
        with suppress(Refused):  # a robot whose engine is gone may keep the gate shut
            await self.control.go_on(self.run, GoOnRequest(as_text(held.at)), BEN)
            self.went_on += 1
        assert (self.control.open[self.run].run.held is None) or self.fault != "frozen"
        await anyio.sleep(1.5)
        if self.fault == "frozen":
            found = Told(self.journal, self.run)
            assert len(found.published()) > before, "nothing went on"
            self.engines.freeze(self.victim)  # once more: Stop has to do without it

    async def _others_rest(self) -> None:
        """Wait until every piece on the other robots is proven at rest, and note how long it took."""
        await until(lambda: bool(self._stopped_at()))
        await until(
            lambda: (
                not any(
                    each.run.piece is not None and each.run.engine in self.others
                    for each in self.control.open.values()
                )
            )
        )
        await anyio.sleep(0.1)  # the journal has them
        for name in self.others:
            ends = [
                at
                for at, *_ in Told(self.journal, self.run).ends(name)
                if at > self._stopped_at()[0]
            ]
            self.proven_s += [(max(ends) - self._stopped_at()[0]) / 1e6] if ends else []

    def _stopped_at(self) -> list[int]:
        """Return when somebody pressed Stop or the runner did so itself, in microseconds UTC."""
        told = self.journal.told(self.run)
        return [each.at for each in told if isinstance(each, StopRequested)]

    async def _end(self) -> None:
        """Wait for the run's end. Where the engine is gone a person says that its robot is at rest."""
        await is_over(self.control, self.run, 20)
        for opened in self._of_victim():
            assert self.fault != "frozen", opened.run
            confirm_rest(opened, RestRequest("I stand beside it."), BEN)
            self.by_word += 1
        self.state = await over(self.control, self.run, 20)
        lost = [piece for _, piece, state in Told(self.journal, self.run).ends() if state == "lost"]
        assert (self.state in {"lost", "error"}) == bool(lost), (self.state, lost)


@pytest.mark.parametrize("lost", ["stop", "wait"])
@pytest.mark.parametrize("fault", ["killed", "frozen", "started anew"])
def test_a_run_ends_as_its_starter_has_chosen(fault: str, lost: str, tmp_path: Path) -> None:
    count: Counter[str] = Counter()
    proven: list[float] = []
    failed: list[str] = []
    for seed in range(FROM, FROM + FAULTS):
        folder = tmp_path / str(seed)
        folder.mkdir()
        scene = Scene(fault, lost, seed, folder, DOMAIN + 3 * (seed % 10))
        what = f"{fault} {lost} seed {seed} ({scene.victim})"
        try:
            failed += [f"{what}: {each}" for each in anyio.run(scene.live)]
        except* (AssertionError, TimeoutError) as wrong:
            failed.append(f"{what}: {wrong.exceptions!r}")
        count[scene.state] += 1
        count["by word"] += scene.by_word
        count["went on"] += scene.went_on
        proven += scene.proven_s
    proven.sort()
    sys.stdout.write(
        f"\n{fault}, {lost}: {dict(count)}, the others' Stop proven: n={len(proven)} "
        f"median={proven[len(proven) // 2] if proven else 0:.2f} s max={max(proven, default=0):.2f} s\n"
    )
    assert failed == []
