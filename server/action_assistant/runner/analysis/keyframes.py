"""Keyframes of a run: its fold after every so many events, and the marks between them.

Folding a long run anew for every question would take seconds, so the fold after each `APART`-th
event is kept. Keyframes are a cache in the journal: they may be missing at any time.
"""

import asyncio
import bisect
from collections.abc import Callable, Sequence
from operator import attrgetter
from typing import Final, NamedTuple, Protocol

import msgspec

from action_assistant.errors import BadInput, NotFound, Refused
from action_assistant.journal.events import BareEvent, Event, StreamSnapshot
from action_assistant.kit.lru_cache import LruCache
from action_assistant.runner.runs.events import (
    AlarmRaised,
    BreakpointsSet,
    Ended,
    HandedOver,
    Held,
    ModifyRefused,
    ModifyRequested,
    MovesAgain,
    Observed,
    PauseRequested,
    Released,
    Requested,
    ResumeRequested,
    RunEvent,
    Silent,
    StopRequested,
    StopSent,
    decode,
    decode_all,
)
from action_assistant.runner.runs.fold import begin, follow, replay
from action_assistant.runner.runs.history import RunnerJournal
from action_assistant.runner.runs.question_events import (
    QuestionAnswered,
    QuestionAsked,
    QuestionClosed,
)
from action_assistant.runner.runs.recorder import stream_of
from action_assistant.runner.runs.run import Run

#: Raise it when `runs.fold` gives another run, or marks have other texts, for the same events: older
#: keyframes are not used then.
FOLD: Final = 6
#: Events between two keyframes, and in one page of a replay.
APART: Final = 2_000
_READ: Final = 5 * APART  # events that are read at once
#: Marks that keyframes of one run keep.
MARKS: Final = 2_000
#: Events up to which a run is folded anew, which is quicker than reading keyframes.
_WORTH: Final = 500
_AT: Final[Callable[[object], int]] = attrgetter("at")
_CACHED: Final = 8  # runs whose keyframes stay in memory
_SHOWN: Final = 200  # characters of an answer in a mark


class Keyframe(msgspec.Struct, frozen=True):
    """A run after its first `seq` events, the last of which happened at `at` (microseconds UTC)."""

    seq: int
    at: int
    run: Run


class ReplayMark(msgspec.Struct, frozen=True):
    """An event that is no observation of the engine: a command of a person, a message sent, a
    silence, a proof, an alarm. `at` and `since` are microseconds UTC; `by` is a person's name."""

    seq: int
    at: int
    kind: str
    by: str = ""
    text: str = ""
    since: int | None = None


class RunKeyframes(msgspec.Struct, frozen=True):
    """Keyframes in order; the last one is the run after its newest event. `marks`: the first
    `MARKS` marks of the run. `fold`: the value of `FOLD` with which they were made."""

    fold: int
    keys: tuple[Keyframe, ...]
    marks: tuple[ReplayMark, ...] = ()

    def before(self, seq: int) -> Keyframe | None:
        """Return the last keyframe at or before event number `seq`; None if there is none."""
        place = bisect.bisect_right(self.keys, seq, key=lambda key: key.seq)
        return self.keys[place - 1] if place else None

    def until(self, at: int) -> Keyframe | None:
        """Return the last keyframe whose events had all happened by `at` (µs UTC); None if there is
        none."""
        place = bisect.bisect_right(self.keys, at, key=lambda key: key.at)
        return self.keys[place - 1] if place else None


class SnapshotJournal(RunnerJournal, Protocol):
    """A journal that also stores snapshots of streams."""

    async def bare(self, stream: str, usual: str, *, after: int, upto: int) -> list[BareEvent]:
        """Return the events of a stream with `after < seq <= upto`, in order and as (body, kind,
        at). The kind is None for events of the kind `usual`. The list is shorter if events are
        missing."""
        ...

    async def snapshot(self, stream: str) -> StreamSnapshot | None:
        """Return the stored snapshot of a stream; None if no valid one is stored."""
        ...

    async def keep_snapshot(self, stream: str, seq: int, state: bytes) -> None:
        """Store `state` as the snapshot of a stream at `seq`. Raise Unavailable if the journal
        cannot store it."""
        ...


