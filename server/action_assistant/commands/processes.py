"""Commands that are processes: serve, editor, runner."""

import argparse
import gc
import os
from pathlib import Path
from typing import TYPE_CHECKING, Final

from action_assistant import settings
from action_assistant.commands.backups.options import add_rules, span
from action_assistant.commands.place import add_data, add_database
from action_assistant.errors import CannotStart
from action_assistant.logs import FORMS, LEVELS, hand_on, log_settings, set_up
from action_assistant.settings import Site
from action_assistant.sites import keep_sites, sites

if TYPE_CHECKING:  # slow to load, and most commands do not need it
    from action_assistant.supervisor import BackupPlan
    from action_assistant.web.server.listen import TlsIdentity


def _add_serve(both: argparse.ArgumentParser) -> None:
    both.epilog = "example: action-assistant serve --data ./data --port 8000"
    add_serve_options(both)
    both.add_argument("--no-open", action="store_true", help="do not open a browser")
    both.set_defaults(handler=_serve)


def add_serve_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of `serve` to a parser; `service install` has them as well."""
    _address(parser, port=settings.port())
    _database(parser, switch=True)
    _sharing(parser)
    _behaviours(parser)
    _backups(parser)
    _index_folders(parser)
    _runners(parser)
    _logging(parser)


def _add_editor(editor: argparse.ArgumentParser) -> None:
    editor.epilog = "example: action-assistant editor --port 8000 --runner-port 8001"
    _address(editor, port=settings.port())
    _database(editor, switch=True)
    _sharing(editor)
    _runners(editor)
    _logging(editor)
    editor.add_argument(
        "--cluster-listen",
        default="",
        metavar="HOST:PORT",
        help="where this editor listens for the other editors of its Postgres: an address that they alone "
        "can reach, since nothing is encrypted there",
    )
    editor.add_argument(
        "--cluster-url",
        default="",
        metavar="URL",
        help="where they find it; default: http:// and --cluster-listen",
    )
    editor.add_argument(
        "--runner-port", type=settings.port_number, metavar="N", help="default: the next port"
    )
    editor.set_defaults(handler=_editor)


def _add_runner(runner: argparse.ArgumentParser) -> None:
    runner.epilog = "example: action-assistant runner --port 8001 --page-port 8000"
    _address(runner, port=settings.port() + 1)
    _sharing(runner)
    _behaviours(runner)
    _index_folders(runner)
    _logging(runner)
    runner.add_argument(
        "--page-port", type=settings.port_number, metavar="N", help="default: the port before"
    )
    runner.set_defaults(handler=_runner)


COMMANDS: Final = {
    "serve": _add_serve,
    "editor": _add_editor,
    "runner": _add_runner,
}


def _backups(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--backup-to",
        type=Path,
        default=settings.backup_rule("TO"),
        metavar="DIR",
        help="make backups into this folder, by a process of their own",
    )
    parser.add_argument(
        "--backup-every",
        type=span,
        default=settings.backup_rule("EVERY") or "24h",
        metavar="TIME",
        help="how often (30m, 24h, 7d); default: %(default)s",
    )
    add_rules(parser, "--backup-")


def _address(parser: argparse.ArgumentParser, *, port: int) -> None:
    add_data(parser)
    parser.add_argument(
        "--host",
        metavar="H",
        help="default: 127.0.0.1; with --share every address of this computer",
    )
    parser.add_argument(
        "--port", type=settings.port_number, default=port, metavar="N", help="default: %(default)s"
    )


def _database(parser: argparse.ArgumentParser, *, switch: bool = False) -> None:
    add_database(
        parser,
        "of the editor; default: the one that was served last, at first sqlite in the data folder",
    )
    if switch:
        parser.add_argument(
            "--switch-database",
            action="store_true",
            help="begin with another database than before, and leave the graphs that are there",
        )


def _sharing(parser: argparse.ArgumentParser) -> None:
    shared = settings.share()
    parser.add_argument(
        "--share",
        action="store_true",
        default=bool(shared),
        help="let others on the network in, by links with a role",
    )
    parser.add_argument(
        "--tls",
        action="store_true",
        default=shared == "tls",
        help="encrypt, with a certificate that is made here",
    )
    parser.add_argument(
        "--public-url",
        metavar="URL",
        help="where a proxy shows the page, such as https://robots.example.org/temoto/; it leads "
        "what is below runner/ to the runner's port, and the rest to the editor's",
    )
    parser.add_argument(
        "--trusted-proxies",
        metavar="LIST",
        help="addresses and networks of proxies whose X-Forwarded-For is believed; default: with "
        "--public-url those of this computer, else none",
    )


def _behaviours(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--behaviours",
        type=Path,
        metavar="DIR",
        help="of Python files with which simulated runs may carry actions out; whoever may start a "
        "simulation runs them as this user",
    )


def _index_folders(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--index-folder",
        action="append",
        default=[],
        metavar="ROBOT=DIR",
        help="the --actions-path of that robot's engine, where it is on this computer, too: operators may "
        "have graphs written into it. May be given several times",
    )


def _runners(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--runner",
        dest="runners",
        action="append",
        default=[],
        metavar="NAME=URL",
        help="of each runner of a page with several: first the one beside the editor, then the others, "
        "which are started by themselves with the same token. May be given several times",
    )


def _logging(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--log-format", choices=FORMS, help="how lines of the log look; default: console"
    )
    parser.add_argument("--log-level", choices=LEVELS, help="what is not told below; default: info")


def reached(options: argparse.Namespace) -> settings.Reachability:
    """Return the public address and trusted proxies of this server. Raise CannotStart if an option
    is malformed."""
    return settings.reached(options.public_url, options.trusted_proxies)


def _host(options: argparse.Namespace) -> str:
    """Return the address to listen at. Raise CannotStart for an address that is reachable by more
    than the options allow."""
    host: str = options.host or (settings.EVERYWHERE if options.share else "127.0.0.1")
    if options.share and host in {"0.0.0.0", "::"}:
        host = settings.EVERYWHERE
    public = reached(options).public
    settings.check_host(host, settings.more_hosts(), share=options.share, public=public)
    return host


def _identity(
    chosen: settings.EditorSettings | settings.RunnerSettings, page_port: int
) -> "TlsIdentity | None":
    """Return the certificate that a process with these settings serves, for all addresses at which
    it can be reached; None without --tls. `page_port` is the port at which people open the page."""
    if not chosen.tls:
        return None
    from action_assistant.web.network.addresses import addresses_of
    from action_assistant.web.network.certificate import Certificate
    from action_assistant.web.server.listen import TlsIdentity

    addresses = addresses_of(
        host=chosen.host, page_port=page_port, hosts=chosen.hosts, share=chosen.share, secure=True
    )
    return TlsIdentity(Certificate(chosen.data), addresses.certified)


def _log(process: str, options: argparse.Namespace, *secrets: str) -> None:
    """Set up the log of this process by the options, and hand the settings on to the processes
    that it starts. The `secrets` are never written to the log of this process. Raise CannotStart
    if an option is malformed."""
    chosen = log_settings(options.log_format, options.log_level)
    hand_on(chosen)
    set_up(process, chosen, *secrets)


def _secrets(data: Path) -> tuple[str, ...]:
    from action_assistant.web.auth.keys import Keys

    secret = settings.oidc().get("CLIENT_SECRET", "")
    return Keys.of(data).token, settings.metrics_token() or "", secret


def sites_of(options: argparse.Namespace, runner_port: int) -> tuple[Site, ...]:
    """Return the runners of a page with several. Raise CannotStart if one cannot be used."""
    return sites(
        options.runners or os.environ.get(settings.RUNNERS, "").split(";"),
        page_port=options.port,
        runner_port=runner_port,
        public=reached(options).public,
        tls=options.tls,
    )


def _editor_settings(options: argparse.Namespace, data: Path) -> settings.EditorSettings:
    from action_assistant.editor.log.database_location import to_serve

    switch = options.switch_database
    runner_port = options.runner_port or options.port + 1
    return settings.EditorSettings(
        data=data,
        database=options.database or to_serve(data, switch=switch),
        host=_host(options),
        port=options.port,
        runner_port=runner_port,
        sites=sites_of(options, runner_port),
        cluster=settings.cluster(options.cluster_listen, options.cluster_url),
        hosts=settings.more_hosts(),
        limits=settings.limits(),
        load=settings.load_limits(),
        share=options.share,
        tls=options.tls,
        switch_database=switch,
        reached=reached(options),
        metrics_token=settings.metrics_token(),
        sessions=settings.sessions(),
        token_days=settings.token_days(),
        frames=settings.frame_origins(),
        run_links=settings.run_links(),
        oidc=settings.oidc(),
        notifications=settings.notifications(),
        audit_days=settings.audit_days(),
    )


def _serve(options: argparse.Namespace) -> int:
    from action_assistant.supervisor import ServePlan, serve

    if options.port == 65535:
        raise CannotStart("The runner needs the port after --port; 65535 has none.")
    _log("serve", options)
    settings.metrics_token()
    host = _host(options)
    data = settings.data_folder(options.data.resolve())
    return serve(
        ServePlan(
            data=data,
            database=options.database,
            switch_database=options.switch_database,
            host=host,
            port=options.port,
            share=options.share,
            tls=options.tls,
            reached=reached(options),
            behaviours=options.behaviours,
            index_folders=settings.index_folders(options.index_folder),
            sites=sites_of(options, options.port + 1),
            opens=not options.no_open,
            backups=_backup_plan(options),
            watchdog=settings.watchdog(),
        )
    )


def _backup_plan(options: argparse.Namespace) -> "BackupPlan | None":
    from action_assistant.supervisor import BackupPlan

    if options.backup_to is None:
        return None
    return BackupPlan(
        into=options.backup_to.resolve(),
        every=options.backup_every,
        keep=options.backup_keep,
        after=options.backup_after,
    )


def _editor(options: argparse.Namespace) -> int:
    gc.disable()  # until it listens: what is loaded by then stays
    from action_assistant.editor.app import create_app
    from action_assistant.editor.workers import prepare_workers
    from action_assistant.system.served_addresses import published
    from action_assistant.web.server.listen import serve as listen

    prepare_workers()
    data = settings.data_folder(options.data.resolve())
    _log("editor", options, *_secrets(data))
    chosen = _editor_settings(options, data)
    keep_sites(data, chosen.sites)
    listen(
        lambda: create_app(chosen),
        host=chosen.host,
        port=chosen.port,
        proxies=chosen.reached.proxies,
        identity=_identity(chosen, chosen.port),
        direct=settings.direct_sockets(),
        publish=lambda url: published(data, "editor", url),
        inside=None if chosen.cluster is None else (chosen.cluster.host, chosen.cluster.port),
    )
    return 0


def _runner(options: argparse.Namespace) -> int:
    gc.disable()  # until it listens: what is loaded by then stays
    from action_assistant.runner.app import create_app
    from action_assistant.runner.workers import prepare_workers
    from action_assistant.system.served_addresses import published
    from action_assistant.web.server.listen import serve as listen

    prepare_workers()
    data = settings.data_folder(options.data.resolve())
    _log("runner", options, *_secrets(data))
    chosen = settings.RunnerSettings(
        data=data,
        host=_host(options),
        port=options.port,
        page_port=options.page_port or options.port - 1,
        hosts=settings.more_hosts(),
        limits=settings.limits(),
        load=settings.load_limits(),
        share=options.share,
        tls=options.tls,
        keep=settings.keep(data),
        reached=reached(options),
        behaviours=options.behaviours,
        index_folders=settings.index_folders(options.index_folder),
        metrics_token=settings.metrics_token(),
        sessions=settings.sessions(),
        notifications=settings.notifications(),
        audit_days=settings.audit_days(),
    )
    listen(
        lambda: create_app(chosen),
        host=chosen.host,
        port=chosen.port,
        proxies=chosen.reached.proxies,
        identity=_identity(chosen, chosen.page_port),
        direct=settings.direct_sockets(),  # for a fair order of its sockets; none is taken over
        publish=lambda url: published(data, "runner", url),
    )
    return 0
