"""check, convert and simulate, as a person or a script runs them."""

import json
from pathlib import Path
from typing import Any

import pytest

from action_assistant import paths as places
from action_assistant.cli import main
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from support.command_line import ran

EXAMPLES = sorted(places.examples().glob("*.json"))


@pytest.fixture
def example() -> Path:
    """Return one of the graphs that greet a new user."""
    return EXAMPLES[0]


def written(folder: Path, value: object) -> str:
    """A file with this JSON."""
    path = folder / "graph.json"
    path.write_text(value if isinstance(value, str) else json.dumps(value))
    return str(path)


TWO: dict[str, Any] = {
    "graph_name": "two",
    "graph_entry": [{"name": "A"}],
    "graph_exit": [{"name": "B"}],
    "actions": [
        {"name": "A", "type": "sync", "children": [{"name": "B"}]},
        {
            "name": "B",
            "type": "sync",
            "parents": [
                {
                    "name": "A",
                    "conditions": ["on_false -> run", "on_true -> ignore", "on_error -> ignore"],
                }
            ],
        },
    ],
}


def test_a_good_file_has_no_errors_and_exit_code_0(example: Path) -> None:
    answer = ran("check", str(example))
    assert answer.returncode == 0
    assert "0 errors" in answer.stdout


def test_a_ghost_is_an_error_with_its_place(tmp_path: Path) -> None:
    graph = {**TWO, "graph_entry": [{"name": "Missing"}]}
    answer = ran("check", "--json", written(tmp_path, graph))
    assert answer.returncode == 1
    (verdict,) = json.loads(answer.stdout)
    assert verdict["dialect"] == "D3"
    assert any(
        problem["severity"] == "error" and "Missing" in problem["message"]
        for problem in verdict["problems"]
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "line"),
        ("{", "line"),
        ("[]", "no object"),
        ('{"a": 1}', "neither"),
        ('{"graph_name": "g", "graph_name": "h", "actions": []}', "graph_name"),
        ('{"graph_name": "g", "actions": [], "x": NaN}', "NaN"),
        ('{"graph_name": "g", "actions": ' + "[" * 500 + "]" * 500 + "}", "deep"),
    ],
)
def test_a_file_that_is_no_umrf_is_a_problem_too(tmp_path: Path, text: str, words: str) -> None:
    path = written(tmp_path, text)
    checked = ran("check", "--json", path)
    assert checked.returncode == 1
    (verdict,) = json.loads(checked.stdout)
    (problem,) = verdict["problems"]
    assert problem["severity"] == "error"
    converted = ran("convert", path)
    assert converted.returncode == 1
    assert converted.stdout == ""
    assert words in problem["message"] or words in converted.stderr


def test_a_file_that_is_not_there_is_wrong_use(tmp_path: Path) -> None:
    answer = ran("check", str(tmp_path / "none.json"))
    assert answer.returncode == 2
    assert len(answer.stderr.splitlines()) == 1


@pytest.mark.parametrize("through", [[], ["--through-document"]])
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_converting_keeps_the_meaning(
    path: Path, through: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["convert", *through, str(path)]) == 0
    converted = capsys.readouterr().out
    before, after = codec.read(path.read_bytes()).graph, codec.read(converted).graph
    assert digest(before) == digest(after)


def test_simulate_prints_a_trace_for_programs(tmp_path: Path) -> None:
    answer = ran("simulate", "--trace", written(tmp_path, TWO))
    assert answer.returncode == 0
    events = [json.loads(line) for line in answer.stdout.splitlines()]
    assert events[0]["kind"] == "graph_state"
    assert events[0]["state"] == "UNINITIALIZED"
    nodes = [(event["node"], event["state"]) for event in events if event["kind"] == "node_state"]
    assert nodes == [("A_0", "INITIALIZED"), ("A_0", "RUNNING"), ("A_0", "FINISHED")]


@pytest.mark.parametrize(("result", "plays"), [("on_true", "C_0"), ("on_false", "B_0")])
def test_exactly_one_of_two_branches_runs(tmp_path: Path, result: str, plays: str) -> None:
    def branch(name: str, outcome: str) -> dict[str, object]:
        rest = [f"{o} -> ignore" for o in ("on_true", "on_false", "on_error") if o != outcome]
        parent = {"name": "A", "conditions": [f"{outcome} -> run", *rest]}
        return {"name": name, "type": "sync", "parents": [parent]}

    graph = {
        "graph_name": "branches",
        "graph_entry": [{"name": "A"}],
        "graph_exit": [{"name": "B", "required": False}, {"name": "C", "required": False}],
        "actions": [
            {"name": "A", "type": "sync", "children": [{"name": "B"}, {"name": "C"}]},
            branch("B", "on_false"),
            branch("C", "on_true"),
        ],
    }
    script = tmp_path / "script.json"
    script.write_text(json.dumps({"behaviours": {"A": [{"result": result}]}}))
    answer = ran("simulate", "--trace", "--script", str(script), written(tmp_path, graph))
    events = [json.loads(line) for line in answer.stdout.splitlines()]
    running = [e["node"] for e in events if e["kind"] == "node_state" and e["state"] == "RUNNING"]
    assert running == ["A_0", plays]