class KeyframeStore:
    """Makes, caches and stores the keyframes of runs (the run as it was after certain events). For
    use in a worker process, since folding is slow. Its methods raise Unavailable while the journal
    cannot be read."""

    def __init__(self, journal: SnapshotJournal) -> None:
        self._journal = journal
        self._cache: LruCache[str, RunKeyframes] = LruCache(_CACHED)
        self._locks: dict[str, asyncio.Lock] = {}

    async def keyframes(self, run: str) -> RunKeyframes:
        """Return the keyframes of a run, up to its newest event. Raise NotFound if there is no such
        run, Unavailable if the journal cannot be read."""
        lock = self._locks.setdefault(run, asyncio.Lock())
        async with lock:
            found = await self._up_to_date(run)
        self._locks.pop(run, None)
        return found

    async def at(self, run: str, seq: int) -> Run:
        """Return the run as it was after its first `seq` events. Raise NotFound if there is no such
        run, BadInput if `seq` is less than 1."""
        if seq < 1:
            raise BadInput("A run begins with its first event.", where={"path": "/seq"})
        key = (await self.keyframes(run)).before(seq)
        if key is not None and key.seq == seq:
            return key.run
        events = await self._journal.read(stream_of(run), after=key.seq if key else 0, upto=seq)
        return _next(key, _whole(events)).run

    async def seq_at(self, run: str, at: int) -> int:
        """Return the seq of the first event at or after the time `at` (microseconds UTC), else of
        the last event. Raise NotFound if there is no such run, Unavailable if the journal cannot
        be read."""
        key = (await self.keyframes(run)).until(at - 1)
        events = await self.page(run, key.seq if key else 0)
        for event in events:
            if getattr(decode(event.kind, event.body), "at", event.at) >= at:
                return event.seq
        return events[-1].seq if events else key.seq if key else 1

    async def page(self, run: str, after: int) -> Sequence[Event]:
        """Return the first `APART` stored events of a run with `seq > after`."""
        return await self._journal.read(stream_of(run), after=after, limit=APART)

    async def _up_to_date(self, run: str) -> RunKeyframes:
        stream = stream_of(run)
        newest = await self._journal.newest(stream)
        if not newest:
            raise NotFound("There is no such run.")
        keyframes = self._cache.get(run) or await self._stored(stream)
        keys = list(keyframes.keys) if keyframes is not None else []
        marks = list(keyframes.marks) if keyframes is not None else []
        had = keys[-1].seq if keys else 0
        while not keys or keys[-1].seq < newest:
            last = keys[-1] if keys else None
            after = last.seq if last else 0
            room = APART - after % APART  # keyframes stand at multiples of APART, and at the end
            read = await self._part(stream, after, min(newest, after + room + _READ - APART))
            if not read.events:
                break
            if last is not None and last.seq % APART:
                keys.pop()  # an end that has gone on is no keyframe
            keys += _following(last, read, room)
            marks += _marks_of(read)
        if not keys:
            raise NotFound("There is no such run.")
        found = RunKeyframes(FOLD, tuple(keys), tuple(marks[:MARKS]))
        self._cache.put(run, found)
        if _worth_keeping(keys[-1], had):
            await self._store(stream, found)
        return found

    async def _part(self, stream: str, after: int, upto: int) -> "_Part":
        events = await self._journal.bare(stream, Observed.kind, after=after, upto=upto)
        if len(events) == upto - after:
            return _Part(range(after + 1, upto + 1), events)
        return _whole(await self._journal.read(stream, after=after, upto=upto))

    async def _stored(self, stream: str) -> RunKeyframes | None:
        stored = await self._journal.snapshot(stream)
        if stored is None:
            return None
        try:
            keyframes = msgspec.msgpack.decode(stored.state, type=RunKeyframes)
        except msgspec.DecodeError:
            return None
        return keyframes if keyframes.fold == FOLD and keyframes.keys else None

    async def _store(self, stream: str, keyframes: RunKeyframes) -> None:
        state = msgspec.msgpack.encode(keyframes)
        try:
            await self._journal.keep_snapshot(stream, keyframes.keys[-1].seq, state)
        except Refused:
            return  # a cache: it is made again when the journal can be written


def _worth_keeping(newest: Keyframe, had: int) -> bool:
    """Return whether to store the keyframes up to `newest`, if those up to event number `had` are
    stored: at the end of a run that is not tiny, and at each multiple of `APART` while it runs."""
    if newest.run.end is None:
        return newest.seq // APART > had // APART
    return newest.seq > max(had, _WORTH)


