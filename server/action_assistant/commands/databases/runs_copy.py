"""`runs copy`: copies runs into a Postgres database, once or as they come, for a team's own queries."""

import argparse
import asyncio
from pathlib import Path

from action_assistant import paths, settings
from action_assistant.commands.backups.progress import Progress
from action_assistant.errors import CannotStart


def add_to(runs: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command `copy` to `runs`, the commands of `action-assistant runs`."""
    copy = runs.add_parser(
        "copy",
        help="copy runs into the schema action_assistant_runs of a Postgres database, for your own "
        "queries",
        epilog="example: action-assistant runs copy --to postgresql://lab@db/lab --follow",
    )
    copy.add_argument("--to", required=True, metavar="URL", help="postgresql://USER@HOST/NAME")
    copy.add_argument(
        "--data", type=Path, default=paths.data(), metavar="DIR", help="default: %(default)s"
    )
    copy.add_argument(
        "--follow", action="store_true", help="go on, until Ctrl-C, also while the database is away"
    )
    copy.set_defaults(handler=_copy)


def _copy(options: argparse.Namespace) -> int:
    data = options.data.resolve()
    path = data / "runner.db"
    if not path.is_file():
        raise CannotStart(f"There are no runs in {data}.")
    from sqlalchemy import make_url
    from sqlalchemy.exc import ArgumentError

    try:
        url = make_url(options.to)
    except ArgumentError as error:
        raise CannotStart("--to is not a URL such as postgresql://lab@db/lab.") from error
    if url.drivername not in {"postgresql", "postgres"} or not url.database:
        raise CannotStart("--to is a Postgres database: postgresql://USER@HOST/NAME.")
    # Slow to load, and most who ask about runs do not need it.
    from sqlalchemy.ext.asyncio import create_async_engine

    from action_assistant.commands.databases.runs_copier import RunsCopier, followed, once

    engine = create_async_engine(
        url.set(drivername="postgresql+asyncpg"), connect_args={"timeout": 5}, pool_size=1
    )
    copier = RunsCopier(path, settings.keep(data).folder, engine, Progress())
    return asyncio.run(followed(copier) if options.follow else once(copier, str(url.database)))
