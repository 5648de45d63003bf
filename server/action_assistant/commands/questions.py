"""`runs questions` and `runs answer`: what led runs ask people, and their answers."""

import argparse
from pathlib import Path
from typing import Any

from action_assistant.commands.client import Server, command, print_json, running
from action_assistant.commands.presses import press
from action_assistant.commands.runners import Gathered
from action_assistant.errors import RequestRefused
from action_assistant.safe_text import one_line


def add_questions(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add `questions` and `answer` to `commands`, the sub-commands of `runs`."""
    asks = command(
        commands, "questions", "what runs ask people now, or what one run has asked", "RUN --json"
    )
    asks.add_argument("run", nargs="?", default="", metavar="RUN", help="id of the run; else all")
    asks.add_argument("--json", action="store_true", help="as JSON, for programs")
    asks.set_defaults(handler=_questions)
    answers = command(
        commands,
        "answer",
        "answer a question of a led run: its robots may begin to move at once",
        "RUN QUESTION --yes",
    )
    answers.add_argument("run", metavar="RUN", help="id of the run")
    answers.add_argument("question", metavar="QUESTION", help="id of the question")
    given = answers.add_mutually_exclusive_group(required=True)
    given.add_argument("--yes", action="store_true", help="confirm")
    given.add_argument("--no", action="store_true", help="do not confirm")
    given.add_argument("--choice", metavar="TEXT", help="one of the choices")
    given.add_argument("--text", metavar="TEXT", help="the text that is asked for")
    given.add_argument(
        "--number", type=float, metavar="NUMBER", help="the number that is asked for"
    )
    given.add_argument("--photo", type=Path, metavar="FILE", help="a JPEG, PNG or WebP picture")
    given.add_argument("--cannot", metavar="WHY", help="there is no answer: it ends false")
    answers.add_argument(
        "--watching",
        action="append",
        default=[],
        metavar="ROBOT",
        help="you watch this robot, with its hardware stop within reach; again for each",
    )
    answers.set_defaults(handler=_answer)


def _questions(options: argparse.Namespace) -> int:
    """Run the command that lists questions to people, and return the exit code."""
    with running(options) as server:
        if not options.run:
            return _waiting(server.runners.gathered("/api/questions"), as_json=options.json)
        found = server.runner("GET", f"/api/runs/{options.run}/questions").json()
    if options.json:
        print_json(found)
        return 0
    for each in found["open"]:
        print(one_line(f"{each['id']}  {_said(each)}"))
    for each in found["closed"]:
        by = f"answered by {each['by']['name']}" if "by" in each else each["why"]
        value = f": {_shown(each['value'])}" if "value" in each else ""
        print(one_line(f"{each['question']}  {each['at']}  {each['action']}  {by}{value}"))
    return 0


def _waiting(found: Gathered, *, as_json: bool) -> int:
    """Print the questions that wait at all sites, and return the exit code."""
    questions = found.json("questions")
    if as_json:
        print_json({"questions": questions})
        return found.code
    for each in questions:
        where = f"{each['run']}  {each['question']['id']}  {each['graph_name']}"
        print(one_line(f"{where}  {_said(each['question'])}{'' if each['may'] else '  (not you)'}"))
    return found.code


def _said(question: dict[str, Any]) -> str:
    """Return an open question in one line, with what it is answered by."""
    choices = f" ({', '.join(question['choices'])})" if question.get("choices") else ""
    until = f"  until {question['deadline']}" if question.get("deadline") else ""
    moves = (
        f"  {', '.join(question['moves'])} may begin to move next" if question.get("moves") else ""
    )
    text = question["text"]
    return f"{question['action']}  {question['kind']}: {text}{choices}{until}{moves}"


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value)


def _answer(options: argparse.Namespace) -> int:
    """Run the command that answers a question, and return the exit code. Raise RequestRefused if it is
    not open any more, or the answer does not fit."""
    path = f"/api/runs/{options.run}/questions/{options.question}"
    with running(options) as server:
        asked = {"value": _value(options, server, path)}
        if options.cannot is not None:
            asked = {"cannot": options.cannot}
        if options.watching:
            asked["watching"] = dict.fromkeys(options.watching, True)
        press(server, f"{path}/answer", asked)
    print("it is answered")
    return 0


def _value(options: argparse.Namespace, server: Server, path: str) -> Any:
    """Return the value that the options name; a photo is sent first, and its id returned."""
    if options.photo is not None:
        try:
            content = options.photo.read_bytes()
        except OSError as why:
            raise RequestRefused(f"{options.photo} cannot be read: {why.strerror}.") from why
        return server.runner("POST", f"{path}/photo", content=content).json()["photo"]
    if options.yes or options.no:
        return bool(options.yes)
    given = (options.choice, options.text, options.number)
    return next((each for each in given if each is not None), None)
