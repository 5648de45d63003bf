"""The recordings of this repository are complete, and those of any other folder can be compared."""

import os
import re
import subprocess
import sys
import tarfile
from pathlib import Path

from support.recordings import OWN, facts, family, pack, unpacked

CONFORMANCE = Path(__file__).with_name("test_conformance.py")


def archives(folder: str) -> dict[str, list[str]]:
    """Names of files by the name of the archive."""
    found = {}
    for path in sorted((OWN / folder).glob("*.tar.xz")):
        with tarfile.open(path) as tar:
            found[path.name.removesuffix(".tar.xz")] = tar.getnames()
    return found


def test_each_index_names_every_recording_of_its_folder_and_no_other() -> None:
    files = archives("engine")
    for section in (OWN / "engine" / "INDEX.md").read_text().split("\n## ")[1:]:
        (archive,) = re.findall(r"`(.+)\.tar\.xz`", section)
        names = set(re.findall(r"(?m)^\| (\w+) \|", section)) - {"graph"}
        assert {f"{name}.trace.jsonl" for name in names} == {
            file for file in files[archive] if re.fullmatch(r"\w+\.trace\.jsonl", file)
        }
    told = re.findall(r"(?m)^- `(\S+\.jsonl)`: .*feedback", (OWN / "node" / "INDEX.md").read_text())
    node = [file for each in archives("node").values() for file in each]
    assert sorted(told) == sorted(file for file in node if file.endswith(".jsonl"))


def test_the_readme_tells_what_each_archive_shows() -> None:
    readme = (OWN / "README.md").read_text()
    for folder in ("engine", "node"):
        for name in archives(folder):
            assert re.search(rf"\b{name}\b", readme), name


def test_no_graph_of_another_repository_is_kept_here() -> None:
    kept = {Path(file).name for files in archives("engine").values() for file in files}
    elsewhere = {f"{name}.graph.json" for name in facts("engine").get("elsewhere", ())}
    assert not kept & elsewhere


def test_an_archive_says_the_same_whoever_packed_it(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("1")
    (tmp_path / "b").write_text("2")
    first, second = tmp_path / "first.tar.xz", tmp_path / "second.tar.xz"
    here = Path.cwd()
    try:
        os.chdir(tmp_path)
        pack(first, [Path("b")])
        pack(first, [Path("a")])
        pack(second, [Path("a"), Path("b")])
    finally:
        os.chdir(here)
    assert first.read_bytes() == second.read_bytes()
    there = unpacked(tmp_path)
    assert ((there / "a").read_text(), (there / "b").read_text()) == ("1", "2")


def compared(recordings: Path) -> str:
    """Return the result of the conformance suite for a folder of recordings."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(CONFORMANCE)]
    environment = os.environ | {"UMRF_RECORDINGS": str(recordings)}
    environment.pop("PYTEST_XDIST_WORKER", None)
    done = subprocess.run(
        command, env=environment, cwd=OWN.parents[1], capture_output=True, text=True, check=False
    )
    return done.stdout


def test_any_folder_of_recordings_can_be_compared(tmp_path: Path) -> None:
    folder = tmp_path / "engine"
    folder.mkdir()
    own = family("engine")
    (folder / "facts.json").write_text(
        '{"engine": "5819055", "actor": "ae_oracle", "resolved": [], "behaviours": {},'
        ' "sub_graphs": [], "not_compared": {},'
        ' "actions": {"OxWork": {"after_s": {"input": "delay", "else": 0.1}}, "*": {}}}'
    )
    for name in ("mine", "wrong"):
        for path in (own / "join_and.graph.json", own / "join_and.trace.jsonl"):
            text = path.read_text().replace("join_and.graph.json", f"{name}.graph.json")
            (folder / path.name.replace("join_and", name)).write_text(text)
    trace = folder / "wrong.trace.jsonl"
    trace.write_text(trace.read_text().replace('"state":"FINISHED"', '"state":"ERROR"'))
    said = compared(tmp_path)
    assert "1 failed, 1 passed" in said
    assert "[wrong]" in said
