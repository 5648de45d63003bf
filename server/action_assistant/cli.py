"""The command line: which words there are, and how every refusal becomes one sentence.

Exit codes: 0 fine, 1 the answer is no, 2 wrong use or cannot start.
"""

import argparse
import importlib
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple

from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.logs import say
from action_assistant.safe_text import make_streams_printable
from action_assistant.settings import (
    check_environment,
    hide_password,
    hide_target_password,
    take_secrets_from_files,
)


class CommandEntry(NamedTuple):
    """One word of the command line. `module`: its module in COMMANDS, with the function that adds
    its arguments and handler. `described`: its own help begins with the same words. `diagnoses`:
    it checks settings by itself. `posix`: it needs Linux or macOS."""

    module: str
    help: str
    described: bool = False
    diagnoses: bool = False
    posix: bool = False


#: Every command; `--help` lists them in this order. Only the module of the one that is asked for is
#: imported: all of them together take more than a second.
COMMANDS: Final[Mapping[str, CommandEntry]] = {
    "serve": CommandEntry(
        "processes", "start the editor and the runner, and open the page", posix=True
    ),
    "editor": CommandEntry("processes", "the editor alone: graphs, versions, the page", posix=True),
    "runner": CommandEntry(
        "processes", "the runner alone, the side of the robots: runs and Stop", posix=True
    ),
    "migrate": CommandEntry(
        "databases.migrate",
        "bring the databases of a data folder to this version, or back to a copy from before",
        posix=True,
    ),
    "check": CommandEntry("files", "say what is wrong with UMRF files; exit 1 if any has an error"),
    "convert": CommandEntry("files", "print a file of any dialect as canonical UMRF"),
    "simulate": CommandEntry("files", "run a file in the simulator, without a server or a robot"),
    "flatten": CommandEntry(
        "flatten",
        "make one graph of a graph and its sub-graphs; exit 1 if it would not do the same",
        described=True,
    ),
    "package": CommandEntry(
        "packages.package", "write C++ packages of actions, as the engine loads them"
    ),
    "builds": CommandEntry(
        "builds",
        "show errors of the last `colcon build` at the actions of the library; exit 1 if any failed",
        described=True,
    ),
    "import": CommandEntry(
        "import_files",
        "bring UMRF files in: graphs, and actions, which go into the library",
        described=True,
    ),
    "diff": CommandEntry(
        "diff", "say what differs between two graphs: files, moments, versions", described=True
    ),
    "export": CommandEntry("remote", "print a graph as UMRF", described=True),
    "graphs": CommandEntry("remote", "list the graphs", described=True),
    "folders": CommandEntry("folders", "folders of graphs: list, new, rename, move, remove, put"),
    "rights": CommandEntry(
        "graph_rights",
        "who may see and who may edit a graph, or the graphs in a folder",
        described=True,
    ),
    "drafts": CommandEntry("drafts", "drafts of a graph: list, new, merge", described=True),
    "runs": CommandEntry("runs", "list the runs, newest first", described=True),
    "queue": CommandEntry("queue", "list what waits for robots, in its order", described=True),
    "release": CommandEntry(
        "remote", "release a version, or withdraw that: robots may take no other"
    ),
    "run": CommandEntry(
        "remote",
        "publish a graph as it is now, start it and wait for its end; exit 1 if it does not "
        "finish, or is known to have ended otherwise than true",
        described=True,
    ),
    "stop": CommandEntry(
        "stop", "stop a run, or all of them; exit 1 unless it is proven", described=True
    ),
    "sync": CommandEntry(
        "sync.sync",
        "keep a folder of UMRF files and the graphs of a server in step",
        described=True,
    ),
    "watch": CommandEntry(
        "watch", "print each change of a graph as it comes, until Ctrl-C", described=True
    ),
    "link": CommandEntry(
        "people", "print the link that signs the owner in, of a server that runs", described=True
    ),
    "people": CommandEntry(
        "people", "persons and links that let people in: list, link, end, invite, revoke"
    ),
    "login": CommandEntry(
        "logins",
        "sign in to a server elsewhere: a person confirms a code on its page",
        described=True,
    ),
    "logout": CommandEntry(
        "logins", "revoke the token that `login` stored, and delete it", described=True
    ),
    "tokens": CommandEntry("logins", "tokens of programs: list, make, revoke, stored"),
    "robots": CommandEntry(
        "robots",
        "robots that the runner reaches over ROS 2: list, add, remove, rights, baton, lock, unlock",
        described=True,
    ),
    "simulate-robot": CommandEntry(
        "simulate_robot", "a robot that behaves like a real engine, on ROS 2, to practise with"
    ),
    "audit": CommandEntry(
        "audit",
        "who did what, when and from where, in both logs; `audit verify` proves them",
        described=True,
        posix=True,
    ),
    "incident": CommandEntry(
        "incident",
        "keep a run from being archived, and write all that is known of it into one file",
        described=True,
    ),
    "service": CommandEntry(
        "services.service",
        "serve whenever the computer runs, by systemd: install, uninstall, status, upgrade",
        diagnoses=True,
        posix=True,
    ),
    "verify": CommandEntry(
        "maintenance",
        "look whether the logs are sound; with a line that is kept elsewhere also whether somebody has "
        "altered them and made their chain anew",
        posix=True,
    ),
    "rebuild": CommandEntry(
        "maintenance",
        "make the tables of graphs, versions, people, runs and robots again from the events",
        posix=True,
    ),
    "backup": CommandEntry(
        "backups.backup",
        "write a checked copy of everything into one file, also while it is in use",
        posix=True,
    ),
    "restore": CommandEntry(
        "backups.backup",
        "put a backup in the place of what is there; open pages notice and ask",
        posix=True,
    ),
    "move": CommandEntry(
        "databases.move",
        "take the graphs of a data folder to Postgres, or back; the runs stay where they are",
        posix=True,
    ),
    "doctor": CommandEntry(
        "doctor.command",
        "look what is wrong: ROS 2, robots, folders, databases, ports, the page",
        diagnoses=True,
    ),
}

