"""`service install | uninstall | status | upgrade`: serve whenever the computer runs, by systemd."""

import argparse
import os
import shutil
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from action_assistant import paths, settings
from action_assistant.commands.processes import add_serve_options, reached, sites_of
from action_assistant.commands.services.unit import (
    NAME,
    SOURCED,
    ServicePlan,
    Systemd,
    is_untouched,
    options_of,
    text_of,
)
from action_assistant.errors import CannotStart
from action_assistant.system import posix

#: Options of `serve` that a unit passes on.
_VALUES: Final = (
    "host",
    "public_url",
    "trusted_proxies",
    "behaviours",
    "log_format",
    "log_level",
)
_FLAGS: Final = ("share", "tls")
_DEFAULT_PORT: Final = 8000


def _add_service(service: argparse.ArgumentParser) -> None:
    service.epilog = "example: action-assistant service install --user --port 8000"
    verbs = service.add_subparsers(dest="verb", required=True, metavar="VERB")
    install = verbs.add_parser("install", help="write the unit, enable it and start it")
    install.epilog = "example: sudo action-assistant service install --system --as robot --share"
    add_serve_options(install)
    _where(install)
    install.add_argument(
        "--as",
        dest="user",
        metavar="USER",
        help="with --system: who runs it; engines on this computer have to be the same. Default: "
        "whoever called sudo",
    )
    install.add_argument("--print", action="store_true", help="show the unit, and do nothing")
    install.add_argument("--no-start", action="store_true", help="enable it, and do not start it")
    _replacing(install)
    install.set_defaults(handler=_install)
    for verb, help_, handler in (
        ("uninstall", "stop it and remove the unit; data stay", _uninstall),
        ("status", "say how it is; exit 1 unless it runs", _status),
        ("upgrade", "write the unit anew by the options it has, and start it again", _upgrade),
    ):
        parser = verbs.add_parser(verb, help=help_)
        parser.epilog = f"example: action-assistant service {verb} --user"
        _where(parser)
        if verb != "status":
            _replacing(parser)
        parser.set_defaults(handler=handler)


COMMANDS: Final = {"service": _add_service}


def _where(parser: argparse.ArgumentParser) -> None:
    scope = parser.add_mutually_exclusive_group()
    scope.add_argument(
        "--user",
        dest="scope",
        action="store_const",
        const="user",
        default="user",
        help="a service of yours; the default",
    )
    scope.add_argument(
        "--system", dest="scope", action="store_const", const="system", help="of the computer"
    )
    parser.add_argument(
        "--root",
        type=Path,
        metavar="DIR",
        help="of an image below this folder, not of this computer",
    )


def _replacing(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--replace",
        action="store_true",
        help="also if somebody has edited the unit, which is kept beside it",
    )


def _install(options: argparse.Namespace) -> int:
    systemd = Systemd(options.scope, options.root)
    text = text_of(_plan(options, systemd))
    if options.print:
        sys.stdout.write(text)
        return 0
    systemd.require()
    commands = [] if systemd.root else [systemd.command("daemon-reload")]
    enable = [] if systemd.root or options.no_start else ["--now"]
    commands.append(systemd.command("enable", *enable, NAME))
    _write(systemd, text, replace=options.replace)
    for each in commands:
        print(f"runs    {' '.join(each)}", flush=True)
    systemd.do(commands)
    _say_more(systemd)
    return 0


def _upgrade(options: argparse.Namespace) -> int:
    systemd = Systemd(options.scope, options.root)
    systemd.require()
    given = options_of(_there(systemd))
    if given is None:
        raise CannotStart(f"{systemd.unit} was not made by `service install`: call that once.")
    parser = argparse.ArgumentParser(prog="action-assistant")
    _add_service(parser)
    known = parser.parse_args(["install", *given])
    known.root = options.root
    _write(systemd, text_of(_plan(known, systemd)), replace=options.replace)
    if systemd.root is None:
        commands = [systemd.command("daemon-reload"), systemd.command("restart", NAME)]
        for each in commands:
            print(f"runs    {' '.join(each)}", flush=True)
        systemd.do(commands)
    return 0


