"""The steps of a led run that no robot carries out: people answer them, or the runner waits.

They pass the same gate as pieces. A question has an id of its own each time it is asked, so that an
answer counts for this question of this visit alone: the first one is taken, in the step of the event loop
in which it comes. A confirmation after which a robot may move is asked again after 60 s, and after
each wait, so that nobody confirms what they no longer see.
"""

from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from math import inf
from typing import Any, Final, Literal, TypeAlias

import anyio
import msgspec

from action_assistant.errors import Conflict, TooLarge
from action_assistant.kit.clock import ClockUs
from action_assistant.random_ids import random_id
from action_assistant.runner.execution.conducted_steps import LeftOpen, Step, Tell
from action_assistant.runner.execution.led_gate import LedGate
from action_assistant.runner.runs.events import Author, PieceEnded, Requested
from action_assistant.runner.runs.question_events import (
    AnswerRefused,
    ClosedWhy,
    PauseBegan,
    QuestionAnswered,
    QuestionAsked,
    QuestionClosed,
)
from action_assistant.umrf.kept_values import as_json
from action_assistant.umrf.model import Precondition
from action_assistant.umrf.questions import (
    OUTPUT_OF,
    Asked,
    AtDeadline,
    Question,
    WrongAnswer,
    WrongQuestion,
    checked_answer,
    moment_of,
    pause_of,
    question_of,
)

_LAPSES_S: Final = 60.0
_LOOK_S: Final = 1.0  # between two looks at the clock
_JUMP_S: Final = 3.0  # by which a clock does not go wrong by itself
_MOST_REFUSED: Final = 20  # answers that came too late and are recorded
_MOST_PHOTOS: Final = 5  # that are kept for one question

_AT_DEADLINE: Final[Mapping[AtDeadline, Precondition]] = {
    "false": "on_false",
    "error": "on_error",
    "stopped": "on_stopped",
}
_How: TypeAlias = Literal["answer", "deadline", "time", "fault"]


class Given(msgspec.Struct, frozen=True, kw_only=True):
    """The answer of a person. `value`: as it was sent; `cannot`: why there is none, "" if there is one;
    `request_id`: of the press."""

    by: Author
    value: Any = None
    cannot: str = ""
    request_id: str = ""


class AskedEnd(msgspec.Struct, frozen=True, kw_only=True):
    """The end of a step that no robot carries out. `outputs`: its values by name."""

    outcome: Precondition
    how: _How
    by: Author | None = None
    reason: str = ""
    outputs: dict[str, Any] = {}


class OpenQuestion:
    """A question that people can answer now. `lapses`: it is asked again after a while, and after each
    wait of the run."""

    def __init__(self, event: QuestionAsked, step: Step, *, lapses: bool) -> None:
        self.event: Final = event
        self._step = step
        self.lapses: Final = lapses
        self.photos: Final = set[str]()
        self.end: AskedEnd | None = None  # by an answer
        self.closed: ClosedWhy | None = None
        self.settled: Final = anyio.Event()

    @property
    def is_open(self) -> bool:
        """True while nobody has answered, and somebody can."""
        return not self.settled.is_set()

    @property
    def is_stopped(self) -> bool:
        """True once a person or an arrow has stopped its step, a moment before it is closed."""
        return self._step.is_stopped


