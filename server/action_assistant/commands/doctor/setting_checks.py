"""Settings in the environment: names that nobody reads, values that cannot be meant."""

import argparse
import difflib
import os
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Final

from action_assistant import interpreter, settings
from action_assistant.commands.backups import options
from action_assistant.commands.doctor.installation import Installation
from action_assistant.errors import CannotStart
from action_assistant.journal.databases import database_of
from action_assistant.logs.setup import log_settings
from action_assistant.system.diagnostics import Diagnostic, fine, found
from action_assistant.web.auth.keys import Keys

_PREFIX: Final = "ACTION_ASSISTANT_"
_HOST: Final = re.compile(r"[A-Za-z0-9_.:\[\]-]+")


def settings_mean_something(place: Installation) -> Iterator[Diagnostic]:
    """Every variable of ours that is set."""
    del place
    given = {name: value for name, value in os.environ.items() if name.startswith(_PREFIX)}
    problems = [each for name in sorted(given) for each in _setting(name, given[name])]
    yield from problems
    if not problems:
        many = f"{len(given)} of them are set" if given else "none is set"
        yield fine("settings", f"What ACTION_ASSISTANT_… says can be read; {many}.")


def _setting(name: str, value: str) -> Iterator[Diagnostic]:
    if name not in settings.VARIABLES:
        near = difflib.get_close_matches(name, settings.VARIABLES, 1)
        meant = f"Is {near[0]} meant? " if near else ""
        yield found(
            "setting-unknown",
            name,
            f"No setting has the name {name}, so nothing starts.",
            f"{meant}Correct or unset it; docs/network.md and `action-assistant serve --help` have all.",
        )
        return
    try:
        if value.strip():
            _READERS.get(name, _anything)(value)
    except CannotStart as error:
        yield found("setting-wrong", name, str(error), f"Correct or unset {name}.")


def _anything(_: str) -> None:
    """A value that is read elsewhere."""


def _limits(value: str) -> None:
    if value.lower() not in {"on", "off"}:
        raise CannotStart(f"ACTION_ASSISTANT_LIMITS is `off` or unset, not {value!r}.")


def _hosts(value: str) -> None:
    for each in value.split(","):
        if each.strip() and not _HOST.fullmatch(each.strip()):
            raise CannotStart(
                f"ACTION_ASSISTANT_HOSTS is a list of host names, and {each.strip()!r} is none."
            )


def _url(value: str) -> None:
    if not value.startswith(("http://", "https://")):
        raise CannotStart(
            f"ACTION_ASSISTANT_URL begins with http:// or https://, not as {value!r}."
        )


def _days(name: str) -> Callable[[str], object]:
    return lambda value: settings.keep(Path(), {name: value})


def _file(name: str) -> Callable[[str], object]:
    return lambda value: settings.take_secrets_from_files({name: value})


def _log(name: str) -> Callable[[str], object]:
    return lambda value: log_settings(environ={name: value})


def _metrics(name: str) -> Callable[[str], object]:
    return lambda value: settings.metrics_token({name: value})


def _argument(reads: Callable[[str], object]) -> Callable[[str], object]:
    """A reader of an option, which raises as argparse wants it."""

    def read(value: str) -> object:
        try:
            return reads(value)
        except argparse.ArgumentTypeError as error:
            raise CannotStart(f"{error}.") from error

    return read


_READERS: Final[Mapping[str, Callable[[str], object]]] = {
    "ACTION_ASSISTANT_PORT": lambda value: settings.port({"ACTION_ASSISTANT_PORT": value}),
    **{name: _file(name) for name in settings.VARIABLES if name.endswith("_FILE")},
    "ACTION_ASSISTANT_TOKEN": lambda value: Keys(value, "ACTION_ASSISTANT_TOKEN"),
    "ACTION_ASSISTANT_DATABASE": database_of,
    "ACTION_ASSISTANT_URL": _url,
    "ACTION_ASSISTANT_HOSTS": _hosts,
    "ACTION_ASSISTANT_PUBLIC_URL": lambda value: settings.reached(value, ""),
    "ACTION_ASSISTANT_TRUSTED_PROXIES": lambda value: settings.reached("", value),
    "ACTION_ASSISTANT_RUNNER_PYTHON": lambda value: interpreter.for_runner(
        {interpreter.VARIABLE: value}
    ),
    "ACTION_ASSISTANT_KEEP_RUNS": _days("ACTION_ASSISTANT_KEEP_RUNS"),
    "ACTION_ASSISTANT_KEEP_RAW": _days("ACTION_ASSISTANT_KEEP_RAW"),
    "ACTION_ASSISTANT_LIMITS": _limits,
    **{name: _log(name) for name in ("ACTION_ASSISTANT_LOG_FORMAT", "ACTION_ASSISTANT_LOG_LEVEL")},
    **{
        name: _metrics(name)
        for name in ("ACTION_ASSISTANT_METRICS_TOKEN", "ACTION_ASSISTANT_METRICS_TOKEN_FILE")
    },
    settings.INDEX_FOLDERS: lambda value: settings.index_folders(
        (), {settings.INDEX_FOLDERS: value}
    ),
    "ACTION_ASSISTANT_BACKUP_EVERY": _argument(options.span),
    "ACTION_ASSISTANT_BACKUP_KEEP": _argument(options.rule),
}
