"""`runs second-person`: the starts for which people ask others for their yes, in words, and the yes."""

import argparse
from typing import TYPE_CHECKING, Any

from action_assistant.commands.client import command, print_json, running
from action_assistant.errors import RequestRefused
from action_assistant.safe_text import one_line

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

_SHOWN = 12  # characters of a digest


def add_second_person(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command to `commands`, the sub-commands of `runs`."""
    asks = command(
        commands,
        "second-person",
        "the starts of a graph for which people ask others for their yes; say yes to one of them",
        "GRAPH --yes 3f2a9c0b1d4e",
    )
    asks.add_argument("graph", metavar="GRAPH", help="its name or id")
    asks.add_argument(
        "--yes",
        metavar="DIGEST",
        help="you have read all of this order: somebody else may start exactly that",
    )
    asks.add_argument("--json", action="store_true", help="as JSON, for programs")
    asks.set_defaults(handler=_second_person)


def _second_person(options: argparse.Namespace) -> int:
    """Run the command, and return the exit code."""
    with running(options) as server:
        graph = server.graph_id(options.graph)
        query = {"graph": graph}
        found = server.runners.gathered("/api/approvals/asked", params=query)
        asked = found.json()
        if options.yes is not None:
            versions = server.editor("GET", f"/api/graphs/{graph}/versions").json()
            trees = {each["tree_digest"] or each["digest"] for each in versions}
            body = {"digest": _digest_in(asked, options.yes, trees), "graph": graph}
            server.runners.tell("POST", "/api/approvals", json=body)
            print(f"said yes to exactly {body['digest'][:_SHOWN]}")
            return found.code
    if options.json:
        print_json(asked)
        return found.code
    for each in asked:
        _print(each)
    return found.code


def _digest_in(asked: "Sequence[dict[str, Any]]", prefix: str, trees: "Collection[str]") -> str:
    """Return the digest of the one question that a person names by its beginning. `trees`: the digests
    of all versions of the graph. Raise RequestRefused if there is no such question, its words are not
    known, or it is about none of these versions."""
    found = {each["digest"]: each for each in asked if each["digest"].startswith(prefix)}
    if len(prefix) < _SHOWN or len(found) != 1:
        raise RequestRefused(f"{prefix!r} names no one question here; it has {_SHOWN} characters.")
    ((digest, question),) = found.items()
    if not question["order"]:
        raise RequestRefused("What is asked is not known in words: look at the start yourself.")
    if question["tree_digest"] not in trees:
        raise RequestRefused("What is asked is no version of this graph, whoever says so.")
    return str(digest)


def _print(question: "dict[str, Any]") -> None:
    who, robots = question["author"]["name"] or "somebody", ", ".join(question["robots"])
    digest = question["digest"][:_SHOWN] or "-"
    print(one_line(f"{digest}  {who} asks for {robots}  {question['at']}"))
    for line in question["order"]:
        print(one_line(f"  {line['what']}: {line['text']}"))
    if question.get("hidden"):
        print(one_line(f"  {question['hidden']}"))
    elif not question["order"]:
        print("  What is asked is not known in words: look at the start yourself.")