class AskedSteps:
    """Asks people, and waits, for the steps of one led run. `first`: its first event; `begun`
    shows people that a step has begun; `tell` records an event; `left`: how far an earlier process led the run, None for a new one."""

    def __init__(
        self,
        first: Requested,
        gate: LedGate,
        begun: Callable[[Step], None],
        tell: Tell,
        clock_us: ClockUs,
        left: LeftOpen | None = None,
    ) -> None:
        assert first.led is not None
        self.actions: Final = first.led.asked
        self._gate = gate
        self._begun = begun
        self._tell = tell
        self._clock_us = clock_us
        self._open: dict[str, OpenQuestion] = {}
        self._pauses: dict[int, int] = dict(left.pauses) if left is not None else {}
        self._refused = 0
        #: When somebody said yes to what moves next, by robot, in seconds of the event loop.
        self._said_yes: dict[str, float] = {}
        gate.on_hold = self._lapse

    async def carry_out(self, step: Step) -> AskedEnd | None:
        """Carry a step out that the gate has let pass, and return its end. Return None if its question was
        closed since the run waits: then it passes the gate again."""
        try:
            if self.actions[step.node].by == "runner":
                return await self._wait(step)
            question = question_of(self.actions[step.node].action, step.call.inputs)
            return await self._ask_until_answered(step, question)
        except WrongQuestion as wrong:
            self._begun(step)
            return AskedEnd(outcome="on_error", how="fault", reason=str(wrong))

    # --- questions ----------------------------------------------------------------------------

    async def _ask_until_answered(self, step: Step, question: Question) -> AskedEnd | None:
        deadline = anyio.current_time() + (question.deadline_s or inf)
        before = ""
        self._begun(step)
        while True:
            asked = self._ask(step, question, deadline, before)
            lapse = anyio.current_time() + (_LAPSES_S if asked.lapses else inf)
            try:
                with anyio.move_on_after(min(deadline, lapse) - anyio.current_time()):
                    await asked.settled.wait()
            except anyio.get_cancelled_exc_class():
                if (
                    asked.end is None or not step.is_stopped
                ):  # else its answer has come before the Stop
                    if step.is_stopped:
                        self._close(asked, "stopped")
                    raise
            if asked.end is not None:
                return asked.end
            if asked.closed is not None:
                return None
            if anyio.current_time() >= deadline:
                self._close(asked, "deadline")
                outcome = _AT_DEADLINE[question.at_deadline]
                text = f"Nobody has answered for {question.deadline_s:g} s."
                return AskedEnd(outcome=outcome, how="deadline", reason=text)
            self._close(asked, "lapsed")
            before = asked.event.question

    def _ask(self, step: Step, question: Question, deadline: float, before: str) -> OpenQuestion:
        known, now = self.actions[step.node], self._clock_us()
        lapses = question.kind == "confirm" and bool(known.moves)
        left_s = deadline - anyio.current_time()
        event = QuestionAsked(
            at=now,
            call=step.call.number,
            node=step.node,
            visit=self._gate.visit(step.call),
            question=random_id(),
            asks=question,
            role=known.role,
            to=known.to,
            moves=known.moves,
            until=0 if left_s == inf else now + round(left_s * 1e6),
            lapses_at=now + round(_LAPSES_S * 1e6) if lapses else 0,
            again=before,
        )
        asked = self._open[event.question] = OpenQuestion(event, step, lapses=lapses)
        self._tell(event)
        return asked

    def _close(self, asked: OpenQuestion, why: ClosedWhy) -> None:
        """Let nobody answer a question any more, and record why; do nothing if it is settled."""
        if not asked.is_open:
            return
        asked.closed = why
        asked.settled.set()
        event = asked.event
        del self._open[event.question]
        self._tell(
            QuestionClosed(
                at=self._clock_us(),
                call=event.call,
                node=event.node,
                question=event.question,
                why=why,
            )
        )

    def _lapse(self) -> None:
        """Close the questions that are asked again after each wait of the run, in the step in which the gate
        is held."""
        self._said_yes.clear()
        for asked in tuple(self._open.values()):
            if asked.lapses:
                self._close(asked, "held")

    def stop(self) -> None:
        """Close all questions, in the step in which the run is stopped."""
        for asked in tuple(self._open.values()):
            self._close(asked, "stopped")

    def find(self, question: str) -> OpenQuestion | None:
        """Return an open question by its id; None if it is not open."""
        return self._open.get(question)

    def answer(self, asked: OpenQuestion, given: Given) -> None:
        """Take the answer of a person, in the step of this call. Raise WrongAnswer if it does not fit, or
        Conflict if the question is not open any more."""
        is_held = asked.lapses and not self._gate.is_open
        if not asked.is_open or asked.is_stopped or is_held:
            raise Conflict("This question is not open any more.", where={"path": "/question"})
        event = asked.event
        asked.end = _end_of(event.asks, given, asked.photos)
        asked.settled.set()
        del self._open[event.question]
        if event.asks.kind == "confirm" and asked.end.outcome == "on_true":
            self._said_yes |= dict.fromkeys(event.moves, anyio.current_time())
        self._tell(
            QuestionAnswered(
                at=self._clock_us(),
                call=event.call,
                node=event.node,
                question=event.question,
                by=given.by,
                outcome=asked.end.outcome,
                value=value_of(given),
                reason=given.cannot,
                request_id=given.request_id,
            ),
            given.by.id,
        )

    def add_photo(self, asked: OpenQuestion, photo: str) -> None:
        """Keep a photo that a person has sent for a question. Raise Conflict if it is not open any more,
        or wants none."""
        if not asked.is_open:
            raise Conflict("This question is not open any more.", where={"path": "/question"})
        if asked.event.asks.kind != "photo":
            raise Conflict("This question wants no photo.", where={"path": "/question"})
        if photo not in asked.photos and len(asked.photos) >= _MOST_PHOTOS:
            raise TooLarge(f"There are {_MOST_PHOTOS} photos for this question already.")
        asked.photos.add(photo)

    def refuse(self, question: str, node: str, by: Author, why: str) -> None:
        """Record that an answer came too late; only the first ones are."""
        if self._refused < _MOST_REFUSED:
            self._refused += 1
            at = self._clock_us()
            event = AnswerRefused(at=at, question=question, node=node, by=by, why=why)
            self._tell(event, by.id)

    def why_too_old(self, robot: str) -> str:
        """Return why what leaves now for a robot needs a person once more, since the yes to it is too old;
        "" if it does not. A second call says "" then."""
        since = self._said_yes.pop(robot, None)
        if since is None or anyio.current_time() - since <= _LAPSES_S:
            return ""
        return f"The yes to what moves {robot} next is more than {_LAPSES_S:.0f} s old."

    # --- waits --------------------------------------------------------------------------------

    async def _wait(self, step: Step) -> AskedEnd:
        """Wait for a step of the runner: by the monotonic clock for some seconds, by the wall clock
        until a time. After a restart the wall clock says what is left of either."""
        pause = pause_of(self.actions[step.node].action, step.call.inputs)
        number, now = step.call.number, self._clock_us()
        known = self._pauses.get(number)
        if known is not None:
            until = known
        elif pause.time:
            local = datetime.fromtimestamp(now / 1e6, UTC).astimezone()
            until = round(moment_of(pause.time, local).timestamp() * 1e6)
        else:
            until = now + round(pause.seconds * 1e6)
        self._pauses[number] = until
        self._begun(step)
        is_again = known is not None
        self._tell(PauseBegan(at=now, call=number, node=step.node, until=until, again=is_again))
        if pause.time:
            await self._wait_until(until)
        else:
            await anyio.sleep(max(0.0, min(pause.seconds, (until - now) / 1e6)))
        return AskedEnd(outcome="on_true", how="time")

    async def _wait_until(self, until: int) -> None:
        """Wait until the clock shows this moment (µs UTC). If the clock jumps, wait on until that was
        noticed, and the run is held (`StallWatch`)."""
        offset = self._clock_us() / 1e6 - anyio.current_time()
        while True:
            now = self._clock_us()
            shift = now / 1e6 - anyio.current_time() - offset
            if abs(shift) > _JUMP_S:
                offset += shift
                await anyio.sleep(_LOOK_S)
                continue
            if now >= until:
                return
            await anyio.sleep(min(_LOOK_S, (until - now) / 1e6))


