"""What is known of the visits of one action: exactly from transitions, within bounds from snapshots.

Pure, and part of the fold of a run: what stands in old streams must come out the same for ever.
"""

from typing import Final, Literal, TypeAlias

import msgspec
from msgspec.structs import replace

from action_assistant.runner.seen import ACTIVE, NodeResult, Snapshot

Outcome: TypeAlias = Literal["true", "false", "error", "stopped"]
How: TypeAlias = Literal["observed", "inferred"]

#: Visits and messages of one action that a run carries; older ones are in its events.
KEPT: Final = 100
#: Messages of one action that an engine keeps.
_RING: Final = 10

_OUTCOMES: Final[dict[str, Outcome]] = {
    "on_true": "true",
    "on_false": "false",
    "on_error": "error",
    "on_stopped": "stopped",
}


class Visit(msgspec.Struct, frozen=True, kw_only=True):
    """One execution of an action.

    It was seen going on from `start` to `until` (None: still); at most it lasted from `not_before`
    to `not_after`. `how` says whether start and result were seen or follow from other things.
    `inputs`: the values that the engine reported while it went on; None when nobody saw them.
    """

    start: int
    not_before: int
    until: int | None = None
    not_after: int | None = None
    result: Outcome | None = None
    how: How = "observed"
    inputs: dict[str, str] | None = None


class Message(msgspec.Struct, frozen=True):
    """What an action had to say."""

    at: int
    text: str


class ActionRun(msgspec.Struct, frozen=True, kw_only=True):
    """One action of the run. `older` counts visits that are not listed any more."""

    aid: str | None = None
    state: str = "UNINITIALIZED"
    seen_at: int = 0
    visits: tuple[Visit, ...] = ()
    older: int = 0
    messages: tuple[Message, ...] = ()
    heard: int = 0


def changed(
    action: ActionRun, state: str, at: int, inputs: dict[str, str] | None = None
) -> ActionRun:
    """After an exact transition."""
    visits, older = action.visits, action.older
    if state in ACTIVE:
        if not _open(action):
            visits, older = _kept(visits, older, Visit(start=at, not_before=at, inputs=inputs))
    elif _open(action):
        result = visits[-1].result or _implied(action.state, state)
        visits = (*visits[:-1], replace(visits[-1], until=at, not_after=at, result=result))
    elif state == "ERROR" and action.state != "ERROR":  # thrown while it was made ready
        visit = Visit(start=at, not_before=at, until=at, not_after=at, result="error")
        visits, older = _kept(visits, older, visit)
    return replace(action, state=state, seen_at=at, visits=visits, older=older)


def resulted(action: ActionRun, item: NodeResult) -> ActionRun:
    """After an exact result; it comes while the visit is still open, or right after its end."""
    visits = action.visits
    if visits:
        visits = (*visits[:-1], replace(visits[-1], result=_OUTCOMES.get(item.result)))
    messages = action.messages
    if item.message is not None:
        messages = (*messages, Message(item.at, item.message))[-KEPT:]
    return replace(action, visits=visits, messages=messages)


def shown(
    action: ActionRun,
    state: str,
    item: Snapshot,
    begun_at: int,
    inputs: dict[str, str] | None = None,
) -> ActionRun:
    """After a snapshot, which says how things are but not when they became so. `begun_at`: when
    nothing can have happened before."""
    at = item.at
    before = min(at, max(item.since or 0, action.seen_at, begun_at))
    visits, older = action.visits, action.older
    if state in ACTIVE:
        if not _open(action):
            visit = Visit(start=at, not_before=before, inputs=inputs)
            visits, older = _kept(visits, older, visit)
    elif _open(action):
        last = visits[-1]
        implied = last.result or _implied(action.state, state)
        how: How = "inferred" if implied is not None and last.result is None else last.how
        ended = replace(last, until=max(last.start, before), not_after=at, result=implied, how=how)
        visits = (*visits[:-1], ended)
    elif state in {"FINISHED", "ERROR"} and action.state not in {"FINISHED", "ERROR"}:
        visit = Visit(
            start=at,
            not_before=before,
            until=at,
            not_after=at,
            result="error" if state == "ERROR" else None,
            how="inferred",
        )
        visits, older = _kept(visits, older, visit)
    return replace(action, state=state, seen_at=at, visits=visits, older=older)


def heard(action: ActionRun, messages: tuple[str, ...], at: int) -> ActionRun:
    """A snapshot repeats all messages so far; only the new ones are added."""
    first = len(messages) if is_heard(action, messages) else _known(action, messages)
    if first == len(messages):
        return action if first == action.heard else replace(action, heard=first)
    fresh = tuple(Message(at, text) for text in messages[first:])
    return replace(action, messages=(*action.messages, *fresh)[-KEPT:], heard=len(messages))


def is_heard(action: ActionRun, messages: tuple[str, ...]) -> bool:
    """Whether none of these messages is new. An engine keeps the last ten: then the oldest goes with
    each new one, which shows as long as they do not all say the same."""
    if len(messages) != action.heard or not messages:
        return len(messages) <= action.heard
    last = action.messages[-len(messages) :]
    return len(messages) < _RING or messages == tuple(each.text for each in last)


def _known(action: ActionRun, messages: tuple[str, ...]) -> int:
    """How many of these messages, from the first on, are those that were heard last."""
    if len(messages) > action.heard:
        return action.heard
    last = tuple(each.text for each in action.messages[-len(messages) :])
    return next(n for n in range(len(last), -1, -1) if last[len(last) - n :] == messages[:n])


def _implied(before: str, after: str) -> Outcome | None:
    """The result that a pair of states leaves no doubt about."""
    if after == "ERROR":
        return "error"
    return "stopped" if before == "STOPPING" else None


def _open(action: ActionRun) -> bool:
    return bool(action.visits) and action.visits[-1].until is None


def _kept(visits: tuple[Visit, ...], older: int, visit: Visit) -> tuple[tuple[Visit, ...], int]:
    over = len(visits) + 1 - KEPT
    return ((*visits[over:], visit), older + over) if over > 0 else ((*visits, visit), older)
