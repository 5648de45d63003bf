"""Compare the pictures of the documents with the page that they show: a part of `make soak`.

`make pictures` notes beside the pictures a digest of the components and styles that the page is drawn
by. Another digest means that the page may look otherwise now.
"""

import hashlib
import json
import re
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

REPOSITORY: Final = Path(__file__).parents[1]
PAGE: Final = REPOSITORY / "frontend" / "src"
NOTE: Final = REPOSITORY / "docs" / "pictures" / "taken.json"
_COMMENT: Final = re.compile(r"/\*.*?\*/|^\s*//[^\n]*$", re.DOTALL | re.MULTILINE)


def main(arguments: list[str]) -> int:
    """Note that the pictures show the present page (`--taken`), or return 1 if they show another."""
    digest = digest_of(PAGE)
    if arguments == ["--taken"]:
        note = {"day": datetime.now(UTC).date().isoformat(), "page": digest}
        NOTE.write_text(json.dumps(note, indent=2) + "\n")
        return 0
    note = json.loads(NOTE.read_text()) if NOTE.exists() else {"day": "an unknown day", "page": ""}
    if note["page"] == digest:
        return 0
    sys.stderr.write(
        f"docs/pictures were taken on {note['day']}; components or styles of the page have changed "
        "since. Take them again with `make pictures`, and look at each.\n"
    )
    return 1


def digest_of(folder: Path) -> str:
    """Return the SHA-256, in hex, of all components and styles below a folder, without comments,
    blank space and tests."""
    digest = hashlib.sha256()
    for path in sources(folder):
        text = _COMMENT.sub("", path.read_text(encoding="utf-8"))
        digest.update("".join(text.split()).encode())
    return digest.hexdigest()


def sources(folder: Path) -> Iterator[Path]:
    """Yield the components and styles below a folder, in the order of their paths."""
    found = (path for path in folder.rglob("*") if path.suffix in {".tsx", ".css"})
    yield from sorted(path for path in found if ".test." not in path.name)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
