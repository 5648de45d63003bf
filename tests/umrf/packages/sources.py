"""Actions as no person would describe them, and what C++, CMake and XML make of their packages."""

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

import pytest
from hypothesis import strategies as st

from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Action

STUBS: Final = Path(__file__).parent / "stubs"
NATIVE: Final = ("string", "strings", "number", "numbers", "bool", "bools")
#: Texts that end a literal, a comment, an argument or a tag, or begin something else.
HOSTILE: Final = (
    '"', "'", "*/", "/*", "//", '*/ system("x"); /*', '")\nexecute_process(COMMAND touch x)',
    "${ENV{HOME}}", "$<1:x>", "@PROJECT_NAME@", "]]>", "]]", "]==]", "<!--", "-->", "<x/>", "&amp;",
    "\n", "\r\n", "\r", "\u2028", "\\", "\\\n", "??/", "??/\n", '??\'', '\\"', ')delimiter"',
    'R"(', ';', "#", "#include <x>\n", "\n#define class struct\n", "{{ 7 * 7 }}", "{% raw %}", "{#",
    "\u202e", "\u2066", "\ufeff", "\x1b[2J", "\x7f", "é", "日本", "🙂", "%s", "\\u0022", "\\x22",
    "\t", "  ", "../..", "```", "| a |", "<script>",
)  # fmt: skip

hostile_texts = st.lists(
    st.one_of(
        st.sampled_from(HOSTILE),
        st.text(st.characters(codec="utf-8", exclude_characters="\x00"), max_size=6),
    ),
    max_size=5,
).map("".join)
#: The engine splits keys at colons.
keys = st.one_of(
    st.sampled_from(["pose", "position", "x", "class", "NULL", "errno", "a b", "1", "_", "T"]),
    hostile_texts.map(lambda text: text.replace(":", "")),
)
kinds = st.one_of(
    st.sampled_from(NATIVE), hostile_texts.filter(lambda kind: kind and kind not in NATIVE)
)


def _siblings(drawn: list[tuple[str, Any]]) -> dict[str, Any]:
    """Keys that no two members of a group have in C++ either."""
    return {f"{key}q{index}": value for index, (key, value) in enumerate(drawn)}


def _allowing(kind: str, values: st.SearchStrategy[Any]) -> st.SearchStrategy[dict[str, Any]]:
    return st.lists(values, max_size=2).map(
        lambda allowed: {"pvf_type": kind, "pvf_allowed_values": allowed}
    )


leaves: st.SearchStrategy[dict[str, Any]] = st.one_of(
    kinds.map(lambda kind: {"pvf_type": kind}),
    _allowing("string", hostile_texts),
    _allowing("number", st.floats(allow_nan=False, allow_infinity=False)),
    _allowing("bool", st.booleans()),
)
groups: st.SearchStrategy[dict[str, Any]] = st.recursive(
    st.lists(st.tuples(keys, leaves), max_size=4).map(_siblings),
    lambda inner: st.lists(st.tuples(keys, inner), max_size=3).map(_siblings),
    max_leaves=12,
)


def described(**fields: Any) -> Action:
    """The action of a file with these fields; called `TaTry` if they do not say."""
    return codec.read_action(json.dumps({"name": "TaTry", "type": "sync", **fields})).action


@st.composite
def odd_actions(draw: st.DrawFn) -> Action:
    """Any description whose package can be."""
    return described(
        description=draw(hostile_texts),
        input_parameters=draw(groups),
        output_parameters=draw(groups),
    )


def laid_out(files: Mapping[str, bytes], folder: Path) -> Path:
    """The folder, with the files in it."""
    for path, content in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)
    return folder


def compile_errors(package: Path, *options: str) -> str:
    """Return the errors of a strict compiler over all sources: the unit test includes the
    others."""
    if shutil.which("g++") is None:
        pytest.skip("g++ is not here")
    strict = ["-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", *options]
    answer = subprocess.run(
        [
            "g++",
            *strict,
            f"-I{package / 'include'}",
            f"-I{STUBS}",
            *(package / "test").glob("*.cpp"),
        ],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    return answer.stderr if answer.returncode else ""


def layout_faults(sources: Iterable[str]) -> str:
    """Return the changes that clang-format would make, by the style file beside the sources."""
    program = Path(sys.executable).with_name("clang-format")
    answer = subprocess.run(
        [str(program), "--style=file", "--fallback-style=none", "--dry-run", *sources],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    return answer.stderr


_CPP: Final = re.compile(
    r"(?P<comment>/\*.*?\*/|//(?:\\\n|[^\n])*)"
    r'|(?P<raw>R"(?P<end>[^ ()\\\n]*)\(.*?\)(?P=end)")'
    r'|(?P<string>"(?:\\.|[^"\\\n])*")'
    r"|(?P<char>'(?:\\.|[^'\\\n])*')"
    r"|(?P<directive>^[ ]*\#[^\n]*)"
    r"|(?P<word>[A-Za-z_]\w*)"
    r"|(?P<number>\d[\w.]*)"
    r"|(?P<blank>\s+)"
    r"|(?P<sign>.)",
    re.DOTALL | re.MULTILINE,
)
_CMAKE: Final = re.compile(
    r'(?P<comment>\#[^\n]*)|(?P<string>"(?:\\.|[^"\\])*")|(?P<word>[^\s()"\#]+)|(?P<blank>\s+)'
    r"|(?P<sign>.)",
    re.DOTALL,
)


def token_kinds(source: bytes, language: str = "cpp") -> list[str]:
    """The kinds of all tokens in order; of signs also which."""
    pattern = _CPP if language == "cpp" else _CMAKE
    return list(_kinds(pattern.finditer(source.decode())))


def _kinds(found: Iterable[re.Match[str]]) -> Iterable[str]:
    for token in found:
        kind = token.lastgroup or "raw"
        if kind != "blank":
            yield f"sign {token[0]}" if kind == "sign" else kind
