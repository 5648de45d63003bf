"""The command line: which words there are, and how every refusal becomes one sentence.

Exit codes: 0 fine, 1 the answer is no, 2 wrong use or cannot start.
"""

import argparse
import importlib
import sys
from collections.abc import Mapping, Sequence
from typing import Final

from action_assistant.errors import CannotStart
from action_assistant.safe_text import make_streams_printable
from action_assistant.settings import check_environment, hide_password
from action_assistant.version import VERSION

_MODULES: Final = (
    "processes",
    "files",
    "remote",
    "watch.watch",
    "people",
    "simulate_robot",
    "maintenance",
    "backups.backup",
    "doctor",
)
#: Commands that are started often, and need nothing of the other modules.
_ALONE: Final[Mapping[str, str]] = {
    "serve": "processes",
    "editor": "processes",
    "runner": "processes",
    "check": "files",
    "convert": "files",
    "simulate": "files",
    "simulate-robot": "simulate_robot",
    "watch": "watch.watch",
}


def parser(command: str = "") -> argparse.ArgumentParser:
    """Every command with its help and an example. With a `command`, the others may be missing:
    importing them all takes most of a second."""
    top = argparse.ArgumentParser(
        prog="action-assistant",
        description="Design, run and review robot tasks (UMRF graphs) together, in the browser.",
        epilog="Start with: action-assistant serve",
    )
    top.add_argument("--version", action="version", version=f"action-assistant {VERSION}")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name in (_ALONE[command],) if command in _ALONE else _MODULES:
        importlib.import_module(f"action_assistant.commands.{name}").add_to(commands)
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit code."""
    make_streams_printable()
    if arguments is None:
        hide_password()
    asked = sys.argv[1:] if arguments is None else arguments
    options = parser(asked[0] if asked else "").parse_args(asked)
    try:
        check_environment()
        code: int = options.handler(options)
    except CannotStart as error:
        print(f"action-assistant: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # somebody piped us into `head`
        sys.stderr.close()
        return 0
    return code
