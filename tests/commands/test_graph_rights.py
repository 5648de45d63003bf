"""`rights`: who may see and edit a graph or folder, from the command line."""

import json

import pytest

from action_assistant.cli import main
from support.product import TOKEN, running


def test_rights_are_shown_set_and_brought_to_the_runner(
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    def said(*words: str, code: int = 0) -> str:
        assert main(list(words)) == code
        told = capfd.readouterr()
        return told.err if code else told.out

    with running(tmp_path_factory.mktemp("rights") / "data") as product:
        monkeypatch.setenv("ACTION_ASSISTANT_URL", product.url)
        monkeypatch.setenv("ACTION_ASSISTANT_TOKEN", TOKEN)
        with product.editor() as owner:
            for name in ("Ann", "Bo"):
                body = {"name": name, "role": "editor"}
                assert owner.post("/api/members", json=body).status_code == 201
            assert owner.post("/api/groups", json={"name": "Night shift"}).status_code == 201
            assert owner.post("/api/graphs", json={"name": "patrol"}).status_code == 201
        said("folders", "new", "Lab/Night")
        said("folders", "put", "patrol", "--into", "Lab/Night")
        assert said("rights", "patrol") == "Everybody may see and edit it.\n"
        folder = "--folder", "Lab/Night"
        assert said("rights", *folder, "--see", "night shift", "Ann", "--edit", "Ann") == (
            "Only Night shift and Ann may see them. Only Ann may edit them.\n"
        )
        assert said("rights", "patrol") == (
            "Only Night shift and Ann may see it. Only Ann may edit it.\n"
            "So says the folder around it.\n"
        )
        assert said("rights", "patrol", "--see", "all", "--edit", "nobody") == (
            "Everybody may see it. Only owners may edit it.\n"
        )
        assert json.loads(said("rights", "patrol", "--json"))["own"] == {
            "readers": "all",
            "editors": [],
        }
        assert "So says the folder" in said("rights", "patrol", "--inherit")
        audit = said("audit", "--kind", "graphs")
        assert "said who may see patrol: Everybody may see it. Only owners may edit it." in audit
        assert "in the folder Night: Only Night shift and Ann may see them. Only Ann" in audit
        assert "said who may see patrol: as the folder around says" in audit
        assert "No person or group is called 'Cy'" in said(
            "rights", "patrol", "--see", "Cy", code=1
        )
        assert "Name a folder" in said("rights", "--folder", "/", code=1)
        said("folders", "move", "Lab/Night", "--into", "/")
        assert said("rights", *folder[:1], "Night").startswith("Only Night shift and Ann")