def test_a_stop_at_a_time_stops(tmp_path: Path) -> None:
    answer = ran("simulate", "--trace", "--at", "300:stop", written(tmp_path, TWO))
    events = [json.loads(line) for line in answer.stdout.splitlines()]
    graph = [event["state"] for event in events if event["kind"] == "graph_state"]
    assert graph[-1] == "STOPPED"


@pytest.mark.parametrize(
    "change",
    [
        {"graph_entry": {"actions": [{"name": "A"}]}},
        {"graph_entry": [{"name": "Missing"}]},
        {"actions": [{"name": "A"}]},
    ],
)
def test_a_graph_that_the_engines_parser_refuses_is_not_simulated(
    tmp_path: Path, change: dict[str, object]
) -> None:
    answer = ran("simulate", "--trace", written(tmp_path, {**TWO, **change}))
    assert answer.returncode == 1
    assert answer.stdout == ""
    assert "the engine refuses it" in answer.stderr


def test_a_run_state_in_the_file_is_an_error_and_kills_the_simulated_engine(tmp_path: Path) -> None:
    first, second = TWO["actions"]
    path = written(tmp_path, {**TWO, "actions": [{**first, "state": "FINISHED"}, second]})
    (verdict,) = json.loads(ran("check", "--json", path).stdout)
    assert "H1" in {problem["code"] for problem in verdict["problems"]}
    answer = ran("simulate", "--trace", path)
    assert answer.returncode == 0
    last = json.loads(answer.stdout.splitlines()[-1])
    assert (last["kind"], last["code"]) == ("hazard", "H1")


def test_a_problem_of_nearly_every_graph_is_one_note_at_the_end(
    tmp_path: Path,
) -> None:
    """`on_error` bypasses unless a file says otherwise, in all of these arrows."""
    names = ["A", "B", "C", "D"]
    chain = [
        {"name": name, "type": "sync",
         "parents": [{"name": n} for n in names[max(0, place - 1):place]],
         "children": [{"name": n} for n in names[place + 1:place + 2]]}
        for place, name in enumerate(names)
    ]  # fmt: skip
    chain[3]["type"] = "other"
    ends = {"graph_entry": [{"name": "A"}], "graph_exit": [{"name": "D"}]}
    path = written(tmp_path, {"graph_name": "g", "actions": chain} | ends)
    first, *lines = ran("check", path).stdout.splitlines()
    assert first.endswith("0 errors, 1 warnings")
    assert [line.split()[:2] for line in lines] == [["warning", "type-unknown:"], ["note", "H3:"]]
    (told,) = json.loads(ran("check", "--json", path).stdout)
    assert [(p["code"], p["severity"]) for p in told["problems"]][-1] == ("H3", "warning")


def action_file(folder: Path, name: str, **inputs: object) -> None:
    (folder / name).mkdir(parents=True)
    described = {"name": name, "type": "sync", "input_parameters": inputs}
    (folder / name / f"{name.lower()}.umrf.json").write_text(json.dumps(described))


def test_simulate_takes_the_actions_of_a_folder_as_check_does(tmp_path: Path) -> None:
    path, folder = written(tmp_path, TWO), tmp_path / "actions"
    names = [each["name"] for each in TWO["actions"]]
    for name in names:
        action_file(folder, name)
    answer = ran("simulate", "--trace", "--actions", str(folder), path)
    assert answer.returncode == 0
    assert json.loads(answer.stdout.splitlines()[-1])["state"] == "FINISHED"
    assert "refused" not in answer.stdout


@pytest.mark.parametrize("other", [{}, {"speed": {"pvf_type": "number"}}])
def test_a_graph_with_an_action_that_the_folder_lacks_is_refused_and_says_which(
    tmp_path: Path, other: dict[str, object]
) -> None:
    path, folder = written(tmp_path, TWO), tmp_path / "actions"
    folder.mkdir()
    if other:
        action_file(folder, TWO["actions"][0]["name"], **other)
    answer = ran("simulate", "--trace", "--actions", str(folder), path)
    events = [json.loads(line) for line in answer.stdout.splitlines()]
    assert [each["code"] for each in events if each["kind"] == "hazard"] == ["refused"]
    assert TWO["actions"][0]["name"] in answer.stderr
    assert ("speed" in answer.stderr) == bool(other)
    assert "RUNNING" not in answer.stdout


