"""Reads the answers of a server: their JSON, and why a request was refused."""

from typing import TYPE_CHECKING, TypeVar

import msgspec

from action_assistant.errors import CannotStart

if TYPE_CHECKING:
    import httpx

T = TypeVar("T")


def decoded(answer: "httpx.Response", kind: type[T]) -> T:
    """Decode the JSON body of an answer as this type. Raise CannotStart for a server whose answers
    have another form."""
    try:
        return msgspec.json.decode(answer.content, type=kind)
    except (ValueError, RecursionError) as error:
        raise CannotStart(
            f"{answer.request.url} answers in another form than this version expects ({error})."
        ) from error


def kind_of(answer: "httpx.Response") -> str:
    """Return the type of a refusal; an empty text if the body is no refusal of this program."""
    try:
        return str(answer.json()["type"])
    except (ValueError, KeyError, TypeError):
        return ""


def sentence(answer: "httpx.Response") -> str:
    """Return title and detail of a refusal in one line, with the place in the request if it names
    one. If the body is no refusal of this program, return the URL and the status code."""
    try:
        problem = answer.json()
        place = (problem.get("where") or {}).get("path", "")
        return f"{problem['title']}: {problem['detail']}" + (f" (at {place})" if place else "")
    except (ValueError, KeyError, AttributeError):
        return f"{answer.request.url} answered {answer.status_code}."
