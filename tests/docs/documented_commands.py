"""The commands that README.md and docs/*.md tell people to type, as data."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

ROOT: Final = Path(__file__).parents[2]
#: The documents, in the order in which they are tried: a backup is restored last.
DOCUMENTS: Final = (*sorted((ROOT / "docs").glob("*.md")), ROOT / "README.md")
PROGRAM: Final = "action-assistant"
#: Programs that begin a line with a command.
PROGRAMS: Final = frozenset(
    f"{PROGRAM} make git source export ros2 docker cp curl pip pipx uv uvx systemctl sudo apt apt-get cd "
    "podman psql rm promtool brew python3 rosdep colcon journalctl install pg_basebackup".split()
)
_BLOCK: Final = re.compile(
    r"^```(\w*)\n(.*?)^```$|((?:^ {4}\S[^\n]*\n(?:^\n(?= {4}\S))?)+)", re.MULTILINE | re.DOTALL
)
_SHELLS: Final = frozenset({"sh", "bash", "shell", "console"})
_INLINE: Final = re.compile(r"`((?:action-assistant|make) [^`\n]+)`")
_PARTS: Final = re.compile(r"^(?:&&|\|\||;|\|)$")
_PLACEHOLDER: Final = re.compile(r"…|<\w+>|\b[A-Z]{2,}\b(?!=)|\$\{?\w")


class Command(NamedTuple):
    """One program with its words, as it stands in a document."""

    document: str
    line: int
    text: str  # the whole line, without its comment
    words: tuple[str, ...]

    @property
    def program(self) -> str:
        """The command's program, without its folder."""
        return Path(self.words[0]).name

    def text_begins(self, start: str) -> bool:
        """Return whether the command begins with these words."""
        words = tuple(start.split())
        return self.words[: len(words)] == words

    @property
    def place(self) -> str:
        """The document, line and text of the command, for people."""
        return f"{self.document}:{self.line}: {self.text}"

    @property
    def is_placeholder(self) -> bool:
        """Return whether the reader has to fill something in first."""
        return bool(_PLACEHOLDER.search(self.text.replace("--data DIR", "")))


def _words(text: str) -> list[list[str]]:
    """The programs of a line, each with its words; a comment is no word."""
    lexer = shlex.shlex(text, posix=True, punctuation_chars="|&;")
    lexer.whitespace_split = True
    lexer.commenters = ""
    found: list[list[str]] = [[]]
    for word in lexer:
        if _PARTS.match(word):
            found.append([])
        else:
            found[-1].append(word)
    return [each for each in found if each]


def without_comment(line: str) -> str:
    """Return a line without its comment; no command here has a `#` in quotes."""
    return re.sub(r"(?:^|\s+)#\s.*$", "", line).strip()


def _is_command(line: str) -> bool:
    bare = re.sub(r"^\$ ", "", line.strip())
    first = re.split(r"[\s;]", re.sub(r"^(?:[A-Z_]+=\S* )+", "", bare), maxsplit=1)[0]
    return Path(first).name in PROGRAMS


def _lines(text: str) -> Iterator[tuple[int, str]]:
    """Lines of shell blocks, with those that go on joined, by their number."""
    for block in _BLOCK.finditer(text):
        language, fenced, indented = block[1], block[2], block[3]
        body = fenced if fenced is not None else indented
        first = text.count("\n", 0, block.start(2) if fenced is not None else block.start(3)) + 1
        rows = body.splitlines()
        told = language in _SHELLS or (not language and any(map(_is_command, rows[:1])))
        if not told:
            continue
        pending, at = "", 0
        for number, row in enumerate(rows, first):
            at = at if pending else number
            pending += row.strip()
            if pending.endswith("\\"):
                pending = pending[:-1]
                continue
            line, pending = re.sub(r"^\$ ", "", pending), ""
            # In a session, a line that is no command is output.
            if line and not line.startswith("#") and (language != "console" or _is_command(line)):
                yield at, line


def commands(document: Path) -> list[Command]:
    """Every command of the blocks of a document."""
    name = document.relative_to(ROOT).as_posix()
    return [
        Command(name, at, without_comment(line), tuple(words))
        for at, line in _lines(document.read_text())
        for words in _words(without_comment(line))
    ]


def inline(document: Path) -> list[Command]:
    """Commands of ours within sentences."""
    name = document.relative_to(ROOT).as_posix()
    text = document.read_text()
    return [
        Command(name, text.count("\n", 0, found.start()) + 1, found[1], tuple(words))
        for found in _INLINE.finditer(text)
        for words in _words(found[1])[:1]
    ]
