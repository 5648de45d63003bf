"""The command line: which words there are, and how every refusal becomes one sentence.

Exit codes: 0 fine, 1 the answer is no, 2 wrong use or cannot start.
"""

import argparse
import sys
from collections.abc import Sequence

from action_assistant.commands import (
    backup,
    doctor,
    files,
    maintenance,
    people,
    practice,
    processes,
    remote,
)
from action_assistant.errors import CannotStart
from action_assistant.settings import check_environment
from action_assistant.version import VERSION


def parser() -> argparse.ArgumentParser:
    """Every command with its help and an example."""
    top = argparse.ArgumentParser(
        prog="action-assistant",
        description="Design, run and review robot tasks (UMRF graphs) together, in the browser.",
        epilog="Start with: action-assistant serve",
    )
    top.add_argument("--version", action="version", version=f"action-assistant {VERSION}")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for module in (processes, files, remote, people, practice, maintenance, backup, doctor):
        module.add_to(commands)
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit code."""
    options = parser().parse_args(arguments)
    try:
        check_environment()
        code: int = options.deed(options)
    except CannotStart as error:
        print(f"action-assistant: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # somebody piped us into `head`
        sys.stderr.close()
        return 0
    return code
