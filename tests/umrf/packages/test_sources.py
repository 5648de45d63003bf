"""A package compiles with any description, and contains nothing but what the templates say."""

import sys
import tempfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Action
from action_assistant.umrf.packages.choosing import distinct_actions
from action_assistant.umrf.packages.generating import ImpossiblePackage, package_files
from action_assistant.umrf.packages.naming import check_name
from support.doses import examples
from support.recordings import CORPUS, NO_CORPUS
from umrf.packages.sources import (
    HOSTILE,
    NATIVE,
    compile_errors,
    described,
    hostile_texts,
    laid_out,
    layout_faults,
    odd_actions,
    token_kinds,
)

LANGUAGES = {".cpp": "cpp", ".hpp": "cpp", ".txt": "cmake"}


def with_text(text: str) -> Action:
    """A text in every place that takes one."""
    key = text.replace(":", "") or "key"
    leaf: dict[str, Any] = {"pvf_type": f"{text} type"}
    chosen = {"pvf_type": "string", "pvf_allowed_values": [text]}
    return described(
        description=f"x{text}",
        input_parameters={key: {key: {"pvf_type": "number"}}, f"{key}q": leaf},
        output_parameters={key: leaf, f"{key}q": chosen},
    )


def shape(action: Action) -> dict[str, object]:
    """Tokens of every file that has some, tags of the XML."""
    found: dict[str, object] = {}
    for path, content in package_files(action).items():
        if language := LANGUAGES.get(Path(path).suffix):
            found[path] = token_kinds(content, language)
        if path.endswith(".xml"):
            found[path] = [
                (each.tag, each.attrib) for each in ElementTree.fromstring(content).iter()
            ]
    return found


@pytest.mark.long
@pytest.mark.timeout(900)  # a compiler for each of them
@given(action=odd_actions())
@settings(max_examples=examples(16), deadline=None)
def test_the_package_of_any_description_compiles_without_a_warning(action: Action) -> None:
    with tempfile.TemporaryDirectory() as folder:
        assert compile_errors(laid_out(package_files(action), Path(folder))) == ""


@given(action=odd_actions())
@settings(max_examples=examples(40), deadline=None)
def test_the_package_of_any_description_is_laid_out_as_its_style_says(action: Action) -> None:
    with tempfile.TemporaryDirectory() as folder:
        root = laid_out(package_files(action), Path(folder))
        sources = [str(path) for path in root.rglob("*.[ch]pp")]
        assert len(sources) >= 3
        assert layout_faults(sources) == ""


@given(text=hostile_texts)
@settings(max_examples=examples(400), deadline=None)
def test_no_text_changes_the_tokens_of_the_sources(text: str) -> None:
    assert shape(with_text(text)) == shape(with_text("harmless"))


@pytest.mark.parametrize("text", HOSTILE)
def test_no_known_escape_from_a_literal_or_comment_works(text: str) -> None:
    assert shape(with_text(text)) == shape(with_text("harmless"))


def test_texts_with_trigraphs_compile_where_these_are_read(tmp_path: Path) -> None:
    package = laid_out(package_files(with_text("".join(HOSTILE).replace(":", ""))), tmp_path)
    assert compile_errors(package, "-trigraphs") == ""


@given(text=hostile_texts)
@settings(max_examples=examples(100), deadline=None)
def test_a_description_with_nul_is_shown_and_ends_nothing(text: str) -> None:
    files = package_files(described(description=f"before \x00{text} after"))
    for path, content in files.items():
        assert b"\x00" not in content
        assert b"U+0000" in content or not path.endswith((".xml", ".txt", "ta_try.cpp"))


def test_cmake_sees_no_variable_in_a_description() -> None:
    text = package_files(described(description='a ${HOME} $ENV{HOME} @X@ "b" \\ c'))
    (line,) = (line for line in text["CMakeLists.txt"].decode().splitlines() if "project(" in line)
    assert r'"a \${HOME} \$ENV{HOME} \@X\@ \"b\" \\ c"' in line


@pytest.mark.long
@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"input_parameters": {}, "output_parameters": {}},
        {"input_parameters": {"empty": {}}},
        {"input_parameters": {kind: {"pvf_type": kind} for kind in NATIVE}},
        {"output_parameters": {kind: {"pvf_type": kind} for kind in NATIVE}},
        {
            "input_parameters": {
                "pose": {"position": {"x": {"pvf_type": "number"}}},
                "goal": {"position": {"x": {"pvf_type": "string"}}},
                "position": {"x": {"pvf_type": "bools"}},
            }
        },
        {"input_parameters": {"pose": {"pose": {"pose": {"pvf_type": "number"}}}}},
        {"input_parameters": {"pose": {"pose": {"x": {"pvf_type": "number"}}}, "pose_t": {}}},
        {"input_parameters": {"pose": {"x": {"pvf_type": "bool"}}, "pose_t": {"pvf_type": "bool"}}},
        {"input_parameters": {"input_parameters": {"a": {"pvf_type": "number"}}}},
        {"input_parameters": {"std": {"pvf_type": "string"}, "string": {"pvf_type": "string"}}},
        {"output_parameters": {"map": {"pvf_type": "nav_msgs::msg::OccupancyGrid"}}},
        {"name": "Continue"},
        {"name": "Time"},
        {"name": "move_arm"},
    ],
)
def test_descriptions_that_broke_other_generators_compile(
    fields: dict[str, Any], tmp_path: Path
) -> None:
    assert compile_errors(laid_out(package_files(described(**fields)), tmp_path)) == ""


def test_sixty_groups_in_each_other_compile(tmp_path: Path) -> None:
    group: dict[str, Any] = {"pvf_type": "number"}
    for _ in range(59):
        group = {"pose": group}
    files = package_files(described(input_parameters=group))
    assert compile_errors(laid_out(files, tmp_path)) == ""


@given(
    name=st.one_of(st.text(), hostile_texts, st.sampled_from(["../x", "COM1", "%00", "A" * 300]))
)
@settings(max_examples=examples(400), deadline=None)
def test_no_name_leads_out_of_the_package(name: str) -> None:
    action = Action(key="k", name=name)
    if check_name(name):
        with pytest.raises(ImpossiblePackage):
            package_files(action)
    else:
        files = package_files(action)
        assert all(part not in {"", ".", ".."} for path in files for part in path.split("/"))
        assert all(path.isascii() and path.isprintable() for path in files)


@pytest.mark.long
def test_real_actions_have_packages_or_a_reason_against_them(tmp_path: Path) -> None:
    if not CORPUS.is_dir():
        pytest.skip(NO_CORPUS)
    made: dict[tuple[tuple[str, bytes], ...], str] = {}
    refused: set[str] = set()
    for path in sorted(CORPUS.rglob("*.json")):
        try:
            graph = codec.read(path.read_bytes()).graph
        except codec.Unreadable:
            continue
        for action in distinct_actions(graph):
            try:
                made[tuple(package_files(action).items())] = action.name
            except ImpossiblePackage:
                refused.add(action.name)
    names = set(made.values())
    assert len(names) > 5 * len(refused - names)
    tried = list(made)[:: max(1, len(made) // examples(6))]
    for number, files in enumerate(tried):
        package = laid_out(dict(files), tmp_path / str(number))
        assert compile_errors(package) == "", made[files]
    sys.stdout.write(f"compiled {len(tried)} of {len(made)} packages of real actions\n")
