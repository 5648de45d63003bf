"""The command `doctor`. Its modules are loaded as far as each call needs them: with the Python of the runner it
looks only at robots."""

import argparse
from contextlib import suppress
from typing import Final

import msgspec

from action_assistant import settings
from action_assistant.commands.doctor.installation import Installation
from action_assistant.commands.place import add_data
from action_assistant.errors import CannotStart
from action_assistant.safe_text import one_line
from action_assistant.system.diagnostics import Diagnostic, Severity

_SIGNS: Final[dict[Severity, str]] = {"fine": "✓", "warning": "·", "error": "✗"}


def _add_doctor(doctor: argparse.ArgumentParser) -> None:
    doctor.epilog = (
        "example: action-assistant doctor --data ./data; exit code 1 if something is wrong"
    )
    add_data(doctor)
    doctor.add_argument(
        "--database",
        metavar="URL",
        help="of the editor; default: the one that was served last",
    )
    doctor.add_argument(
        "--host", metavar="H", help="default: the one that serves DIR, or 127.0.0.1"
    )
    doctor.add_argument(
        "--port",
        type=settings.port_number,
        metavar="N",
        help="of the editor; default: the one that serves DIR, or ACTION_ASSISTANT_PORT",
    )
    doctor.add_argument(
        "--public-url", metavar="URL", help="where a proxy shows the page; it is asked there"
    )
    sides = doctor.add_mutually_exclusive_group()
    sides.add_argument(
        "--before-upgrade",
        action="store_true",
        help="look only at what the next start of this version changes in older data, and whether "
        "there is room for the copy that it makes before",
    )
    sides.add_argument(
        "--only", choices=("machine", "ros"), help="look at one side of it only; default: at both"
    )
    doctor.add_argument(
        "--json", action="store_true", help="print what is wrong as JSON, and nothing else"
    )
    doctor.add_argument("--here", action="store_true", help=argparse.SUPPRESS)  # with this Python
    doctor.set_defaults(handler=_doctor)


COMMANDS: Final = {"doctor": _add_doctor}


def _doctor(options: argparse.Namespace) -> int:
    with suppress(CannotStart):  # reported as a finding
        settings.take_secrets_from_files()
    place = Installation(
        data=options.data.absolute(),
        database=options.database or settings.database(),
        host=options.host or "127.0.0.1",
        port=options.port or Installation.port_of_settings(),
        public_url=options.public_url,
    )
    if options.host is None and options.port is None:
        place = place.where_served()
    if options.here:
        from action_assistant.commands.doctor.robot_checks import look_here

        print(msgspec.json.encode(look_here(place)).decode())
        return 0
    from action_assistant.commands.doctor.doctor import BEFORE_UPGRADE, examine, looked_at

    seen: list[Diagnostic] = []
    before = options.before_upgrade
    for each in examine(place, BEFORE_UPGRADE) if before else looked_at(place, options.only):
        seen.append(each)
        if not options.json:
            _tell(each)
    wrong = [each for each in seen if each.severity != "fine"]
    if options.json:
        print(msgspec.json.encode(wrong).decode())
    return 1 if any(each.severity == "error" for each in wrong) else 0


def _tell(each: Diagnostic) -> None:
    code = f" [{each.code}]" if each.code else ""
    print(one_line(f"{_SIGNS[each.severity]} {each.where}: {each.message}{code}"), flush=True)
    if each.remedy:
        print(one_line(f"    {each.remedy}"), flush=True)
