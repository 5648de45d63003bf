"""Commands for archives of runs: `runs archive`, `runs restore`."""

import argparse
import sys
from pathlib import Path

from action_assistant import paths, settings
from action_assistant.commands.client import No, Server, command, refused, running
from action_assistant.errors import CannotStart, Refused


def add_to(runs: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the commands of this module to `runs`."""
    archive = command(
        runs,
        "archive",
        "put what is old into archives, prove them, and delete it here; pinned runs stay",
        "--runs 90 --raw 14",
    )
    archive.add_argument("--runs", type=_days, metavar="DAYS", help="runs that ended longer ago")
    archive.add_argument("--raw", type=_days, metavar="DAYS", help="raw messages of robots")
    archive.add_argument(
        "--check", action="store_true", help="only prove every archive of the folder; no server"
    )
    archive.set_defaults(handler=_archive)

    restore = runs.add_parser(
        "restore",
        help="prove archives of runs and put them where the runner looks for them",
        epilog="example: action-assistant runs restore run-000042-AbC.jsonl.gz --data ./data",
    )
    restore.add_argument("files", type=Path, nargs="+", metavar="FILE")
    restore.add_argument(
        "--data", type=Path, default=paths.data(), metavar="DIR", help="default: %(default)s"
    )
    restore.set_defaults(handler=_restore)


def _days(text: str) -> float:
    days = float(text)
    if not 0 <= days < 1e6:
        raise ValueError
    return days


def _archive(options: argparse.Namespace) -> int:
    if options.check:
        return _check(settings.keep(options.data.resolve()).folder)
    if options.runs is None and options.raw is None:
        raise CannotStart("Say how old what goes may be: --runs DAYS, --raw DAYS, or both.")
    with running(options) as server:
        try:
            return _sweep(server, {"runs": options.runs, "raw": options.raw})
        except No as error:
            return refused(error)


def _sweep(server: Server, ages: dict[str, float | None]) -> int:
    runs = hours = 0
    problems: dict[str, None] = {}
    more = True
    while more:
        told = server.runner("POST", "/api/archive", json=ages).json()
        runs, hours, more = runs + told["runs"], hours + told["raw"], told["more"]
        problems |= dict.fromkeys(told["problems"])
        if more:
            print(f"{runs} runs so far", file=sys.stderr)
    print(f"{runs} runs and {hours} hours of raw messages are in archives now")
    for problem in problems:
        print(problem, file=sys.stderr)
    return 1 if problems else 0


def _check(folder: Path) -> int:
    from action_assistant.runner.archives import archive_file

    found = sorted(folder.glob("runs/**/*.jsonl.gz"))
    damaged = 0
    for path in found:
        try:
            for _ in archive_file.read(path):
                pass
        except (Refused, OSError) as error:
            damaged += 1
            print(error.detail if isinstance(error, Refused) else f"{path}: {error.strerror}")
    print(f"{len(found) - damaged} archives in {folder} are sound, {damaged} are not")
    return 1 if damaged else 0


def _restore(options: argparse.Namespace) -> int:
    from action_assistant.runner.archives import archive_file

    folder = settings.keep(options.data.resolve()).folder
    code = 0
    for path in options.files:
        try:
            place = archive_file.title_of(path).place
            events = sum(1 for _ in archive_file.read(path))
            archive_file.put(path, folder / place)
        except (Refused, OSError) as error:
            text = error.detail if isinstance(error, Refused) else f"{path}: {error.strerror}"
            code = refused(No(text))
            continue
        print(f"{place}: {events} events, all of them sound")
    return code
