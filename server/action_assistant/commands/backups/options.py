"""Options of regular backups, which `backup` and `serve` share: how often, how many stay, and what takes
them elsewhere."""

import argparse
import re
from typing import Final

from action_assistant import settings
from action_assistant.commands.backups.rotation import DEFAULT, keeping

_SPAN: Final = re.compile(r"(\d+(?:\.\d+)?)([smhd])")
_SECONDS: Final = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86_400.0}


def add_rules(parser: argparse.ArgumentParser, prefix: str) -> None:
    """How many stay, and what takes a finished one elsewhere."""
    parser.add_argument(
        f"{prefix}keep",
        type=rule,
        default=settings.backup_rule("KEEP") or DEFAULT,
        metavar="RULE",
        help="of how many days, weeks and months the newest one stays, or `all`; default: %(default)s",
    )
    parser.add_argument(
        f"{prefix}after",
        default=settings.backup_rule("AFTER"),
        metavar="COMMAND",
        help="takes a finished one elsewhere; its path is added as the last argument",
    )


def span(text: str) -> float:
    """A time such as 30m, 24h or 7d, in seconds."""
    found = _SPAN.fullmatch(text.strip())
    if found is None or float(found[1]) * _SECONDS[found[2]] < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no time such as 30m, 24h or 7d")
    return float(found[1]) * _SECONDS[found[2]]


def rule(text: str) -> str:
    """How many stay."""
    try:
        keeping(text)
    except ValueError as error:
        wrong = f"{text!r} is no rule such as {DEFAULT}, 10d, or all"
        raise argparse.ArgumentTypeError(wrong) from error
    return text
