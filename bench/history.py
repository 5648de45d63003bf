"""Opening a long history, and what durability costs a single edit."""

from collections.abc import Iterator
from typing import Final

from peers import Hocuspocus, Ours, running
from table import Table

TITLE = "A graph of 20,000 changes, opened after a restart; and one edit after the other"
CHANGES: Final = 20_000
EDITS: Final = 150


def tables() -> Iterator[Table]:
    """Opening; single edits."""
    head = ["server", "until all is there", "CPU", "others waited at most", "answer", "things"]
    rows: list[list[str]] = []
    for kind in (Ours, Hocuspocus):
        with running(kind) as peer:
            (room,) = peer.rooms(1)
            peer.under("fill", [room], count=CHANGES)
            peer.stop()
            peer.start()
            found = peer.under("open", [room])
        waited = "" if found["blocked_ms"] is None else f"{found['blocked_ms']:.0f} ms"
        rows.append(
            [
                *(kind.name, f"{found['ms']:.0f} ms", f"{found['cpu_ms']:.0f} ms", waited),
                *(f"{found['bytes'] / 1000:.0f} kB", f"{found['things']:,}"),
            ]
        )
    yield Table(head, rows)
    head = ["server", "what an acknowledgement means", "p50", "p99", "CPU per edit"]
    rows = []
    meanings = {"ours": "it is on the disk", "Hocuspocus": "it is in memory"}
    for kind in (Ours, Hocuspocus):
        with running(kind) as peer:
            found = peer.under("one by one", peer.rooms(1), count=EDITS)
        times = [f"{found[name]:.1f} ms" for name in ("p50_ms", "p99_ms")]
        rows.append([kind.name, meanings[kind.name], *times, f"{found['cpu_us']:.0f} µs"])
    yield Table(head, rows)
