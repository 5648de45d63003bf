"""Runs this program as if the system were another: without the modules, functions and constants that it
lacks there. Started as a process of its own: `python elsewhere.py win32|darwin [COMMAND … [+ COMMAND …]]`.

What other people's packages do there is theirs: they are imported before. All of ours is imported anew.
"""

import asyncio
import importlib
import importlib.abc
import multiprocessing
import os
import pkgutil
import signal
import socket
import ssl
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

PACKAGE = "action_assistant"
#: Modules of ours that say why they cannot be imported here: rclpy is not in this environment.
OF_ROS = ("runner.emulator.node", "runner.links.ros2")
#: The modules and functions of Linux that each system lacks.
LACKS: dict[str, dict[str, tuple[str, ...]]] = {
    "win32": {
        "modules": (
            *("fcntl", "resource", "termios", "pwd", "grp", "pty", "tty", "syslog", "uvloop"),
            *("readline", "curses", "posix", "crypt", "spwd", "nis"),
        ),
        "os": (
            *("fork", "forkpty", "getuid", "geteuid", "getgid", "getegid", "getgroups", "setsid"),
            *("killpg", "getpgid", "setpgid", "nice", "uname", "chown", "fchown", "lchown"),
            *("fchmod", "mkfifo", "sysconf", "statvfs", "getloadavg", "wait4", "waitstatus_to_x"),
            *("O_DIRECTORY", "O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_SYNC", "pidfd_open"),
            *("sched_getaffinity", "setgroups", "setuid", "setgid", "WNOHANG", "ctermid"),
        ),
        "signal": ("SIGKILL", "SIGHUP", "SIGUSR1", "SIGUSR2", "SIGALRM", "SIGPIPE", "SIGSTOP"),
        "socket": ("AF_UNIX", "SO_REUSEPORT", "TCP_USER_TIMEOUT"),
    },
    "darwin": {
        "modules": ("spwd",),
        "os": ("pidfd_open", "sched_getaffinity", "sched_setaffinity", "memfd_create", "splice"),
        "signal": ("SIGSTKFLT", "SIGPWR", "SIGPOLL"),
        "socket": ("TCP_USER_TIMEOUT", "TCP_KEEPIDLE", "SO_PEERCRED"),
    },
}


class Refusing(importlib.abc.MetaPathFinder):
    """Finds none of the modules that are missing there."""

    def __init__(self, names: Sequence[str]) -> None:
        self._names = names

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> None:
        """Refuse the named modules when importlib asks for them."""
        if fullname in self._names:
            raise ImportError(f"no module named {fullname!r} on this system", name=fullname)


def ours() -> list[str]:
    """Every module of ours."""
    package = importlib.import_module(PACKAGE)
    found = pkgutil.walk_packages(package.__path__, f"{PACKAGE}.", onerror=lambda _: None)
    return sorted({PACKAGE, *(each.name for each in found)} - {f"{PACKAGE}.__main__"})


def of_ros(name: str) -> bool:
    """Return whether a module needs rclpy."""
    return any(name.startswith(f"{PACKAGE}.{each}") for each in OF_ROS)


def move_to(system: str) -> None:
    """Make this process look like one on that system to our modules."""
    for name in ours():
        try:
            importlib.import_module(name)
        except ImportError:
            assert of_ros(name), name
    asyncio.run(asyncio.sleep(0))
    for name in [each for each in sys.modules if each.partition(".")[0] == PACKAGE]:
        del sys.modules[name]
    lacks = LACKS[system]
    for name in lacks["modules"]:
        sys.modules.pop(name, None)
    sys.meta_path.insert(0, Refusing(lacks["modules"]))
    for module in (os, signal, socket):
        for name in lacks[module.__name__]:
            if hasattr(module, name):
                delattr(module, name)
    sys.platform = system
    if system == "win32":
        os.supports_dir_fd.clear()
        real = multiprocessing.get_context

        def context(method: str | None = None) -> Any:
            if method in {"fork", "forkserver"}:
                raise ValueError(f"cannot find context for {method!r}")
            return real(method)

        multiprocessing.get_context = context  # type: ignore[assignment]
        ssl.enum_certificates = lambda _: []  # type: ignore[attr-defined] # Python's own, there
        for name in ("ForkServerProcess", "ForkServerContext", "ForkProcess"):
            delattr(multiprocessing.context, name)
    proc = Path.read_text

    def read_text(path: Path, *args: Any, **more: Any) -> str:
        if str(path).startswith("/proc/"):
            raise FileNotFoundError(2, "No such file or directory", str(path))
        return proc(path, *args, **more)

    Path.read_text = read_text  # type: ignore[method-assign]


def commands(words: Sequence[str]) -> int:
    """Run commands one after the other, with a line after each that says its exit code; or one alone,
    as it is."""
    from action_assistant.cli import main as command

    if "+" not in words:
        return command(words)
    given: list[list[str]] = [[]]
    for word in words:
        if word == "+":
            given.append([])
        else:
            given[-1].append(word)
    for each in given:
        code = command(each)
        sys.stdout.write(f"\n+ {code}\n")
        sys.stdout.flush()
    return 0


def main() -> int:
    """Import all of ours there; with arguments, run a command."""
    move_to(sys.argv[1])
    if len(sys.argv) > 2:
        return commands(sys.argv[2:])
    failed = {}
    for name in ours():
        try:
            importlib.import_module(name)
        except Exception as error:  # noqa: BLE001 - whatever it is, it is told
            if not (of_ros(name) and isinstance(error, ImportError)):
                failed[name] = f"{type(error).__name__}: {error}"
    told = [f"{name}: {why}" for name, why in failed.items()]
    told.append(f"{len(ours()) - len(failed)} imported, {len(failed)} failed")
    sys.stdout.write("\n".join(told) + "\n")
    return bool(failed)


if __name__ == "__main__":
    sys.path.pop(0)
    sys.exit(main())
