"""Recognizes in an engine's log that it refused a start, and why. Pure.

No message carries an error, so the log alone has the reason. Its lines name no run: they prove
something by their order only. The thread that takes messages logs "Received request …" and, before
any other line of its own, why it did not follow; only the end of some graph may be logged in
between.
"""

import re
from typing import Final

from action_assistant.runner.links.engine_text import RECEIVED_START
from action_assistant.runner.runs.run import Run

#: Code of the alarm with the engine's words; it is stored, so that a restart keeps them.
REFUSED: Final = "start_refused"
#: Code of the alarm for an engine that refused a start and still shows some of it running.
HALF_BEGUN: Final = "half_begun"

_STARTED_BY_OTHERS: Final = frozenset({"foreign_start", "foreign_other"})
_RECEIVED: Final = "Received request to "
_ANOTHER_LIFE: Final = "The Action Engine is initialized."
_OF_OTHERS: Final = re.compile(r"Graph '.*' finished\.")
_ORIGIN: Final = re.compile(r"origin \[in \w+\]: ")
_MEANT: Final = (
    " It says so when the library of an action is not there, or when a graph with a sub-graph is "
    "started again: look at the packages on the robot, or restart its engine."
)
_LONGEST: Final = 300  # characters of the engine's words in a sentence


class StartLog:
    """Reads the engine's log lines about the start of `run`, after it is sent. `words`: the
    engine's reason for a refusal; "" without a refusal, or if the start may have been that of
    another program. After a restart of the runner, lines are missing and prove nothing; an earlier
    proven refusal is an alarm of the run."""

    def __init__(self, run: Run) -> None:
        self._graph = run.graph_name
        self._next = False  # the next line tells whether the start was refused
        alarm = next((each for each in run.alarms if each.code == REFUSED), None)
        self._over = True
        others = any(each.code in _STARTED_BY_OTHERS for each in run.alarms)
        self.words = "" if alarm is None or others else _between_quotes(alarm.text)

    def begins(self) -> None:
        """Call this when the start is sent: log lines count from now on."""
        self._over = False

    def hear(self, text: str) -> bool:
        """Read one more line of the log; return whether it reports that this start was refused."""
        if self._over or _OF_OTHERS.fullmatch(text):
            return False
        if not self._next:
            self._next = text == f"{RECEIVED_START}{self._graph}".strip()
            return False
        self._over = True
        followed = text.startswith(_RECEIVED) or text == _ANOTHER_LIFE
        self.words = "" if followed else words_of(text)
        return bool(self.words)

    def doubt(self) -> None:
        """Ignore all lines from now on, since they may concern a graph that another program has
        started."""
        self._over, self.words = True, ""


def words_of(line: str) -> str:
    """Return the first line of an engine's error, without the place in its sources."""
    first = line.strip().partition("\n")[0]
    return _ORIGIN.sub("", first)[:_LONGEST].removesuffix(".")


def in_words(engine: str, words: str) -> str:
    """Return the text of the alarm that an engine has refused a start, while it is unknown whether
    some of the graph runs all the same. `engine`: its name; `words`: the reason that it wrote."""
    return f"{engine} says of this start: “{words}”"


def why_refused(engine: str, words: str) -> str:
    """Return the sentence for a run that is over because its engine refused to start it, with a
    hint for the error `map::at`. `words`: the reason that the engine wrote."""
    hint = _MEANT if words == "map::at" else ""
    return f"{engine} refused the start: {words}.{hint}"


def _between_quotes(text: str) -> str:
    return text.partition("“")[2].rpartition("”")[0]
