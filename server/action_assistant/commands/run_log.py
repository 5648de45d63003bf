"""`runs log`: what the engine of a run has logged about it."""

import argparse
from collections.abc import Iterable, Iterator
from typing import Any, Final

import msgspec

from action_assistant.commands.client import command, print_json, running
from action_assistant.safe_text import one_line

_LEVELS: Final = ("debug", "info", "warn", "error", "fatal")


def add_log(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add `log` to `commands`, the sub-commands of `runs`."""
    parser = command(
        commands,
        "log",
        "the lines of its engine's log about a run, oldest first",
        "RUN --level warn",
    )
    parser.add_argument("run", metavar="RUN", help="id of the run, or of a piece of it")
    parser.add_argument(
        "--level",
        choices=_LEVELS,
        default="debug",
        help="from this level on; lines whose level is unknown are always listed (default: %(default)s)",
    )
    parser.add_argument("--json", action="store_true", help="as JSON, for programs")
    parser.set_defaults(handler=_log)


def _log(options: argparse.Namespace) -> int:
    """Run the command, and return the exit code."""
    with running(options) as server:
        export = server.runner("GET", f"/api/runs/{options.run}/export", params={"format": "jsonl"})
    found = list(lines_from(export.content.splitlines(), options.level))
    if options.json:
        print_json(found)
        return 0
    for each in found:
        print(one_line(f"{each['at']}  {each.get('level', 'level unknown'):<13}  {each['text']}"))
    return 0


def lines_from(events: Iterable[bytes], level: str) -> Iterator[dict[str, Any]]:
    """Yield the lines of the engine's log among exported events (lines of JSON), those of `level` and
    above and those of an unknown level."""
    least = _LEVELS.index(level)
    for each in events:
        event = msgspec.json.decode(each)
        if event["kind"] != "run.engine_said.v1":
            continue
        said = event["body"].get("level", "")
        if said in _LEVELS[:least]:
            continue
        yield {
            "at": event["at"],
            "text": event["body"]["text"],
            **({"level": said} if said else {}),
        }
