"""Commands that are processes: serve, editor, runner; and migrate, which prepares their databases."""

import argparse
import logging
import sys
from pathlib import Path

from action_assistant import places, settings
from action_assistant.errors import CannotStart


def add_to(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the commands of this module."""
    both = commands.add_parser(
        "serve",
        help="start the editor and the runner, and open the page",
        epilog="example: action-assistant serve --data ./data --port 8000",
    )
    _address(both, port=8000)
    _database(both)
    both.add_argument("--no-open", action="store_true", help="do not open a browser")
    both.set_defaults(deed=_serve)

    editor = commands.add_parser(
        "editor",
        help="the editor alone: graphs, versions, the page",
        epilog="example: action-assistant editor --port 8000 --runner-port 8001",
    )
    _address(editor, port=8000)
    _database(editor)
    editor.add_argument("--runner-port", type=_port, metavar="N", help="default: the next port")
    editor.set_defaults(deed=_editor)

    runner = commands.add_parser(
        "runner",
        help="the runner alone, the side of the robots: runs and Stop",
        epilog="example: action-assistant runner --port 8001 --page-port 8000",
    )
    _address(runner, port=8001)
    runner.add_argument("--page-port", type=_port, metavar="N", help="default: the port before")
    runner.set_defaults(deed=_runner)

    migrate = commands.add_parser(
        "migrate",
        help="bring the databases of a data folder to this version",
        epilog="example: action-assistant migrate --data ./data",
    )
    migrate.add_argument("--data", type=Path, default=places.data(), metavar="DIR")
    _database(migrate)
    migrate.set_defaults(deed=_migrate)


def _port(text: str) -> int:
    number = int(text)
    if not 0 < number < 65536:
        raise ValueError
    return number


def _address(parser: argparse.ArgumentParser, *, port: int) -> None:
    parser.add_argument(
        "--data", type=Path, default=places.data(), metavar="DIR", help="default: %(default)s"
    )
    parser.add_argument("--host", default="127.0.0.1", metavar="H", help="default: %(default)s")
    parser.add_argument(
        "--port", type=_port, default=port, metavar="N", help="default: %(default)s"
    )


def _database(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--database", metavar="URL", help="of the editor; default: sqlite, in the data folder"
    )


def _log() -> None:
    logging.basicConfig(
        level=logging.INFO,
        stream=sys.stderr,
        format="%(asctime)s %(levelname)s %(name)s: %(message)s",
    )
    logging.getLogger("uvicorn.error").setLevel(logging.WARNING)
    logging.getLogger("httpx").setLevel(logging.WARNING)


def _editor_settings(options: argparse.Namespace, data: Path) -> settings.EditorSettings:
    hosts = settings.more_hosts()
    settings.check_host(options.host, hosts)
    return settings.EditorSettings(
        data=data,
        database=options.database or f"sqlite:///{data / 'editor.db'}",
        host=options.host,
        port=options.port,
        runner_port=options.runner_port or options.port + 1,
        hosts=hosts,
        limits=settings.limits(),
    )


def _serve(options: argparse.Namespace) -> int:
    from action_assistant.serve import Plan, serve

    if options.port == 65535:
        raise CannotStart("The runner needs the port after --port; 65535 has none.")
    settings.check_host(options.host, settings.more_hosts())
    data = settings.writable_folder(options.data.resolve())
    return serve(
        Plan(
            data=data,
            database=options.database,
            host=options.host,
            port=options.port,
            opens=not options.no_open,
        )
    )


def _editor(options: argparse.Namespace) -> int:
    from action_assistant.editor.app import create_app
    from action_assistant.web.listen import serve as listen

    _log()
    chosen = _editor_settings(options, settings.writable_folder(options.data.resolve()))
    listen(lambda: create_app(chosen), host=chosen.host, port=chosen.port)
    return 0


def _runner(options: argparse.Namespace) -> int:
    from action_assistant.runner.app import create_app
    from action_assistant.web.listen import serve as listen

    _log()
    hosts = settings.more_hosts()
    settings.check_host(options.host, hosts)
    chosen = settings.RunnerSettings(
        data=settings.writable_folder(options.data.resolve()),
        host=options.host,
        port=options.port,
        page_port=options.page_port or options.port - 1,
        hosts=hosts,
        limits=settings.limits(),
    )
    listen(lambda: create_app(chosen), host=chosen.host, port=chosen.port)
    return 0


def _migrate(options: argparse.Namespace) -> int:
    from action_assistant.journal.migrate import Branch, migrate

    data = settings.writable_folder(options.data.resolve())
    database = options.database or f"sqlite:///{data / 'editor.db'}"
    urls: dict[Branch, str] = {"editor": database, "runner": f"sqlite:///{data / 'runner.db'}"}
    for branch, url in urls.items():
        revision = migrate(url, branch)
        print(f"{branch}: {url} is at revision {revision}")
    return 0
