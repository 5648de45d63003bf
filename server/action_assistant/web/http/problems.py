"""Errors as RFC 9457 problem details, in one shape for every route."""

import logging
import time
from http import HTTPStatus
from typing import Annotated, Any, Final

import msgspec
from litestar import Request, Response
from litestar.exceptions import HTTPException, ValidationException
from litestar.handlers import HTTPRouteHandler
from litestar.types import ExceptionHandlersMap

from action_assistant.errors import Refused, Unavailable
from action_assistant.logs import request_id
from action_assistant.safe_text import hold_names

log: Final = logging.getLogger(__name__)

_AGAIN_S: Final = 10.0

PROBLEM_JSON: Final = "application/problem+json"
#: A key of a route's `opt`: the bytes of a body that it takes, where more may come over the wire.
BODY_LIMIT_TOLD: Final = "body_limit_told"
#: The fields of most places; some errors have more.
_PLACE: Final = msgspec.Meta(
    extra_json_schema={
        "properties": {
            "path": {"type": "string", "description": "A JSON pointer into what was sent"},
            "line": {"type": "integer"},
            "column": {"type": "integer"},
        }
    }
)


class ProblemDetails(msgspec.Struct, frozen=True, omit_defaults=True):
    """The description of a refusal for a client.

    `type` is stable; `detail` is for people. `request_id` finds the lines of the log.
    """

    type: str
    title: str
    status: int
    detail: str
    where: Annotated[dict[str, Any], _PLACE] | None = None
    request_id: str | None = msgspec.field(default_factory=request_id)

    def __post_init__(self) -> None:
        hold_names(self, "detail")


def problem_of(refused: Refused) -> bytes:
    """Return the JSON body (problem details, RFC 9457) that describes a refusal."""
    return msgspec.json.encode(
        ProblemDetails(refused.type, refused.title, refused.status, refused.detail, refused.where)
    )


def problem_handlers() -> ExceptionHandlersMap:
    """Return the functions that answer for exceptions, as `Litestar(exception_handlers=…)` takes
    them."""
    return {
        Refused: _Refusals().answer,
        HTTPException: _framework,
        RecursionError: _too_deep,
        Exception: _unexpected,
    }


def _response(details: ProblemDetails, headers: dict[str, str] | None = None) -> Response[bytes]:
    return Response(
        content=msgspec.json.encode(details),
        status_code=details.status,
        media_type=PROBLEM_JSON,
        headers=headers,
    )


class _Refusals:
    """Answers and logs refusals. While a part is away the same sentence is logged once in ten
    seconds, since clients try again and again."""

    def __init__(self) -> None:
        self._away: dict[str, float] = {}  # when each sentence was logged

    def answer(self, request: Request[Any, Any, Any], error: Refused) -> Response[bytes]:
        """Return the answer to a request that was refused with this error."""
        level = logging.DEBUG if self._is_known(error) else logging.INFO
        log.log(level, "refused %s: %s", request.scope["path"], error.detail)
        return _response(
            ProblemDetails(error.type, error.title, error.status, error.detail, error.where)
        )

    def _is_known(self, error: Refused) -> bool:
        if not isinstance(error, Unavailable):
            return False
        now = time.monotonic()
        self._away = {each: at for each, at in self._away.items() if now - at < _AGAIN_S}
        return self._away.setdefault(error.detail, now) != now


def _framework(request: Request[Any, Any, Any], error: HTTPException) -> Response[bytes]:
    """Answer a refusal of Litestar itself, such as an unknown route or method, or a malformed or
    too large body."""
    phrase = HTTPStatus(error.status_code).phrase
    detail, where = _detail_and_place(request, error)
    if error.status_code >= 500:
        log.error("request failed", exc_info=error)
    slug = phrase.lower().replace(" ", "-")
    details = ProblemDetails(slug, phrase, error.status_code, detail, where)
    return _response(details, dict(error.headers or {}))


def _detail_and_place(
    request: Request[Any, Any, Any], error: HTTPException
) -> tuple[str, dict[str, Any] | None]:
    """Return a sentence about an error of Litestar, and the path of the wrong field in the body as
    `{"path": …}`, or None if there is no such field."""
    if isinstance(error, ValidationException) and isinstance(error.extra, list):
        wrong = [item for item in error.extra if isinstance(item, dict)]
        said = [
            f"{item.get('key') or 'body'}: {item.get('message', 'not valid')}" for item in wrong
        ]
        keys = [str(item["key"]) for item in wrong if item.get("key")]
        path = {"path": "/" + keys[0].replace(".", "/")} if keys else None
        return "; ".join(said) or error.detail, path
    match error.status_code:
        case HTTPStatus.NOT_FOUND:
            return f"There is nothing at {request.url.path}.", None
        case HTTPStatus.METHOD_NOT_ALLOWED:
            return f"{request.method} is not possible at {request.url.path}.", None
        case HTTPStatus.REQUEST_ENTITY_TOO_LARGE:
            return f"At most {_body_limit(request)} are read.", None
        case status if status >= 500:
            return "The server failed; its log says why.", None
    return error.detail, None


def _body_limit(request: Request[Any, Any, Any]) -> str:
    """Return, as text such as `2 MB`, the longest body that the route of a request accepts."""
    handler = request.scope.get("route_handler")
    if not isinstance(handler, HTTPRouteHandler):
        return "some bytes"
    most = handler.opt.get(BODY_LIMIT_TOLD, handler.resolve_request_max_body_size())
    if most is None:
        return "some bytes"
    return f"{most // 1_000_000} MB" if most >= 1_000_000 else f"{most // 1_000} kB"


def _too_deep(_: Request[Any, Any, Any], __: RecursionError) -> Response[bytes]:
    return _response(
        ProblemDetails("bad-input", "What was sent cannot be read", 400, "Nested too deeply.")
    )


def _unexpected(_: Request[Any, Any, Any], error: Exception) -> Response[bytes]:
    log.error("request failed", exc_info=error)
    return _response(
        ProblemDetails("internal", "The server failed", 500, "The server failed; its log says why.")
    )
