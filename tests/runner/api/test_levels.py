"""A run three levels deep, over HTTP: why it failed, how often, and how another run differed."""

from typing import Any

from action_assistant.runner.start.admission import StartRequest
from action_assistant.umrf.digest import digest, tree_digest
from runner.harness import order, sequence
from runner.process import RunnerProcess, over, started
from runner.review.test_service import eventually
from runner.start.test_subgraph_starts import outer, sent

LAP = ("round_0", "lap_0")


def start(name: str, request: str, result: str = "on_true", laps: int = 2) -> StartRequest:
    """A run of `name`, in which `round` is, in which `lap` is; its last action ends so."""
    whole, inside = outer(name), (sent(outer("round", "lap")), sent(sequence("lap", laps)))
    last = {f"Work_{laps - 1}": [{"after_s": 0.1, "result": result, "message": "jammed"}]}
    pairs = [(each.name, each.digest) for each in inside]
    return order(
        whole,
        subgraphs=inside,
        tree_digest=tree_digest(digest(whole), pairs),
        request_id=request,
        script=last | {"*": [{"after_s": 0.1}]},
        graph="deep",
    )


def figures(told: dict[str, Any]) -> dict[tuple[str, ...], tuple[int, int, dict[str, int]]]:
    return {
        (*each["levels"], each["name"]): (each["runs"], each["visits"], each["results"])
        for each in told["actions"]
    }


def test_a_run_is_looked_back_on_by_its_levels(process: RunnerProcess) -> None:
    with process.client() as client:
        good = over(client, started(client, start("tour", "deep 1"))["id"])
        bad = over(client, started(client, start("tour", "deep 2", "on_error"))["id"])
        late = over(client, started(client, start("journey", "deep 3", laps=3))["id"])
        (cause, *_) = client.get(f"/api/runs/{bad['id']}/causes").json()
        assert cause["text"] == "round › lap › Work 1 ended in error: “jammed”"
        assert cause["action"] == "tour__round__0__lap__0/Work_1"

        def told() -> dict[str, Any]:
            found: dict[str, Any] = client.get("/api/statistics", params={"graph": "deep"}).json()
            return found

        eventually(lambda: len(told()["actions"]) == 5)
        found = figures(told())
        assert found[(*LAP, "Work_1")] == (3, 3, {"true": 2, "error": 1})
        assert found[(*LAP, "Work_2")] == (1, 1, {"true": 1})
        assert found[LAP] == (3, 3, {"true": 2, "error": 1})
        assert found[LAP[:1]][:2] == (3, 3)

        pair = {"a": good["id"], "b": bad["id"]}
        parted = client.get("/api/comparison", params=pair).json()
        step = parted["parting"]["step"]
        assert (step["levels"], step["name"], step["relation"]) == ([*LAP], "Work_1", "result")
        assert parted["text"].startswith("1 step was alike; then round_0 › lap_0 › Work_1: true")
        assert (parted["parting"]["messages_b"], parted["subgraphs"]) == (["jammed"], [])

        pair = {"a": good["id"], "b": late["id"]}
        other = client.get("/api/comparison", params=pair).json()
        assert other["subgraphs"] == ["lap"]
        relations = {(*each["levels"], each["name"]): each["relation"] for each in other["steps"]}
        assert relations == {
            LAP[:1]: "same",
            LAP: "same",
            (*LAP, "Work_0"): "same",
            (*LAP, "Work_1"): "same",
            (*LAP, "Work_2"): "only_b",
        }
