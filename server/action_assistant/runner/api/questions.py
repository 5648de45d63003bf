"""The routes for questions to people: which wait, an answer, a photo."""

from typing import Any, Final

import msgspec
from litestar import Request, Response, get, post
from litestar.types import ControllerRouterHandler

from action_assistant.runner.api.caller import author_of, bytes_of
from action_assistant.runner.api.refused_starts import StartNeeds, noted
from action_assistant.runner.api.run_guard import require_command_role, unseen_by
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.execution.question_commands import AnswerRequest, PhotoStored
from action_assistant.runner.runs import photos, views
from action_assistant.runner.runs.question_views import (
    QuestionsShown,
    WaitingQuestion,
    questions_view,
)
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sight import run_graphs
from action_assistant.runner.start.admission import decoded
from action_assistant.umrf.questions import LARGEST_PHOTO
from action_assistant.web.audit.events import StartRefused
from action_assistant.web.auth.access import Needs, PersonOnly, identity_of
from action_assistant.web.server.openapi import FileBytes, answer, reads

_Asking = Request[Any, Any, Any]
#: A photo is nothing but a picture, whoever opens its address.
_PICTURE: Final = {
    "content-security-policy": "default-src 'none'; sandbox",
    "content-disposition": "inline",
    "cache-control": "private, max-age=31536000, immutable",
}


class Waiting(msgspec.Struct, frozen=True):
    """The open questions of all runs that the reader may see, the oldest first."""

    questions: list[WaitingQuestion]


def routes(services: RunnerServices) -> list[ControllerRouterHandler]:
    """Return the routes: the questions that wait, those of a run, answers and photos."""

    @get(
        "/api/questions",
        operation_id="waitingQuestions",
        summary="The questions to people that wait for an answer, in all runs",
        guards=[Needs("see")],
    )
    async def waiting(request: _Asking) -> Waiting:
        unseen = unseen_by(services, request)

        def hides(run: Run) -> bool:
            return unseen is not None and unseen.hides(run_graphs(run))

        found = services.control.questions.waiting(identity_of(request), hides)
        return Waiting(found)

    @get(
        "/api/runs/{run:str}/questions",
        operation_id="runQuestions",
        summary="The questions of a run: those that are open, the others, and its waits",
        guards=[Needs("see")],
    )
    async def of_run(run: str) -> QuestionsShown:
        return questions_view(await services.control.find(run))

    @post(
        "/api/runs/{run:str}/questions/{question:str}/answer",
        operation_id="answerQuestion",
        description="Of people only. 409 for a question that is not open any more: `where` has "
        "`answered_by`, `at` and `value`, or `why` (`lapsed`, `held`, `deadline`, `restarted`, "
        "`stopped`).",
        status_code=200,
        summary="Answer a question: a robot may begin to move",
        opt=reads(AnswerRequest),
        guards=[StartNeeds(services, "answer", of_people=True)],
    )
    async def answered(run: str, question: str, request: _Asking) -> views.RunShown:
        asked = decoded(await request.body(), AnswerRequest)
        with noted(services, request, StartRefused(what="answer", why="", run=run[:100])):
            await require_command_role(services, run, request)
            me = identity_of(request)
            found = await services.control.questions.answer(
                run, question, asked, author_of(request), me
            )
            return views.run_view(found)

    @post(
        "/api/runs/{run:str}/questions/{question:str}/photo",
        operation_id="sendPhoto",
        description="At most 8 MB, stored as it is; the answer is `{photo}`, the id to answer with."
        " Refused once the question is not open.",
        status_code=200,
        summary="Send a photo for a question, as the bytes of a JPEG, PNG or WebP file",
        request_max_body_size=LARGEST_PHOTO,
        opt=reads(FileBytes),
        guards=[PersonOnly(), Needs("simulate")],
    )
    async def photo(run: str, question: str, request: _Asking) -> PhotoStored:
        await require_command_role(services, run, request)
        author, me = author_of(request), identity_of(request)
        commands = services.control.questions
        await commands.require_photo(run, question, author, me)  # before it is read
        async with bytes_of(request, services.body_limit) as body:
            return await commands.send_photo(run, question, body, services.photos, author, me)

    @get(
        "/api/runs/{run:str}/photos/{photo:str}",
        operation_id="runPhoto",
        summary="A photo that a person has sent as an answer",
        guards=[Needs("see")],
        responses={200: answer(FileBytes, media="image/*")},
    )
    async def picture(run: str, photo: str) -> Response[bytes]:
        content = await services.photos.read(run, photo)
        media = photos.MEDIA_TYPES[photo.rpartition(".")[2]]
        return Response(content, media_type=media, headers=_PICTURE)

    return [waiting, of_run, answered, photo, picture]
