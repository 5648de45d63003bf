"""The words of the command line."""

import importlib
import subprocess
import sys
from collections import defaultdict
from typing import Final

import pytest

from action_assistant.cli import COMMANDS, main, parser

#: Modules that no command on files needs, and that take long to import.
SLOW: Final = frozenset(
    {
        "alembic",
        "asyncio",
        "cryptography",
        "email",
        "httpx",
        "litestar",
        "pycrdt",
        "sqlalchemy",
        "uvicorn",
    }
)


def test_every_command_is_where_the_list_says() -> None:
    named = defaultdict(set)
    for name, command in COMMANDS.items():
        named[command.module].add(name)
    modules = {
        name: importlib.import_module(f"action_assistant.commands.{name}").COMMANDS
        for name in named
    }
    assert {name: set(found) for name, found in modules.items()} == named


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_a_line_in_the_list_and_an_example(
    command: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "1000")
    assert f"    {command}" in parser().format_help()
    assert COMMANDS[command].help in parser().format_help()
    with pytest.raises(SystemExit) as ended:
        main([command, "--help"])
    assert ended.value.code == 0
    shown = capsys.readouterr().out
    assert shown.startswith(f"usage: action-assistant {command} [-h]")
    assert f"example: action-assistant {command} " in shown
    assert (COMMANDS[command].help in shown) >= COMMANDS[command].described


@pytest.mark.parametrize(
    "words", [["--help"], ["--version"], ["no-command"], ["check", "no-file"], ["check", "--help"]]
)
def test_commands_on_files_load_no_server(words: list[str]) -> None:
    wanted = SLOW - {"email"} if words == ["--version"] else SLOW
    shown = subprocess.run(
        [
            sys.executable,
            "-c",
            "import atexit, sys; from action_assistant.__main__ import main\n"
            f"atexit.register(lambda: print('loaded', sorted({set(wanted)!r} & {{*sys.modules}})))\n"
            "main()",
            *words,
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert shown.stdout.endswith("loaded []\n"), shown.stdout + shown.stderr


@pytest.mark.parametrize("command", ["graphs", "stop", "run"])
def test_commands_that_ask_a_server_load_none(command: str) -> None:
    shown = subprocess.run(
        [
            sys.executable,
            "-c",
            "import sys; from action_assistant.cli import parser\n"
            f"parser().parse_args([{command!r}, *sys.argv[1:]])\n"
            "print({'litestar', 'sqlalchemy', 'alembic', 'pycrdt', 'uvicorn'} & {*sys.modules})",
            *([] if command == "graphs" else ["x"]),
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    assert shown.stdout == "set()\n"
