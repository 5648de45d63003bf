"""The views of how far each robot of a led run is proven to be at rest."""

from datetime import datetime
from typing import Final, Literal, TypeAlias

import msgspec
from msgspec.structs import replace

from action_assistant.kit.moments import moment
from action_assistant.runner.runs.author import Author
from action_assistant.runner.runs.events import PieceRest
from action_assistant.runner.runs.run import Run
from action_assistant.safe_text import hold_names

RestState: TypeAlias = Literal[
    "unused",
    "going",
    "stopping",
    "silent",
    "unproven",
    "proven",
    "seen",
    "unsent",
    "unknown",
]


class RobotRestShown(msgspec.Struct, frozen=True, omit_defaults=True):
    """The state of the proof that one robot of a led run is at rest. `state`: nothing of the
    run was ever begun there ("unused"), an action goes on ("going"), it gets Stops until rest is
    proven ("stopping"), it does not answer ("silent"), no answer can prove rest any more
    ("unproven"), an answer has proven it ("proven"), a person or the runner has seen it ("seen"),
    nothing of the last action began ("unsent"), or nothing was recorded of it ("unknown"). `since`:
    when that began; `action`, `piece`: the action and the run of its piece; `why`: the reason, or
    how rest was seen; `by`: who has seen it; `stops`: a Stop is asked for, and repeated until rest
    is proven."""

    robot: str
    state: RestState
    since: datetime | None = None
    action: str = ""
    piece: str = ""
    why: str = ""
    by: Author | None = None
    stops: bool = False

    def __post_init__(self) -> None:
        hold_names(self, "why")


#: The states of a robot of which nothing moves any more.
AT_REST: Final = frozenset({"unused", "proven", "seen", "unsent"})
#: From the worst to the best.
_WORST: Final = (
    "unproven",
    "unknown",
    "silent",
    "stopping",
    "going",
    "seen",
    "proven",
    "unsent",
    "unused",
)


def rests_of(run: Run) -> list[RobotRestShown]:
    """Return, for each robot of a led run, the state of its piece that is the furthest from
    proven rest; none for other runs."""
    if run.led is None:
        return []
    found: dict[str, list[RobotRestShown]] = {
        robot: [] for robot in sorted(set(run.led.players.values()))
    }
    for each in run.rests.values():
        found.setdefault(each.engine, []).append(_rest_view(run, each))
    return [
        min(shown, key=lambda each: _WORST.index(each.state))
        if shown
        else RobotRestShown(robot, "unused")
        for robot, shown in found.items()
    ]


def _rest_view(run: Run, rest: PieceRest) -> RobotRestShown:
    """Return the view that shows whether, and by what, a piece is proven to be at rest. Once the
    whole run is over, its proof or observation of rest counts for the piece, too."""
    shown = RobotRestShown(
        rest.engine,
        rest.state,
        moment(rest.since),
        rest.node,
        rest.piece,
        rest.why,
        rest.by,
        rest.stops,
    )
    if rest.rests or run.end is None:
        return shown
    proof = run.proof_at if run.at_rest is None else None
    at = None if proof is None else moment(proof)
    state: RestState = "proven" if proof is not None else "unknown"
    return replace(shown, state=state, since=at, why="", stops=False)
