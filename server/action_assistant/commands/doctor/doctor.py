"""`doctor`: says in plain sentences what is wrong with this installation, and what to do about it."""

import argparse
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

import msgspec

from action_assistant import paths as places
from action_assistant import settings
from action_assistant.commands.doctor.examination import Check, examine
from action_assistant.commands.doctor.installation import Installation
from action_assistant.commands.doctor.ros_checks import (
    ROBOTS_S,
    engines_index_once,
    look_here,
    robots_answer,
)
from action_assistant.commands.processes import port_number
from action_assistant.errors import CannotStart
from action_assistant.safe_text import one_line
from action_assistant.system.diagnostics import Diagnostic, Severity

_SIGNS: Final[dict[Severity, str]] = {"fine": "✓", "warning": "·", "error": "✗"}


def _add_doctor(doctor: argparse.ArgumentParser) -> None:
    doctor.epilog = (
        "example: action-assistant doctor --data ./data; exit code 1 if something is wrong"
    )
    doctor.add_argument(
        "--data", type=Path, default=places.data(), metavar="DIR", help="default: %(default)s"
    )
    doctor.add_argument(
        "--database",
        metavar="URL",
        help="of the editor; default: the one that was served last",
    )
    doctor.add_argument("--host", default="127.0.0.1", metavar="H", help="default: %(default)s")
    doctor.add_argument(
        "--port",
        type=port_number,
        metavar="N",
        help="of the editor; default: ACTION_ASSISTANT_PORT",
    )
    doctor.add_argument(
        "--public-url", metavar="URL", help="where a proxy shows the page; it is asked there"
    )
    doctor.add_argument(
        "--only", choices=("machine", "ros"), help="look at one side of it only; default: at both"
    )
    doctor.add_argument(
        "--json", action="store_true", help="print what is wrong as JSON, and nothing else"
    )
    doctor.add_argument("--here", action="store_true", help=argparse.SUPPRESS)  # with this Python
    doctor.set_defaults(handler=_doctor)


COMMANDS: Final = {"doctor": _add_doctor}


def _doctor(options: argparse.Namespace) -> int:
    with suppress(CannotStart):  # told as a finding
        settings.take_secrets_from_files()
    port = Installation.port_of_settings() if options.port is None else options.port
    place = Installation(
        data=options.data.absolute(),
        database=options.database or settings.database(),
        host=options.host,
        port=port,
        public_url=options.public_url,
    )
    if options.here:
        print(msgspec.json.encode(look_here(place)).decode())
        return 0
    seen: list[Diagnostic] = []
    for each in _looked_at(place, options.only):
        seen.append(each)
        if not options.json:
            _tell(each)
    wrong = [each for each in seen if each.severity != "fine"]
    if options.json:
        print(msgspec.json.encode(wrong).decode())
    return 1 if any(each.severity == "error" for each in wrong) else 0


def _looked_at(place: Installation, only: str | None) -> Iterator[Diagnostic]:
    # Robots are asked from the start: that waits for the network, the rest for disks.
    asked: list[Check] = [] if only == "machine" else [robots_answer, engines_index_once]
    robots = examine(place, asked, ROBOTS_S)
    if only != "ros":
        yield from examine(place)
    if only != "machine" and sys.stderr.isatty():
        print("Asking robots, which takes some seconds …", file=sys.stderr)
    yield from robots


def _tell(each: Diagnostic) -> None:
    code = f" [{each.code}]" if each.code else ""
    print(one_line(f"{_SIGNS[each.severity]} {each.where}: {each.message}{code}"), flush=True)
    if each.remedy:
        print(one_line(f"    {each.remedy}"), flush=True)
