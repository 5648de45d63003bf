"""The commands of people on questions of led runs: an answer, and a photo for one.

An answer is a start: it lets the next actions begin. It is checked like one, and counts at most once.
"""

from collections.abc import Awaitable, Callable
from typing import Annotated, Any, Final, NoReturn

import msgspec

from action_assistant.errors import BadInput, Conflict, Forbidden, NotFound, Refused
from action_assistant.runner.execution.asked_steps import Given, OpenQuestion, value_of
from action_assistant.runner.execution.conductors import Conductors
from action_assistant.runner.execution.led_commands import LedCommands, claim_of, operator_of
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.photos import Photos
from action_assistant.runner.runs.question_events import ClosedWhy, QuestionAsked
from action_assistant.runner.runs.question_views import WaitingQuestion, question_view
from action_assistant.runner.runs.run import Closed, Run, answer_press
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import Watching
from action_assistant.runner.start.orders import watched_in
from action_assistant.umrf.questions import WrongAnswer
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.roles import allowed

_WHY: Final[dict[ClosedWhy, str]] = {
    "lapsed": "It was asked again after 60 s: answer the question that is open now.",
    "held": "The run waited meanwhile, so it is asked again once it goes on.",
    "deadline": "Its deadline has passed.",
    "restarted": "The runner was restarted, so it is asked again once the run goes on.",
    "stopped": "It was stopped.",
}


class AnswerRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The answer to a question. `value`: true or false for a confirmation, the text of a choice, a text,
    a number, or the id of a photo that was sent for this question. `cannot`: why there is no answer,
    in place of it. `request_id`: names this press; a repeat of one that has counted changes nothing.
    `watching`: as in `StartRequest`, for the robots that may move next."""

    value: bool | float | Annotated[str, msgspec.Meta(max_length=4000)] | None = None
    cannot: Annotated[str, msgspec.Meta(max_length=1000)] = ""
    request_id: Annotated[str, msgspec.Meta(max_length=200)] = ""
    watching: Watching = {}


class PhotoStored(msgspec.Struct, frozen=True):
    """The id of a photo that was stored, with which a question is answered."""

    photo: str


class QuestionCommands:
    """Carries out what people do with questions. `led`: the other commands on led runs; `find` finds any
    run, `open_runs` returns those that are open."""

    def __init__(
        self,
        conductors: Conductors,
        led: LedCommands,
        *,
        find: Callable[[str], Awaitable[Run]],
        open_runs: Callable[[], list[Run]],
    ) -> None:
        self._conductors = conductors
        self._led = led
        self._find = find
        self._open_runs = open_runs

    async def answer(
        self,
        run: str,
        question: str,
        asked: AnswerRequest,
        author: Author,
        identity: Identity | None = None,
    ) -> Run:
        """Take the answer of a person to a question, and store it; return the run. A repeat of a request
        that was carried out changes nothing. Raise NotFound if there is no such run or question, Conflict
        if the question is not open any more, with who answered first; BadInput if the answer does not fit,
        Forbidden or Conflict if the author may not answer it, OutcomeUnknown if it is not stored within
        5 s."""
        cannot = asked.cannot.strip()
        if asked.value is None and not cannot:
            raise BadInput("There is no answer.", where={"path": "/value"})
        given = Given(by=author, value=asked.value, cannot=cannot, request_id=asked.request_id)
        press = answer_press(author, question, value_of(given))
        async with self._conductors.once(run, asked.request_id):
            found = await self._led.repeated(run, asked.request_id, press)
            if found is not None:
                await self._conductors.answers_stored(run)
                return found
            known = await self._open_one(run, question, author)
            now = await self._find(run)
            self._require(now, known.event, author, identity, asked.watching)
            try:
                await self._conductors.answer(run, known, given)
            except WrongAnswer as wrong:
                raise BadInput(str(wrong), where={"path": "/value"}) from wrong
            except Conflict:  # closed since it was looked at, in the same step
                await self._refuse(run, question, author)
            return await self._find(run)

    async def require_photo(
        self, run: str, question: str, author: Author, identity: Identity | None = None
    ) -> None:
        """Raise what `answer` would raise if the question takes no photo of this person now."""
        known = await self._open_one(run, question, author)
        self._require(await self._find(run), known.event, author, identity, None)
        if known.event.asks.kind != "photo":
            raise Conflict("This question wants no photo.", where={"path": "/question"})

    async def send_photo(
        self,
        run: str,
        question: str,
        content: bytes,
        photos: Photos,
        author: Author,
        identity: Identity | None = None,
    ) -> PhotoStored:
        """Store a photo for a question, with which it can be answered then. Raise as `answer` does, BadInput
        if it is no photo, TooLarge if there are too many."""
        await self.require_photo(run, question, author, identity)
        photo = await photos.store(run, content)
        try:
            known = await self._open_one(run, question, author)  # it may have closed meanwhile
        except Refused:
            if (await self._find(run)).end is not None:
                await photos.sweep(run)
            raise
        self._conductors.add_photo(run, known, photo)
        return PhotoStored(photo)

    def waiting(self, identity: Identity, hides: Callable[[Run], bool]) -> list[WaitingQuestion]:
        """Return the open questions of all runs that a person may see, the oldest first. `hides`: says
        whether they may not see a run."""
        found = [
            self._waiting(run, each, identity)
            for run in self._open_runs()
            if run.questions and not hides(run)
            for each in run.questions.values()
        ]
        return sorted(found, key=lambda each: each.question.asked_at)

    def _waiting(self, run: Run, asked: QuestionAsked, identity: Identity) -> WaitingQuestion:
        why = _why_not(asked, identity) or self._led.why_refused(asked.moves, identity)
        if not why and not run.simulated and not allowed(identity.person.role, "operate"):
            why = "Whoever answers has to be allowed to run graphs on robots."
        return WaitingQuestion(
            run=run.id,
            number=run.number,
            graph=run.graph,
            graph_name=run.graph_name,
            simulated=run.simulated,
            question=question_view(run, asked),
            may=not why,
            why=why,
        )

    def _require(
        self,
        run: Run,
        asked: QuestionAsked,
        author: Author,
        identity: Identity | None,
        watching: Watching | None,
    ) -> None:
        """Raise Forbidden or Conflict unless a person may answer a question. `watching`: None if it is not
        answered yet, so that nobody has to say that they watch a robot."""
        if why := _why_not(asked, identity or operator_of(author)):
            raise Forbidden(why)
        if not asked.moves:
            return
        watched = None if watching is None else watched_in(watching, run.robots)
        claim = None if watched is None else claim_of(run, watched)
        self._led.require_robots(asked.moves, author, identity, claim)

    async def _open_one(self, run: str, question: str, author: Author) -> OpenQuestion:
        known = self._conductors.question(run, question)
        if known is None:
            await self._refuse(run, question, author)
        return known

    async def _refuse(self, run: str, question: str, author: Author) -> NoReturn:
        """Raise Conflict that says what became of a question, or NotFound if there is none. What it says
        is stored."""
        found = await self._find(run)
        closed = next((each for each in found.closed if each.question == question), None)
        if question in found.questions:
            raise Conflict("This question is just being closed.", where={"path": "/question"})
        if closed is None:
            raise NotFound("There is no such question in this run, or it was asked long ago.")
        await self._conductors.answers_stored(run)
        text, where = _told(closed)
        self._conductors.refuse_answer(run, question, closed.node, author, text)
        raise Conflict(text, where={"path": "/question", "question": question, **where})


def _why_not(asked: QuestionAsked, by: Identity) -> str:
    """Return why a person is not among those who are asked; "" if they are."""
    if by.token is not None:
        return "A program's token may not answer: it takes a person."
    if asked.to and asked.to != by.person.id and asked.to not in by.groups:
        return f"{asked.role or 'Somebody else'} is asked, and that is not you."
    return ""


def _told(closed: Closed) -> tuple[str, dict[str, Any]]:
    """Return what became of a question, in words and for programs."""
    at = time(closed.at)
    if closed.by is not None:
        who = closed.by.name or "Somebody else"
        value = msgspec.json.decode(closed.value) if closed.value else None
        by = msgspec.to_builtins(closed.by)
        text = f"{who} has answered {closed.node} already, at {at:%H:%M:%S} UTC."
        return text, {"answered_by": by, "at": at.isoformat(), "value": value}
    assert closed.why is not None
    text = f"This question of {closed.node} is not open any more. {_WHY[closed.why]}"
    return text, {"why": closed.why, "at": at.isoformat()}