def test_simulate_tells_a_person_what_the_engine_would_do_wrong(tmp_path: Path) -> None:
    graph = {**TWO, "actions": [TWO["actions"][0], {"name": "B", "type": "sync"}]}
    answer = ran("simulate", written(tmp_path, graph))
    assert answer.returncode == 0
    assert "hazard H2: The child in “A_0 => B_0” does not list it" in answer.stdout


@pytest.mark.parametrize("trace", [[], ["--trace"]])
def test_a_simulation_that_is_cut_off_says_so(tmp_path: Path, trace: list[str]) -> None:
    """A loop without end in which each lap takes a moment: 100,000 events come before a day is over."""
    again = {"name": "B", "required": False, "conditions": ["on_error -> ignore"]}
    first, second = TWO["actions"]
    actions = [
        {**first, "parents": [again], "children": [{"name": "B"}]},
        {**second, "parents": [{"name": "A"}], "children": [{"name": "A"}]},
    ]
    loop = {**TWO, "actions": actions, "graph_entry": [{"name": "A"}], "graph_exit": []}
    answer = ran("simulate", *trace, written(tmp_path, loop))
    assert answer.returncode == 1
    assert "The simulation ends here, after 100,000 events" in answer.stderr
    last = answer.stdout.splitlines()[-1]
    if trace:
        told = json.loads(last)
        assert (told["kind"], told["code"], told["effect"]) == ("hazard", "events", "cut off")
    else:
        assert "hazard events: The simulation ends here" in last


def test_a_sub_graph_is_judged_as_it_is_inside_the_graph_that_uses_it(tmp_path: Path) -> None:
    leaf = {"p": {"pvf_type": "string"}}
    inner = {
        "graph_name": "Inner",
        "actions": [{"name": "A", "type": "sync", "input_parameters": leaf}],
    }
    given = {"p": {"pvf_type": "string", "pvf_value": "x"}}
    outer = {
        "graph_name": "outer",
        "actions": [{"name": "Inner", "type": "sync", "input_parameters": given}],
    }
    paths = []
    for name, value in (("inner", inner), ("outer", outer)):
        path = tmp_path / f"{name}.graph.json"
        path.write_text(json.dumps(value))
        paths.append(str(path))
    together = ran("check", "--json", *paths)
    assert together.returncode == 0
    assert [verdict["problems"] for verdict in json.loads(together.stdout)] == [[], []]
    alone = ran("check", "--json", paths[0])
    assert alone.returncode == 0
    (problem,) = json.loads(alone.stdout)[0]["problems"]
    assert (problem["code"], problem["severity"]) == ("H7", "warning")
    assert "Unless it is used inside another graph" in problem["message"]


def test_the_file_of_an_action_is_checked_as_such(tmp_path: Path) -> None:
    path = written(tmp_path, {"name": "Go", "type": "sync", "input_parameters": {"x": 5}})
    answer = ran("check", "--json", path)
    assert answer.returncode == 1
    (verdict,) = json.loads(answer.stdout)
    assert verdict["dialect"] == "D3-action"
    (problem,) = verdict["problems"]
    assert (problem["code"], problem["where"]["path"]) == (
        "parameter-illegal",
        "/input_parameters/x",
    )


def test_check_says_line_and_column_in_the_file_also_of_an_old_one(tmp_path: Path) -> None:
    action = '{"name": "Go", "id": 3,\n  "effect": "synchronous", "package_name": "go"}'
    path = written(tmp_path, '\ufeff{"graph_name": "g",\r\n "umrf_actions": [\n  ' + action + "]}")
    (verdict,) = json.loads(ran("check", "--json", path).stdout)
    places = {p["code"]: p["where"] for p in verdict["problems"]}
    assert places["dialect-old"] == {"path": "/umrf_actions", "line": 2, "column": 2}
    notes = {note["message"]: note["where"] for note in verdict["notes"]}
    effect = notes["The effect “synchronous” became the type sync."]
    assert effect == {"path": "/umrf_actions/0/effect", "line": 4, "column": 3}
    told = ran("check", path).stdout
    assert "error dialect-old" in told
    assert "(line 2, column 2: /umrf_actions)" in told
    assert "(line 4, column 3: /umrf_actions/0/effect)" in told
    assert f"{path}:4:3: The effect" in ran("convert", path).stderr


