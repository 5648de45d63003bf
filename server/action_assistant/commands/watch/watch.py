"""The command `watch`: its options, and how it ends."""

import argparse
from typing import Final

from action_assistant.commands.client import add_server


def _add_watch(watch: argparse.ArgumentParser) -> None:
    add_server(watch, "patrol")
    watch.add_argument("graph", metavar="GRAPH", help="id or name")
    watch.add_argument("--json", action="store_true", help="one JSON object for each line")
    watch.set_defaults(handler=_watch)


COMMANDS: Final = {"watch": _add_watch}


def _watch(options: argparse.Namespace) -> int:
    try:
        # Clients of a room are slow to load.
        from action_assistant.commands.watch.room import watch

        return watch(options)
    except KeyboardInterrupt:  # how it is meant to end
        return 0
