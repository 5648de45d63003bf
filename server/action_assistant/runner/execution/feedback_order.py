"""The order of feedback and answers: which feedback is news after an answer. Pure.

The engine sends what happened in the last half second, and an answer to a get may have told the end
of that already. Applied after it, the older states would look like further visits that never were.
"""

from collections.abc import Sequence

from action_assistant.runner.links.observations import FAR, Snapshot
from action_assistant.runner.runs.fold import is_news, key_of
from action_assistant.runner.runs.run import Run


def fresh(run: Run, snapshots: Sequence[Snapshot]) -> tuple[Snapshot, ...]:
    """What of feedback, oldest first, comes after the state that a get has shown. In a loop a state
    that looks older may be a new lap; it is left for the next get to tell."""
    known: dict[str, int] = {}
    for i, shown in enumerate(snapshots):
        if not is_news(run, shown):
            known[shown.graph] = i
    return tuple(
        shown
        for i, shown in enumerate(snapshots)
        if i > known.get(shown.graph, -1) and not _behind(run, shown)
    )


def _behind(run: Run, shown: Snapshot) -> bool:
    """Whether nothing in it is further than what is known, and something is less far."""
    less = False
    for node, state in shown.nodes.items():
        action = run.actions.get(key_of(run, shown.graph, node))
        there, here = FAR.get(action.state if action else "", 0), FAR.get(state, 0)
        if here > there:
            return False
        less = less or here < there
    return less