def _uninstall(options: argparse.Namespace) -> int:
    systemd = Systemd(options.scope, options.root)
    text = _there(systemd)
    if not is_untouched(text) and not options.replace:
        raise CannotStart(_edited(systemd.unit, "--replace removes it, and keeps a copy beside it"))
    systemd.require()
    now = [] if systemd.root else ["--now"]
    systemd.do([systemd.command("disable", *now, NAME)])
    try:
        _put_aside(systemd.unit, text)
        systemd.unit.unlink()
    except OSError as error:
        raise CannotStart(_no_rights(systemd, error)) from error
    if systemd.root is None:
        systemd.do([systemd.command("daemon-reload")])
    print(f"removed {systemd.unit}; graphs, runs and settings stay where they are.")
    return 0


def _status(options: argparse.Namespace) -> int:
    systemd = Systemd(options.scope, options.root)
    try:
        text = _there(systemd)
    except CannotStart as error:
        print(error)
        return 1
    made = "as it was written" if is_untouched(text) else "edited since it was written"
    print(f"unit    {systemd.unit}, {made}")
    if systemd.root is not None:
        return 0
    systemd.require()
    state = systemd.state()
    active = state.get("ActiveState", "unknown")
    print(
        f"state   {active} ({state.get('SubState', '?')}), {state.get('UnitFileState') or 'unknown'}, "
        f"process {state.get('MainPID', '?')}, started again {state.get('NRestarts', '?')} times"
    )
    journal = f"journalctl {'--user ' * (systemd.scope == 'user')}-u {NAME}"
    print(f"log     {journal}")
    return 0 if active == "active" else 1


def _plan(options: argparse.Namespace, systemd: Systemd) -> ServicePlan:
    """Return the service that the options describe, for `systemd` (the manager of this computer or
    of one person). Raise CannotStart if an option cannot be used, such as a password, which a unit
    file would show to everybody."""
    settings.check_environment()  # files of secrets stay named, and are read by the service
    if options.database and ("@" in options.database or "password" in options.database):
        raise CannotStart(
            "A unit is read by everybody, and this --database may hold a password. Write "
            f"ACTION_ASSISTANT_DATABASE=URL into {systemd.settings}, which only its owner may read."
        )
    reached(options)  # refuses an address that is none
    words: list[str] = []
    if options.port != _DEFAULT_PORT:
        words += ["--port", str(options.port)]
    if options.database:
        words += ["--database", options.database]
    for name in _VALUES:
        value = getattr(options, name)
        if value is not None:
            shown = value.absolute() if isinstance(value, Path) else value
            words += [f"--{name.replace('_', '-')}", str(shown)]
    for robot, folder in settings.index_folders(options.index_folder, {}).items():
        words += ["--index-folder", f"{robot}={folder}"]
    sites_of(options, options.port + 1)  # refuses one that cannot be used
    for text in options.runners:
        words += ["--runner", text]
    words += _backups(options)
    words += [f"--{name}" for name in _FLAGS if getattr(options, name)]
    user = _user(options) if options.scope == "system" else ""
    data = _data(options)
    given = [f"--{options.scope}", *(["--as", user] if user else []), *words]
    return ServicePlan(
        scope=options.scope,
        program=_program(),
        words=tuple(words),
        options=(*given, *(["--data", str(data)] if data is not None else [])),
        data=data,
        user=user,
        environment=_sourced(os.environ),
        settings=systemd.settings,
        writes=(
            *_archive(),
            *settings.index_folders(options.index_folder).values(),
            *([options.backup_to.absolute()] if options.backup_to is not None else []),
        ),
    )


def _backups(options: argparse.Namespace) -> list[str]:
    if options.backup_to is None:
        return []
    words = ["--backup-to", str(options.backup_to.absolute())]
    words += ["--backup-every", f"{options.backup_every:g}s", "--backup-keep", options.backup_keep]
    return [*words, *(["--backup-after", options.backup_after] if options.backup_after else [])]


def _data(options: argparse.Namespace) -> Path | None:
    """Return the data folder that the options name for the service; None for the folder that
    systemd manages."""
    given: Path = options.data
    if options.scope == "system" and given == paths.data() and not _named_data():
        return None
    return given.absolute()


def _named_data() -> bool:
    return bool(os.environ.get("ACTION_ASSISTANT_DATA"))


