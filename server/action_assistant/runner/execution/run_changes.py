"""The changes of one run: events, each with the run as it is after that event. Nothing is shown or stored
here, so whoever decides what an engine's answer means returns a value of this kind."""

import re
from collections.abc import Iterator
from typing import Final, NamedTuple

from action_assistant.kit.clock import ClockUs
from action_assistant.runner.links.observations import Hazard, Seen
from action_assistant.runner.runs.events import (
    AlarmRaised,
    AtRest,
    End,
    Ended,
    MovesAgain,
    Observed,
    RunEvent,
    Unconfirmed,
)
from action_assistant.runner.runs.fold import follow, thin
from action_assistant.runner.runs.run import Run

#: The end of every alarm about a Stop that nothing proves.
LOOK_AT_IT: Final = "Look at the robot; its hardware stop is the one to use."

_WITHOUT_END: Final = frozenset(
    {"H7", "H8"}
)  # hazards after which a run goes nowhere, although the engine goes on
#: Words by which an engine's log shows an exception of C++, after which the engine may abort.
_EXCEPTION: Final = re.compile(
    r"std::|\b(map|vector|deque|basic_string)::|Duplicate entry detected|terminate called"
)
_LAST_WORDS_US: Final = (
    10_000_000  # before its end is noticed; older lines are about something else
)
_RESULTS: Final = {"HALTED": "on_halted", "STOPPED": "on_stopped", "ERROR": "on_error"}


class RunChange(NamedTuple):
    """One event, its author ("" for the engine), and the run as it is after the event."""

    event: RunEvent
    author: str
    run: Run


class RunChanges:
    """Collects the next events of a run and folds each into `run` at once.

    An event that comes after the end of the run is dropped, unless it is an alarm or says that the run
    moves again.
    """

    def __init__(self, run: Run, clock_us: ClockUs) -> None:
        self.run = run
        self._clock_us = clock_us
        self._changes: list[RunChange] = []

    def __iter__(self) -> Iterator[RunChange]:
        return iter(self._changes)

    def tell(self, event: RunEvent, author: str = "") -> None:
        """Add an event, and fold it into `run`. `author`: the id of a person, "" for the engine."""
        if self.run.end is not None and not isinstance(event, AlarmRaised | MovesAgain):
            return
        self.run = follow(self.run, event)
        self._changes.append(RunChange(event, author, self.run))

    def observe(self, seen: tuple[Seen, ...]) -> None:
        """Add what was seen of the engine (`seen`) as one event, and an alarm for each hazard in it
        that people must know."""
        self.tell(Observed(self._clock_us(), thin(self.run, seen)))
        for item in seen:
            if isinstance(item, Hazard) and (item.effect != "goes on" or item.code in _WITHOUT_END):
                place = f" at {item.node}" if item.node else ""
                self.alarm(item.code, f"{item.code}{place}: {item.message or item.effect}")

    def alarm(self, code: str, text: str) -> None:
        """Add an alarm, unless the run has one with this code and text."""
        if all((alarm.code, alarm.text) != (code, text) for alarm in self.run.alarms):
            self.tell(AlarmRaised(self._clock_us(), code, text))

    def end(self, state: End, detail: str) -> None:
        """End the run in this state, unless it has ended already. `detail`: the sentence for
        people."""
        if self.run.end is None:
            self.tell(Ended(self._clock_us(), state, self._result(), detail))

    def lose(self, why: str) -> None:
        """Record that the engine does not hold the run any more. A simulated run ends as “lost”. On
        a real robot the code of the actions may go on, so the run does not end: it is marked as
        lost, with an alarm. `why`: the reason, as a sentence. A second call with the same reason
        adds nothing."""
        if self.run.simulated:
            self.end("lost", why)
        elif self.run.lost != why:
            self.tell(Unconfirmed(self._clock_us(), why, lost=True))
            self.alarm("stop_unconfirmed", f"STOP UNCONFIRMED: {why} {LOOK_AT_IT}")

    def doubt(self, why: str) -> None:
        """Record, with an alarm, that the Stop of the run is unconfirmed: code of its actions may
        still be executing, and the engine will never report the end. `why`: the reason, without a
        full stop."""
        self.tell(Unconfirmed(self._clock_us(), why))
        self.alarm("stop_unconfirmed", f"STOP UNCONFIRMED: {why}. {LOOK_AT_IT}")

    def engine_ended(self) -> None:
        """End the run, since the engine's process, and with it the code of every action, has ended."""
        process = self.run.process
        how = (
            "The simulated engine was switched off."
            if process is None
            else f"The engine's process, {process.pid} on this computer, has ended."
        )
        self._rests_by_itself(how + self.last_words())

    def last_words(self) -> str:
        """Return, as a further sentence, the exception that the engine's log showed right before;
        "" if it showed none: it is then unknown why the engine has ended."""
        since = self._clock_us() - _LAST_WORDS_US
        lines = (line for line in reversed(self.run.log) if line.at >= since)
        said = next((line.text for line in lines if _EXCEPTION.search(line.text)), "")
        return f" Its log said before: “{said}”." if said else ""

    def threads_ended(self) -> None:
        """End the run, since no thread that the engine began for it is left."""
        process = self.run.process
        where = f"process {process.pid} on this computer" if process else "the engine's process"
        self._rests_by_itself(f"No thread that the engine began for this run is left in {where}.")

    def _rests_by_itself(self, how: str) -> None:
        run = self.run
        state: End = "error" if run.doubt else "lost"
        self.rests(AtRest(None, self._clock_us(), how), state, run.doubt or run.lost or how)

    def rests(self, seen: AtRest, state: End, why: str, author: str = "") -> None:
        """End the run in this state because it was seen at rest, where no answer of the engine
        proves it. `seen`: who saw it, when and how; `why`: the sentence for people; `author`: the
        id of that person, "" for a program."""
        self.tell(Ended(seen.at, state, self._result(), why, seen), author)

    def _result(self) -> str | None:
        return self.run.result or _RESULTS.get(self.run.graph_state or "")
