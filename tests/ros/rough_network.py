"""Runs a command in a network of its own whose only way to the robots delays and loses frames.

    rough_network.py DELAY_MS LOSS GAP_S COMMAND …      (as root)

Two network namespaces are joined by a pair of TAP devices. This program carries each frame from one to the
other: DELAY_MS late and up to as much again, with the chance LOSS of losing it, and with gaps of up to GAP_S
in which nothing gets through, about every ten seconds. The command runs in the one namespace; robots enter
the other one by the process id in $ROUGH_NETWORK.
"""

import ctypes
import fcntl
import heapq
import itertools
import os
import random
import select
import signal
import socket
import struct
import subprocess
import sys
import time

_NEW_NETWORK = 0x40000000  # CLONE_NEWNET
_TUNSETIFF = 0x400454CA
_TAP_WITHOUT_HEADER = 0x1002  # IFF_TAP | IFF_NO_PI


def enter(number: int) -> int:
    """Move this process into a new network namespace; return the file of its TAP device."""
    if ctypes.CDLL(None, use_errno=True).unshare(_NEW_NETWORK) != 0:
        raise OSError(ctypes.get_errno(), "no network namespace")
    tap = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(tap, _TUNSETIFF, struct.pack("16sH", b"rough", _TAP_WITHOUT_HEADER))
    for each in (
        "link set lo up",
        f"addr add 10.77.0.{number}/24 dev rough",
        "link set rough up multicast on",
        "route add 224.0.0.0/4 dev rough",
    ):
        subprocess.run(["ip", *each.split()], check=True)
    return tap


def side(number: int) -> tuple[int, int, socket.socket]:
    """Begin a process in a namespace of its own; return its id, its TAP device and the way to it."""
    ours, theirs = socket.socketpair()
    pid = os.fork()
    if pid == 0:
        socket.send_fds(theirs, [b"x"], [enter(number)])
        robots = theirs.recv(100).decode()
        if robots == "wait":
            signal.pause()
        os.execvpe(sys.argv[4], sys.argv[4:], {**os.environ, "ROUGH_NETWORK": robots})
    _, files, _, _ = socket.recv_fds(ours, 1, 1)
    return pid, files[0], ours


def carry(one: int, other: int, pid: int, delay_s: float, loss: float, gap_s: float) -> int:
    """Carry frames both ways until the process has ended; return its exit code."""
    waiting: list[tuple[float, int, int, bytes]] = []
    order = itertools.count()
    gap_from = time.monotonic() + 5
    gap_until = 0.0
    carried = lost = 0
    while True:
        due = waiting[0][0] - time.monotonic() if waiting else 0.2
        ready, _, _ = select.select([one, other], [], [], min(0.2, max(0.0, due)))
        now = time.monotonic()
        if gap_s and now > gap_until and now > gap_from:
            gap_until = now + random.uniform(0.2, gap_s)
            gap_from = gap_until + random.uniform(5, 15)
        for tap in ready:
            frame = os.read(tap, 70_000)
            carried += 1
            if now < gap_until or random.random() < loss:
                lost += 1
                continue
            late = delay_s * random.uniform(1, 2)
            heapq.heappush(waiting, (now + late, next(order), other if tap == one else one, frame))
        while waiting and waiting[0][0] <= now:
            _, _, tap, frame = heapq.heappop(waiting)
            os.write(tap, frame)
        ended, status = os.waitpid(pid, os.WNOHANG)
        if ended:
            sys.stdout.write(f"{carried} frames, {lost} of them lost\n")
            return os.waitstatus_to_exitcode(status)


def main() -> int:
    """Run the command."""
    delay_ms, loss, gap_s = map(float, sys.argv[1:4])
    robots, far, way = side(2)
    command, near, door = side(1)
    way.send(b"wait")
    door.send(str(robots).encode())
    try:
        return carry(near, far, command, delay_ms / 1000, loss, gap_s)
    finally:
        os.kill(robots, signal.SIGKILL)


if __name__ == "__main__":
    sys.exit(main())
