"""Options that say where the data are: the data folder, and the database of the graphs."""

import argparse
from pathlib import Path

from action_assistant import paths, settings


def add_data(parser: argparse.ArgumentParser) -> None:
    """Add the option `--data`, which names the data folder."""
    parser.add_argument(
        "--data", type=Path, default=paths.data(), metavar="DIR", help="default: %(default)s"
    )


def add_database(
    parser: argparse.ArgumentParser,
    text: str = "of the editor; default: the one that was served last",
) -> None:
    """Add `--database`, which the environment may name. `text` is its help."""
    parser.add_argument("--database", metavar="URL", default=settings.database(), help=text)