def test_a_file_that_is_no_json_is_refused_with_line_and_column_also_for_programs(
    tmp_path: Path,
) -> None:
    (verdict,) = json.loads(ran("check", "--json", written(tmp_path, '{"a":\n  oops}')).stdout)
    (problem,) = verdict["problems"]
    assert (problem["where"]["line"], problem["where"]["column"]) == (2, 3)


@pytest.mark.parametrize(
    "value",
    [
        {"name": "left-pad", "version": "1.3.0", "type": "module", "dependencies": {}},
        {"name": "pkg", "type": "module"},
        {"name": "acme/site", "type": "project", "require": {"php": ">=8"}},
        {"name": "lib", "type": "SHARED_LIBRARY", "artifacts": [], "id": "lib::@6890"},
        {"type": "object", "title": "A schema", "properties": {"name": {"type": "string"}}},
        {"type": "Feature", "name": "Tartu", "geometry": None, "properties": {}},
    ],
)
def test_a_file_that_only_has_a_name_and_a_type_is_no_umrf(tmp_path: Path, value: object) -> None:
    path = written(tmp_path, value)
    (verdict,) = json.loads(ran("check", "--json", path).stdout)
    assert [problem["code"] for problem in verdict["problems"]] == ["not-umrf"]
    assert ran("convert", path).returncode == 1


def test_a_list_of_actions_is_told_as_one(tmp_path: Path) -> None:
    action = {"name": "Go", "effect": "synchronous", "children": [{"name": "Stop", "id": 0}]}
    answer = ran("convert", written(tmp_path, [action, {**action, "name": "Stop"}]))
    assert answer.returncode == 1
    assert "a list with 2 single actions" in answer.stderr


def test_examples_become_values_when_asked(tmp_path: Path) -> None:
    leaf = {"pvf_type": "number", "pvf_example": "2"}
    action = {
        "name": "Go",
        "id": 0,
        "effect": "synchronous",
        "input_parameters": {"a": {"b": leaf}},
    }
    path = written(tmp_path, {"graph_name": "g", "umrf_actions": [action]})
    assert "pvf_value" not in ran("convert", path).stdout
    answer = ran("convert", "--examples", path)
    assert json.loads(answer.stdout)["actions"][0]["input_parameters"]["a"]["b"]["pvf_value"] == 2
    assert "“a::b”" in answer.stderr


def test_check_knows_the_actions_and_sub_graphs_of_folders(tmp_path: Path) -> None:
    file = written(tmp_path, TWO)
    known = tmp_path / "known"
    known.mkdir()
    needs = {"speed": {"pvf_type": "number"}}
    (known / "a.umrf.json").write_text(
        json.dumps({"name": "A", "type": "sync", "input_parameters": needs})
    )
    (known / "b.graph.json").write_text(
        json.dumps({"graph_name": "B", "actions": [{"name": "C", "type": "sync"}],
                    "graph_entry": [{"name": "C"}], "graph_exit": []})
    )  # fmt: skip
    (known / "broken.umrf.json").write_text("{")

    def codes(*options: str) -> set[str]:
        answer = ran("check", "--json", file, *options)
        return {p["code"] for p in json.loads(answer.stdout)[0]["problems"]} - {"H3"}

    assert codes() == set()
    assert codes("--actions", str(known)) == {"signature", "unknown-action"}
    assert codes("--graphs", str(known)) == {"H8"}
    assert codes("--graphs", str(known), "--actions", str(known)) == {"signature", "H8"}
    assert "left out" in ran("check", file, "--actions", str(known)).stderr


def test_a_script_that_makes_no_sense_is_wrong_use(tmp_path: Path) -> None:
    script = tmp_path / "script.json"
    script.write_text('{"behaviours": {"A": [{"after_s": "soon"}]}}')
    answer = ran("simulate", "--script", str(script), written(tmp_path, TWO))
    assert answer.returncode == 2
    assert "script" in answer.stderr


@pytest.mark.parametrize(
    "command",
    ["serve editor runner migrate check convert simulate import export graphs runs run stop"][
        0
    ].split(),
)
def test_every_command_has_help_with_an_example(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main([command, "--help"])
    assert ended.value.code == 0
    assert f"example: action-assistant {command}" in capsys.readouterr().out


def test_wrong_use_is_exit_code_2() -> None:
    for arguments in ([], ["nonsense"], ["serve", "--port", "0"], ["simulate", "x", "--at", "y"]):
        assert ran(*arguments).returncode == 2