def fold(
    run: Run | None,
    events: Sequence[Event],
    see: "Callable[[Event, RunEvent, Run | None, Run], None]",
) -> Run | None:
    """Fold events, going on from `run`, and return the run after the last one. Without a run
    (None), the first `Requested` begins it; events before that are skipped, and the result is None
    if there is none. Call `see` after each event with the event, its decoded body, and the run
    before and after it."""
    for event in events:
        decoded = decode(event.kind, event.body)
        before = run
        if run is not None:
            run = follow(run, decoded)
        elif isinstance(decoded, Requested):
            run = begin(decoded)
        if run is not None:
            see(event, decoded, before, run)
    return run


class _Part(NamedTuple):
    """A part of a stream: the seq of each event, and the events."""

    seqs: Sequence[int]
    events: Sequence[BareEvent]


def _whole(events: Sequence[Event]) -> _Part:
    """Return stored events as a part; there may be gaps between them."""
    return _Part([each.seq for each in events], [(e.body, e.kind, e.at) for e in events])


def _marks_of(part: _Part) -> list[ReplayMark]:
    marks: list[ReplayMark] = []
    numbered = zip(part.seqs, part.events, strict=True)
    for seq, (body, kind, at) in [each for each in numbered if each[1][1] is not None]:
        if kind is None or kind == Observed.kind:
            continue
        decoded = decode(kind, body)
        by, text = author_and_text(decoded)
        since = decoded.since if isinstance(decoded, Silent) else None
        marks.append(ReplayMark(seq, getattr(decoded, "at", at or 0), kind, by, text, since))
    return marks


def author_and_text(decoded: RunEvent) -> tuple[str, str]:
    """Return the name of the person behind an event, and the event's text (a reason, an alarm …);
    "" for either that the event does not have."""
    match decoded:
        case Requested():
            return decoded.author.name, decoded.override.reason if decoded.override else ""
        case PauseRequested() | ResumeRequested() | ModifyRequested() | StopRequested():
            return decoded.author.name, ""
        case StopSent():
            return "", decoded.failed or f"attempt {decoded.attempt}"
        case Silent() | ModifyRefused():
            return "", decoded.why
        case AlarmRaised() | MovesAgain():
            return "", decoded.text
        case Ended():
            return "", decoded.detail
        case _:
            return _led_author_and_text(decoded)


def _led_author_and_text(decoded: RunEvent) -> tuple[str, str]:
    """Return the same for the events that only led runs have."""
    match decoded:
        case Held(by=by, why=why):
            return by.name if by is not None else "", why
        case Released(author=by, step=step, until=until, over=over):
            limits = (
                f"one step, {step}" * bool(step),
                f"until {until}" * bool(until),
                f"over {' › '.join(over)}" * bool(over),
            )
            return by.name, "".join(limits)
        case HandedOver(author=by, to=to):
            return by.name, to.name
        case BreakpointsSet(author=by, breakpoints=breakpoints):
            return by.name, "; ".join(each.words() for each in breakpoints)
        case QuestionAsked(asks=asks):
            return "", asks.text
        case QuestionAnswered(by=by, value=value, reason=reason):
            return by.name, (value or reason)[:_SHOWN]
        case QuestionClosed(why=why):
            return "", why
        case _:
            return "", ""


def _following(last: Keyframe | None, part: _Part, room: int) -> list[Keyframe]:
    """Return the keyframes of a part after `last`: the first one after `room` events, then after
    every `APART`."""
    keys: list[Keyframe] = []
    for start in (0, *range(room, len(part.events), APART)):
        end = start + APART if start else room
        last = _next(last, _Part(part.seqs[start:end], part.events[start:end]))
        keys.append(last)
    return keys


def _next(last: Keyframe | None, part: _Part) -> Keyframe:
    decoded = decode_all(Observed.kind, part.events)
    run = replay(decoded, last.run if last is not None else None)
    if run is None:
        raise NotFound("There is no such run.")
    try:
        at = max(map(_AT, decoded))
    except AttributeError:  # an event of a kind that this version does not know
        stored = (each[2] or 0 for each in part.events)
        at = max(getattr(one, "at", own) for one, own in zip(decoded, stored, strict=True))
    return Keyframe(part.seqs[-1], max(at, last.at) if last is not None else at, run)
