"""simulate-robot: a robot to practise with, for everybody on a ROS 2 domain."""

import argparse
import json
import os
import signal
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

import msgspec

from action_assistant.errors import CannotStart
from action_assistant.runner.emulator.engine import EmulatedEngine
from action_assistant.runner.emulator.messages import (
    EmulatedIndex,
    EngineTraits,
    Gone,
    LogMessage,
    Said,
    index_of,
)
from action_assistant.runner.links.behaviours.folder import BehaviourFolder
from action_assistant.runner.links.behaviours.performer import BehaviourPerformer
from action_assistant.safe_text import one_line
from action_assistant.system.parent import when_parent_ends
from action_assistant.umrf.facts import facts_of
from action_assistant.umrf.semantics import Script, script_from

_DEEP: Final = 2  # folders below --actions in which an engine looks


def _add_simulate_robot(robot: argparse.ArgumentParser) -> None:
    robot.epilog = "example: action-assistant simulate-robot David --domain 7 --quirk loss=0"
    robot.add_argument("name", metavar="NAME", help="its wake word, as it is registered")
    robot.add_argument("--domain", type=_domain, metavar="N", help="default: $ROS_DOMAIN_ID, or 0")
    robot.add_argument(
        "--namespace",
        default="",
        metavar="NS",
        help="of its get service; real engines take none: give them domains of their own",
    )
    _add_index(robot)
    robot.add_argument("--script", type=Path, metavar="S.json", help="what the actions do")
    robot.add_argument(
        "--behaviours",
        type=Path,
        metavar="DIR",
        help="of Python files that say what actions do, before the script; whoever may start a graph "
        "on this domain runs them as this user",
    )
    robot.add_argument(
        "--quirk",
        action="append",
        default=[],
        type=_quirk,
        metavar="NAME=VALUE",
        help=f"what it shall do like a real one; there are: {_known()}",
    )
    robot.add_argument("--facts", metavar="COMMIT", help="of the engine that it stands in for")
    robot.add_argument("--wake-words", default="", metavar="A,B", help="others that it answers to")
    robot.set_defaults(handler=_simulate_robot)


def _add_index(robot: argparse.ArgumentParser) -> None:
    robot.add_argument(
        "--actions",
        type=Path,
        metavar="DIR",
        help="of action packages: *umrf.json and *graph.json, two folders deep; "
        "without, it has every action",
    )
    robot.add_argument(
        "--indexing-rate",
        type=_seconds,
        default=2.0,
        metavar="S",
        help="seconds after which it looks at --actions again; 0: only at its start (default: 2, as engines)",
    )


COMMANDS: Final = {"simulate-robot": _add_simulate_robot}


def _known() -> str:
    return ", ".join(
        f"{name}={value}" for name, value in msgspec.structs.asdict(EngineTraits()).items()
    )


def _domain(text: str) -> int:
    number = int(text)
    if not 0 <= number <= 232:
        raise ValueError
    return number


def _seconds(text: str) -> float:
    number = float(text)
    if not 0 <= number < 1e6:
        raise ValueError
    return number


def _quirk(text: str) -> tuple[str, Any]:
    name, _, value = text.partition("=")
    said = {"on": True, "off": False}.get(value)
    found: tuple[str, Any] = name, json.loads(value) if said is None else said
    msgspec.convert(dict([found]), EngineTraits)
    return found


def _simulate_robot(options: argparse.Namespace) -> int:
    from action_assistant.runner.links.ros2.availability import why_not

    if missing := why_not():
        raise CannotStart(missing)
    from action_assistant.runner.emulator.node import EmulatorNode

    facts = facts_of({"commit": options.facts} if options.facts else {})
    quirks = msgspec.convert(dict(options.quirk), EngineTraits)
    script, folder = _script(options.script), options.actions
    index = EmulatedIndex() if folder is None else _index(folder)
    again = options.indexing_rate and folder is not None
    behaviours = BehaviourFolder.opened(options.behaviours) if options.behaviours else None
    extra = tuple(word for word in options.wake_words.split(",") if word)
    domain = int(os.environ.get("ROS_DOMAIN_ID", "0")) if options.domain is None else options.domain

    def robot(epoch_ms: int) -> EmulatedEngine:
        """Return an engine that starts at this time; its seed is the same number."""
        return EmulatedEngine(
            options.name,
            index=index,
            script=script,
            facts=facts,
            quirks=quirks,
            extra_wake_words=extra,
            seed=epoch_ms,
            epoch_ms=epoch_ms,
            performer=BehaviourPerformer(behaviours) if behaviours is not None else None,
        )

    try:
        node = EmulatorNode(
            robot,
            domain=domain,
            facts=facts,
            namespace=options.namespace,
            told=_tell,
            indexes=(options.indexing_rate, lambda: _found(folder)) if again else None,
        )
    except RuntimeError as error:
        raise CannotStart(f"Domain {domain} cannot be joined: {error}.") from error
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: node.end())
    when_parent_ends(node.end)
    print(
        f"{node.robot.actor} is on domain {domain} and moves nothing. Ctrl-C ends it.", flush=True
    )
    return 1 if node.spin() else 0


def _tell(said: Said) -> None:
    match said:
        case LogMessage(at_ms=at, text=text):
            print(f"{at / 1000:10.3f} s  {one_line(text.rstrip())}", flush=True)
        case Gone(why=why):
            print(f"The engine has ended: {why}.", file=sys.stderr, flush=True)
        case _:
            pass


def _script(path: Path | None) -> Script:
    if path is None:
        return Script()
    try:
        return script_from(json.loads(_text(path)))
    except ValueError as error:
        raise CannotStart(f"{path} is no script: {error}.") from error


def _index(folder: Path) -> EmulatedIndex:
    """Return the index of actions and graphs that an engine would make of the UMRF files in a
    folder; files that cannot be read are skipped. Raise CannotStart if there is no such folder."""
    if not folder.is_dir():
        raise CannotStart(f"There is no folder {folder}.")
    return _found(folder)


def _found(folder: Path) -> EmulatedIndex:
    """Return the index (the actions and graphs that the emulated engine knows) of a folder; files
    that cannot be read are skipped."""
    return index_of(_texts(folder, "umrf.json"), _texts(folder, "graph.json"))


def _texts(folder: Path, ending: str) -> Iterable[str]:
    for depth in range(_DEEP + 1):
        for path in sorted(folder.glob("*/" * depth + f"*{ending}*")):
            try:
                yield path.read_text()
            except (OSError, UnicodeDecodeError):
                continue


def _text(path: Path) -> str:
    try:
        return path.read_text()
    except (OSError, UnicodeDecodeError) as error:
        raise CannotStart(f"Cannot read {path}: {error}.") from error
