"""Options of regular backups, which `backup` and `serve` share: how often, how many stay, and what takes
them elsewhere."""

import argparse
import re
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import msgspec

from action_assistant import settings

#: The names of scheduled backups; other files in the folder are left alone.
_NAME: Final = re.compile(r"action-assistant-(\d{8}-\d{6})Z\.zip")
_STAMP: Final = "%Y%m%d-%H%M%S"
_PART: Final = re.compile(r"(\d{1,4})([dwm])")
DEFAULT: Final = "7d,4w,6m"


class RetentionRule(msgspec.Struct, frozen=True):
    """A rule of rotation: the numbers of days, weeks and months whose newest backup stays.

    With None in all three, every backup stays.
    """

    days: int | None = 0
    weeks: int | None = 0
    months: int | None = 0


def parse_retention(text: str) -> RetentionRule:
    """Parse `7d,4w,6m` (days, weeks, months) or `all`. Raise ValueError for any other text."""
    if text == "all":
        return RetentionRule(None, None, None)
    counts = {"d": 0, "w": 0, "m": 0}
    for part in text.split(","):
        found = _PART.fullmatch(part.strip())
        if found is None:
            raise ValueError(text)
        counts[found[2]] = int(found[1])
    if not any(counts.values()):
        raise ValueError(text)
    return RetentionRule(counts["d"], counts["w"], counts["m"])


def name_at(moment: datetime) -> str:
    """Return the file name of a backup that was begun at `moment`."""
    return f"action-assistant-{moment.astimezone(UTC).strftime(_STAMP)}Z.zip"


def moment_of(path: Path) -> datetime | None:
    """Return the time at which a scheduled backup was begun, by its file name; None for another
    file name."""
    found = _NAME.fullmatch(path.name)
    try:
        return found and datetime.strptime(found[1], _STAMP).replace(tzinfo=UTC)
    except ValueError:  # such as the 99th of a month
        return None


def superfluous(paths: Iterable[Path], keep: RetentionRule, now: datetime) -> list[Path]:
    """Return those of `paths` that are backups and that the rule `keep` does not keep at the time
    `now`. The newest backup dated before `now` always stays. Backups dated after `now` were made
    when a clock was wrong: they stay, and they do not take the place of one that the rule keeps."""
    if keep.days is None:
        return []
    moments = ((moment_of(path), path) for path in paths)
    dated = [(at, path) for at, path in moments if at is not None and at <= now]
    dated.sort(reverse=True)
    stays = {path for _, path in dated[:1]}
    periods = ((keep.days, "%Y-%m-%d"), (keep.weeks, "%G-%V"), (keep.months, "%Y-%m"))
    for count, form in periods:
        newest: dict[str, Path] = {}
        for moment, path in dated:
            newest.setdefault(moment.strftime(form), path)
        stays |= set(list(newest.values())[:count])
    return [path for _, path in dated if path not in stays]


_SPAN: Final = re.compile(r"(\d+(?:\.\d+)?)([smhd])")
_SECONDS: Final = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86_400.0}


def add_rules(parser: argparse.ArgumentParser, prefix: str) -> None:
    """Add two options to a parser: for how many backups stay, and for the command that takes them
    elsewhere. `prefix`: the prefix of their names."""
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
    """Parse a duration such as 30m, 24h or 7d; return it in seconds. Raise ArgumentTypeError for
    another text."""
    found = _SPAN.fullmatch(text.strip())
    if found is None or float(found[1]) * _SECONDS[found[2]] < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no time such as 30m, 24h or 7d")
    return float(found[1]) * _SECONDS[found[2]]


def rule(text: str) -> str:
    """Return a rule of how many backups stay, unchanged. Raise ArgumentTypeError for another text."""
    try:
        parse_retention(text)
    except ValueError as error:
        wrong = f"{text!r} is no rule such as {DEFAULT}, 10d, or all"
        raise argparse.ArgumentTypeError(wrong) from error
    return text
