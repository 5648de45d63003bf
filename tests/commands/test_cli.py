"""The words of the command line."""

import argparse
import subprocess
import sys

import pytest

from action_assistant.cli import _ALONE, parser


def help_of(top: argparse.ArgumentParser, command: str) -> str:
    (commands,) = (each for each in top._actions if isinstance(each.choices, dict))
    assert isinstance(commands.choices, dict)
    text: str = commands.choices[command].format_help()
    return text


@pytest.mark.parametrize("command", _ALONE)
def test_a_command_is_the_same_whether_or_not_the_others_are_there(command: str) -> None:
    assert help_of(parser(command), command) == help_of(parser(), command)


def test_a_file_is_checked_without_loading_a_server() -> None:
    shown = subprocess.run(
        [
            sys.executable,
            "-c",
            "import sys; from action_assistant.cli import parser; parser('check');"
            "print({'litestar', 'sqlalchemy', 'alembic'} & {*sys.modules})",
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    assert shown.stdout == "set()\n"