def _end_of(question: Question, given: Given, photos: set[str]) -> AskedEnd:
    """Return the end of a step by an answer. Raise WrongAnswer if it does not fit the question."""
    if given.cannot:
        if given.value is not None:
            raise WrongAnswer("There is an answer, or a reason why there is none.")
        return AskedEnd(outcome="on_false", how="answer", by=given.by, reason=given.cannot)
    value = checked_answer(question, given.value, photos)
    if question.kind == "confirm":
        outcome: Precondition = "on_true" if value else "on_false"
        return AskedEnd(outcome=outcome, how="answer", by=given.by)
    outputs = {OUTPUT_OF[question.kind]: value}
    return AskedEnd(outcome="on_true", how="answer", by=given.by, outputs=outputs)


def value_of(given: Given) -> str:
    """Return the value of an answer as JSON; "" if there is none."""
    return "" if given.value is None else as_json(given.value)


def ended(step: Step, end: AskedEnd, known: Asked, at: int) -> PieceEnded:
    """Return the event that ends a step by an answer, a deadline or a time. `known`: how its action is
    asked; `at`: µs UTC."""
    outputs = {name: as_json(value) for name, value in end.outputs.items()}
    missing = tuple(name for name in step.call.outputs if name not in outputs)
    return PieceEnded(
        at=at,
        call=step.call.number,
        node=step.node,
        outcome=end.outcome,
        how=end.how,
        by=end.by,
        reason=end.reason,
        outputs=outputs,
        unset=missing if end.outcome in known.hands_on else (),
    )
