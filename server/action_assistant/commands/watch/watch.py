"""The command `watch`: its options, and how it ends."""

import argparse

from action_assistant.commands.client import command


def add_to(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command of this module."""
    watch = command(
        commands, "watch", "print each change of a graph as it comes, until Ctrl-C", "patrol"
    )
    watch.add_argument("graph", metavar="GRAPH", help="id or name")
    watch.add_argument("--json", action="store_true", help="one JSON object for each line")
    watch.set_defaults(handler=_watch)


def _watch(options: argparse.Namespace) -> int:
    try:
        # Clients of a room are slow to load.
        from action_assistant.commands.watch.room import watch

        return watch(options)
    except KeyboardInterrupt:  # how it is meant to end
        return 0
