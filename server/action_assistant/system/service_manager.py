"""The messages by which a process tells systemd how it is (`sd_notify`). Without systemd nothing is sent."""

import os
import socket


def notify(state: str) -> None:
    """Send a message such as `READY=1`. Nothing is raised if it is not received: then systemd ends
    the process, which is what it is for."""
    path = os.environ.get("NOTIFY_SOCKET", "")
    if not path.startswith(("/", "@")):
        return
    address = f"\0{path[1:]}" if path.startswith("@") else path
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as out:
            out.setblocking(False)
            out.sendto(state.encode(), address)
    except OSError:
        return


def watchdog_s() -> float | None:
    """Return the seconds within which systemd wants `WATCHDOG=1` from this process; None if it does
    not."""
    meant, wanted = os.environ.get("WATCHDOG_PID", ""), os.environ.get("WATCHDOG_USEC", "")
    if not wanted.isdecimal() or meant not in {"", str(os.getpid())}:
        return None
    return int(wanted) / 1e6
