"""Diagrams of Mermaid as tables of who says what to whom.

The library that draws them is larger than the rest of the help together, and a table can be searched
and read on a phone.
"""

import re
from typing import Final

_BLOCK: Final = re.compile(r"^```mermaid\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_NAMED: Final = re.compile(r"^(?:participant|actor) (\w+)(?: as (.+))?$")
_SAID: Final = re.compile(r"^(\w+)\s*-{1,2}>>?\s*(\w+):\s*(.+)$")
_NOTE: Final = re.compile(r"^Note over ([\w,]+):\s*(.+)$")
_FRAME: Final = re.compile(r"^(?:par|and|loop|alt|else|opt)\b\s*(.*)$")
_BOX: Final = re.compile(r'^(?:subgraph )?(\w+)[\[(]+"(.+?)"[\])]+$')
_ARROW: Final = re.compile(r'^(\w+) (?:-- (?:"(.+?)"|(\w+)) )?--[->] (\w+)$')


def told(text: str) -> str:
    """The document with each diagram as a table. Fails for a line that it does not know."""
    return _BLOCK.sub(lambda match: _table(match[1]), text)


def _table(diagram: str) -> str:
    kind, *lines = [line.strip() for line in diagram.splitlines() if line.strip()]
    read = _sequence if kind == "sequenceDiagram" else _boxes
    names: dict[str, str] = {}
    rows = [row for line in lines if line != "end" and (row := read(line, names)) is not None]
    cells = [" | ".join(names.get(each, each) for each in row) for row in rows]
    return "\n".join(["| from | to | |", "|---|---|---|", *(f"| {row} |" for row in cells)])


def _sequence(line: str, names: dict[str, str]) -> tuple[str, str, str] | None:
    if found := _NAMED.match(line):
        names[found[1]] = found[2] or found[1]
        return None
    if found := _SAID.match(line):
        return (found[1], found[2], found[3])
    if found := _NOTE.match(line):
        first, _, last = found[1].partition(",")
        return (first, last, f"*{found[2]}*")
    if found := _FRAME.match(line):
        return ("", "", f"*at once, {found[1]}:*")
    raise ValueError(f"not known in a sequence: {line}")


def _boxes(line: str, names: dict[str, str]) -> tuple[str, str, str] | None:
    if found := _BOX.match(line):
        names[found[1]] = found[2].replace("<br>", " ")
        return None
    if found := _ARROW.match(line):
        return (found[1], found[4], found[2] or found[3] or "")
    raise ValueError(f"not known in a flowchart: {line}")