#: An id of a run by `secrets.token_urlsafe(9)` that begins with a dash.
_DASHED_ID: Final = re.compile(r"-[A-Za-z0-9_][A-Za-z0-9_-]{10}")


class _CommandParser(argparse.ArgumentParser):
    """The parser of one command, which gets its arguments when it is first used."""

    complete: Callable[[], None] | None = None

    def parse_known_args(self, *args: Any, **more: Any) -> Any:
        """Parse the arguments of a command, after its options were added to the parser."""
        if self.complete is not None:
            self.complete()
            self.complete = None
        return super().parse_known_args(*args, **more)


class _ShowVersion(argparse.Action):
    """`--version`. Finding out which was installed takes longer than all the rest of this module."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from action_assistant.version import described

        print(f"action-assistant {described()}")
        parser.exit()


def parser() -> argparse.ArgumentParser:
    """Return the parser of all commands, with help and an example each."""
    top = argparse.ArgumentParser(
        prog="action-assistant",
        description="Design, run and review robot tasks (UMRF graphs) together, in the browser.",
        epilog="Start with: action-assistant serve",
    )
    top.add_argument(
        "--version",
        action=_ShowVersion,
        nargs=0,
        help="show program's version number and exit",
    )
    commands = top.add_subparsers(
        dest="command", required=True, metavar="COMMAND", parser_class=_CommandParser
    )
    for name, command in COMMANDS.items():
        described = command.help if command.described else None
        below = commands.add_parser(name, help=command.help, description=described)
        below.complete = lambda name=name, below=below: _complete(name, below)
    return top


def _complete(name: str, parser: argparse.ArgumentParser) -> None:
    module = importlib.import_module(f"action_assistant.commands.{COMMANDS[name].module}")
    module.COMMANDS[name](parser)


def _with_ids_last(arguments: Sequence[str]) -> list[str]:
    """Return the words of a command line with ids of runs that begin with a dash moved behind `--`,
    so that argparse does not refuse a Stop as an unknown option. Earlier versions made such ids."""
    ids = [each for each in arguments if _DASHED_ID.fullmatch(each)]
    if not ids or "--" in arguments:
        return [*arguments]
    return [*(each for each in arguments if each not in ids), "--", *ids]


def _check(entry: CommandEntry, name: str) -> None:
    """Raise CannotStart if the command `name` cannot run on this system or the environment has an
    error; load secrets from the files that variables name."""
    if entry.posix and sys.platform == "win32":
        raise CannotStart(
            f"`{name}` needs Linux or macOS: on Windows use WSL, or a server elsewhere. Files can be "
            "checked, converted, simulated and packaged here, and commands reach a server "
            "(docs/installing.md)."
        )
    if not entry.diagnoses:
        check_environment()
        take_secrets_from_files()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command that `arguments` name, and return its exit code, 2 if it cannot start.
    Without `arguments` it takes the words of the command line, and hides passwords in them."""
    make_streams_printable()
    if arguments is None:
        hide_password()
        hide_target_password()
    words = _with_ids_last(sys.argv[1:] if arguments is None else arguments)
    try:
        if words and words[0] in COMMANDS:
            _check(COMMANDS[words[0]], words[0])
        options = parser().parse_args(words)
        code: int = options.handler(options)
    except CannotStart as error:
        say(str(error), "error")
        return 2
    except RequestRefused as error:
        say(str(error), "error")
        return 1
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # the output goes to a program that has ended, such as `head`
        sys.stderr.close()
        return 0
    return code