def _archive() -> tuple[Path, ...]:
    named = os.environ.get("ACTION_ASSISTANT_ARCHIVE")
    return (Path(named).absolute(),) if named else ()


def _user(options: argparse.Namespace) -> str:
    user: str = options.user or os.environ.get("SUDO_USER") or ""
    if not user:
        raise CannotStart(
            "Say with --as who is to run it: the user of the engines on this computer, if there are any."
        )
    if user == "root":
        raise CannotStart(
            "As root this program could do anything to the computer: name another user."
        )
    if options.root is None and not posix.user_exists(user):
        raise CannotStart(f"This computer has no user {user}.")
    return user


def _program() -> tuple[str, ...]:
    """Return the command that starts this program. Raise CannotStart if the program runs from uv's
    cache, which is not permanent."""
    python = Path(sys.executable)
    if any(part in {"archive-v0", "environments-v2"} for part in python.parts) or (
        "uv" in python.parts and ".cache" in python.parts
    ):
        raise CannotStart(
            f"{python} is in uv's cache, which is emptied now and then. Install the program first: `uv "
            "tool install WHEEL` or `pipx install WHEEL`."
        )
    script = python.with_name("action-assistant")
    if script.exists():
        return (str(script),)
    return (str(python), "-P", "-m", "action_assistant")


def _sourced(environ: Mapping[str, str]) -> dict[str, str]:
    """Return the variables of ROS 2 and of this program in the shell's environment; not the secret
    ones, since all users can read a unit."""
    plain = [name for name in settings.VARIABLES if name not in _SECRET | _SAID]
    return {name: environ[name] for name in (*SOURCED, *plain) if environ.get(name)}


_SECRET: Final = frozenset(
    name for name in settings.VARIABLES if name.rpartition("_")[2] in {"TOKEN", "DATABASE", "URL"}
) - {"ACTION_ASSISTANT_PUBLIC_URL"}

#: Settings that the unit's command gives as options.
_SAID: Final = frozenset({"ACTION_ASSISTANT_DATA", "ACTION_ASSISTANT_PORT"})


def _there(systemd: Systemd) -> str:
    try:
        return systemd.unit.read_text()
    except FileNotFoundError:
        raise CannotStart(f"There is no service: {systemd.unit} is not there.") from None
    except (OSError, UnicodeDecodeError) as error:
        raise CannotStart(f"Cannot read {systemd.unit}: {error}.") from error


def _write(systemd: Systemd, text: str, *, replace: bool) -> None:
    """Write the unit file with this text. Raise CannotStart if a person has edited it, unless
    `replace` is set."""
    unit = systemd.unit
    before = unit.read_text() if unit.exists() else ""
    if before == text:
        print(f"keeps   {unit}, which is as it should be")
        return
    if before and not is_untouched(before) and not replace:
        raise CannotStart(_edited(unit, "--replace writes it anew, and keeps a copy beside it"))
    try:
        unit.parent.mkdir(parents=True, exist_ok=True)
        if before:
            _put_aside(unit, before)
        fresh = unit.with_name(f".{unit.name}.new")
        fresh.write_text(text)
        fresh.chmod(0o644)
        fresh.replace(unit)
    except OSError as error:
        raise CannotStart(_no_rights(systemd, error)) from error
    print(f"writes  {unit}", flush=True)


def _put_aside(unit: Path, text: str) -> None:
    """Copy a unit with this text to a file beside it, if a person has edited it."""
    if not is_untouched(text):
        kept = unit.with_name(f"{unit.name}.before")
        shutil.copy2(unit, kept)
        print(f"keeps   {kept}")


def _edited(unit: Path, way: str) -> str:
    return (
        f"{unit} was edited, or is not of this program, so it is left as it is. Own changes belong into "
        f"`systemctl edit {NAME}`, which survives; {way}."
    )


def _no_rights(systemd: Systemd, error: OSError) -> str:
    sudo = ": call this with sudo" if isinstance(error, PermissionError) else ""
    return f"Cannot write {systemd.unit} ({error.strerror}){sudo}."


def _say_more(systemd: Systemd) -> None:
    print(f"settings, secrets among them, may stand in {systemd.settings} (chmod 600).")
    if systemd.scope == "user" and systemd.root is None:
        print("It ends when you sign out, unless `loginctl enable-linger` was called once.")
