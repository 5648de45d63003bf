"""The replay of a run: what every event changed in the state of the run, page by page.

A frame has only the differences to the one before it. So the page shows at every moment exactly
what the live view showed then, without later knowledge.
"""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

import msgspec

from action_assistant.journal.events import Event
from action_assistant.runner.analysis.keyframes import (
    APART,
    KeyframeStore,
    ReplayMark,
    author_and_text,
    fold,
)
from action_assistant.runner.runs import views
from action_assistant.runner.runs.events import Author, RunEvent
from action_assistant.runner.runs.question_views import AnswerShown, answers_by_visit
from action_assistant.runner.runs.run import Desired, Result, Run, State
from action_assistant.runner.runs.visits import ActionRun


class ActionFrame(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The change of an action. `state`: its new state, as the engine names it. Its visits from number
    `first` on (counted from 0, over all its visits) are now `visits`; `messages` are new. `aid`: its
    key in the document, null if unknown."""

    state: str
    first: int
    visits: list[views.VisitShown] = []
    messages: list[views.MessageShown] = []
    aid: str | None = None


class ReplayHead(msgspec.Struct, frozen=True, kw_only=True):
    """The fields of a run that one event changed; unchanged fields are absent."""

    state: State | msgspec.UnsetType = msgspec.UNSET
    desired: Desired | msgspec.UnsetType = msgspec.UNSET
    result: Result | msgspec.UnsetType | None = msgspec.UNSET
    proof_at: datetime | msgspec.UnsetType | None = msgspec.UNSET
    unknown_since: datetime | msgspec.UnsetType | None = msgspec.UNSET
    moves_again_at: datetime | msgspec.UnsetType | None = msgspec.UNSET
    started_at: datetime | msgspec.UnsetType | None = msgspec.UNSET
    ended_at: datetime | msgspec.UnsetType | None = msgspec.UNSET
    detail: str | msgspec.UnsetType = msgspec.UNSET
    stopped_by: Author | msgspec.UnsetType = msgspec.UNSET


class ReplayFrame(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The changes by one event. `head`: the changed fields of the run; `actions`: the changed
    actions."""

    seq: int
    at: datetime
    kind: str
    by: str = ""
    text: str = ""
    head: ReplayHead | msgspec.UnsetType = msgspec.UNSET
    actions: dict[str, ActionFrame] = {}
    alarms: list[views.AlarmShown] = []


class ReplayPageStart(msgspec.Struct, frozen=True):
    """The beginning of a page of the replay: after `after` events, at `at`."""

    after: int
    at: datetime


class MarkShown(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """An event that is no observation of the engine. `since`: from when on the state was unknown."""

    seq: int
    at: datetime
    kind: str
    by: str = ""
    text: str = ""
    since: datetime | None = None


class RunReplay(msgspec.Struct, frozen=True, kw_only=True):
    """A page of a run's replay. `base` is the run after `after` events, null at the beginning;
    `newest` is the seq of the last event; `chapters`: the beginnings of all pages."""

    run: str
    after: int
    newest: int
    base: views.RunShown | None
    frames: list[ReplayFrame]
    chapters: list[ReplayPageStart]
    marks: list[MarkShown]


async def run_replay(keyframe_store: KeyframeStore, run: str, *, after: int) -> RunReplay:
    """Return the page of events after `after`, which is rounded down to a keyframe. Raise NotFound
    if there is no such run, Unavailable if the journal cannot be read."""
    keyframes = await keyframe_store.keyframes(run)
    start = after - after % APART
    base = keyframes.before(start) if start else None
    events = await keyframe_store.page(run, base.seq if base else 0)
    frames = _frames(base.run if base else None, events)
    chapters = [ReplayPageStart(0, views.time(keyframes.keys[0].run.requested_at))]
    chapters += [ReplayPageStart(key.seq, views.time(key.at)) for key in keyframes.keys[:-1]]
    return RunReplay(
        run=run,
        after=base.seq if base else 0,
        newest=keyframes.keys[-1].seq,
        base=views.run_view(base.run) if base else None,
        frames=frames,
        chapters=chapters,
        marks=[_shown(mark) for mark in keyframes.marks],
    )


def _shown(mark: ReplayMark) -> MarkShown:
    return MarkShown(
        seq=mark.seq,
        at=views.time(mark.at),
        kind=mark.kind,
        by=mark.by,
        text=mark.text,
        since=views.time(mark.since) if mark.since is not None else None,
    )


def _frames(run: Run | None, events: Sequence[Event]) -> list[ReplayFrame]:
    frames: list[ReplayFrame] = []
    at = 0

    def see(event: Event, decoded: RunEvent, before: Run | None, after: Run) -> None:
        nonlocal at
        # A clock may be set back, but the times of a replay do not go back.
        at = max(at, getattr(decoded, "at", event.at))
        frames.append(frame(event, decoded, before, after, at))

    fold(run, events, see)
    return frames


def frame(event: Event, decoded: RunEvent, before: Run | None, after: Run, at: int) -> ReplayFrame:
    """Return the changes by one event. `decoded`: its decoded body; `before`, `after`: the run
    before and after it; `at`: its time (µs UTC)."""
    by, text = author_and_text(decoded)
    old = before.alarms if before is not None else ()
    return ReplayFrame(
        seq=event.seq,
        at=views.time(at),
        kind=event.kind,
        by=by,
        text=text,
        head=_head(before, after),
        actions=_actions(before, after),
        alarms=[
            views.AlarmShown(each.code, views.time(each.at), each.text)
            for each in after.alarms
            if each not in old
        ],
    )


def _head(before: Run | None, after: Run) -> ReplayHead | msgspec.UnsetType:
    changed: dict[str, Any] = {}
    for name in ReplayHead.__struct_fields__[:-1]:
        now = getattr(after, name)
        if before is None or getattr(before, name) != now:
            changed[name] = views.time(now) if name.endswith(("_at", "_since")) and now else now
    if after.stopped_by is not None and (before is None or before.stopped_by is None):
        changed["stopped_by"] = after.stopped_by
    return ReplayHead(**changed) if changed else msgspec.UNSET


def _actions(before: Run | None, after: Run) -> dict[str, ActionFrame]:
    old = before.actions if before is not None else {}
    return {
        name: _changed(
            old.get(name),
            action,
            views.words_for(after.said.get(name, ())),
            answers_by_visit(after.answers.get(name, ())),
        )
        for name, action in after.actions.items()
        if _looks_new(old.get(name), action)
    }


def _looks_new(before: ActionRun | None, after: ActionRun) -> bool:
    """Return whether people would see a difference between two states of an action; None as
    `before` if it was not there. That it was seen again later, unchanged, is no difference."""
    if before is None:
        return True
    return before is not after and (
        before.state != after.state
        or before.aid != after.aid
        or before.visits != after.visits
        or before.messages != after.messages
    )


def _changed(
    before: ActionRun | None,
    after: ActionRun,
    words: Mapping[int, views.SaidShown],
    answers: Mapping[int, AnswerShown],
) -> ActionFrame:
    """Return the change of an action between two states of it; None as `before` if it was not
    there. `words`: the results that persons stated, `answers`: those of people who were asked, by number
    of the visit. Only its last visits
    can have changed, so the first different one is searched from the end."""
    total = after.older + len(after.visits)
    known = before.older + len(before.visits) if before is not None else 0
    first = total
    while first > after.older:
        place = first - 1
        if (
            before is not None
            and before.older <= place < known
            and before.visits[place - before.older] == after.visits[place - after.older]
        ):
            break
        first = place
    heard = before.messages if before is not None else ()
    fresh = [each for each in after.messages if each not in heard]
    return ActionFrame(
        aid=after.aid,
        state=after.state,
        first=first,
        visits=[
            views.visit_view(
                each,
                after.robot,
                words.get(number, msgspec.UNSET),
                answers.get(number, msgspec.UNSET),
            )
            for number, each in enumerate(after.visits[first - after.older :], first + 1)
        ],
        messages=[views.MessageShown(views.time(each.at), each.text) for each in fresh],
    )
