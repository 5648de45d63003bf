"""Feeds updates that the scanner accepts to the CRDT library, in a process that may die of them.

`python -m editor.apply_updates` reads lines of hexadecimal updates; for each it prints `ready N` first and
then the result: `taken`, `refused`, `panicked`, and the milliseconds and megabytes it cost.
"""

import resource
import sys
import time

from pycrdt import Map

from action_assistant.editor.crdt.applying import Panicked
from action_assistant.editor.crdt.messages import Malformed
from action_assistant.editor.crdt.replica import Replica
from action_assistant.editor.documents import document


def fate(base: bytes, update: bytes) -> str:
    """Apply an update to a document like the room's, use the document, and return the result."""
    replica = Replica()
    replica.take(base, "ada")
    try:
        replica.take(update, "ada")
        document.maps_of(replica.doc)
        state = replica.doc.get_update()
        replica.lacking(b"\x00")
        copy = Replica()
        copy.take(state, "ada")
        things = copy.doc.get("things", type=Map)
        for key in list(things.keys()):
            del things[key]
    except Malformed:
        return "refused"
    except Panicked:
        return "panicked"
    return "taken"


def main() -> None:
    base = bytes.fromhex(sys.stdin.readline())
    for n, line in enumerate(sys.stdin):
        sys.stdout.write(f"ready {n}\n")
        sys.stdout.flush()
        begun, before = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        found = fate(base, bytes.fromhex(line))
        spent = (time.process_time() - begun) * 1000
        grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
        sys.stdout.write(f"{found} {spent:.1f} {grown:.1f}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
