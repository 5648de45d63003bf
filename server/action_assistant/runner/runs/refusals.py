"""The words in which an engine's log refuses a start. Pure.

No message carries an error, so these lines are the only place that has the reason. They name no run:
what they prove rests on their order. The thread that takes messages in says "Received request …" and,
before anything else of its own, why it did not follow; only the end of some graph may come between.
"""

import re
from typing import Final

from action_assistant.runner.links.engine_text import RECEIVED_START
from action_assistant.runner.runs.run import Run

#: The alarm with the engine's words. It is journaled, so that they outlive this process.
REFUSED: Final = "start_refused"
#: The alarm of an engine that refused a start and yet shows some of it going on.
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
    """The lines about the one start of `run`, from the moment on that it is handed over.

    `words`: why the engine refused it; "" while it has not, or nobody can tell whose start it was. A
    runner that takes a run up has not heard everything, so that lines prove nothing to it any more;
    what was proven before is an alarm of the run.
    """

    def __init__(self, run: Run) -> None:
        self._graph = run.graph_name
        self._next = False  # the next line tells what became of it
        told = next((each for each in run.alarms if each.code == REFUSED), None)
        self._over = True
        others = any(each.code in _STARTED_BY_OTHERS for each in run.alarms)
        self.words = "" if told is None or others else _between_quotes(told.text)

    def begins(self) -> None:
        """The start is handed over now: lines from here on may be about it."""
        self._over = False

    def hear(self, text: str) -> bool:
        """One more line. Whether it says that the start was refused."""
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
        """Somebody else has started something there, too: the lines may be about that."""
        self._over, self.words = True, ""


def words_of(line: str) -> str:
    """What an error of the engine says, without where in its sources it arose."""
    first = line.strip().partition("\n")[0]
    return _ORIGIN.sub("", first)[:_LONGEST].removesuffix(".")


def in_words(engine: str, words: str) -> str:
    """The alarm of a refusal. What follows from it is not known yet."""
    return f"{engine} says of this start: “{words}”"


def why_refused(engine: str, words: str) -> str:
    """Why a run is over that never began; what `map::at` means is known from real engines."""
    hint = _MEANT if words == "map::at" else ""
    return f"{engine} refused the start: {words}.{hint}"


def _between_quotes(text: str) -> str:
    return text.partition("“")[2].rpartition("”")[0]
