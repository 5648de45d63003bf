"""The table of the engine's transitions: the effect of a response on a child, by the activity of the child.

The simulator (`core`) and the fast checks (`courses.instants`) both look effects up here.
See docs/umrf-and-the-engine.md 2.3 to 2.5; H4.
"""

from typing import Final, Literal, TypeAlias

from action_assistant.umrf.model import Response

#: The activities of an action, as numbers, since the checks look up millions of them.
IDLE: Final = 0
RUNS: Final = 1
#: The action was told to stop and has not returned yet.
STOPS: Final = 2
PAUSED: Final = 3
#: The action was told to stop while paused: the engine waits until its timeout, then gives up.
GIVING_UP: Final = 4
#: The engine shows an end and the thread still lives, or the action loads and will run.
THREAD_LEFT: Final = 5

#: Activities in which the engine counts the action as active.
ACTIVE: Final = frozenset({RUNS, STOPS, PAUSED, GIVING_UP})

Effect: TypeAlias = Literal["nothing", "runs", "stops", "pauses", "aborts"]

_NONE: Final[tuple[Effect, ...]] = ("nothing",) * 6
#: By response and activity. `aborts` ends the engine's process. `restart` does nothing in this engine, and a
#: bypass passes the outcome on whatever the child is doing.
EFFECTS: Final[dict[Response, tuple[Effect, ...]]] = {
    # IDLE, RUNS, STOPS, PAUSED, GIVING_UP, THREAD_LEFT
    "run": ("runs", "nothing", "aborts", "aborts", "aborts", "aborts"),
    "stop": ("nothing", "stops", "aborts", "stops", "aborts", "nothing"),
    "pause": ("nothing", "pauses", "nothing", "nothing", "nothing", "nothing"),
    "restart": _NONE,
    "bypass": _NONE,
    "ignore": _NONE,
}
