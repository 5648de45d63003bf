"""What people say of a version is kept with it."""

import httpx


def test_a_version_has_a_name_and_a_note_of_its_author(http: httpx.Client) -> None:
    graph = http.post("/api/graphs", json={"name": "valves"}).json()["id"]
    body = {"label": "gentle", "note": "  Slower at the seal.\nFor atlas only.  "}
    version = http.post(f"/api/graphs/{graph}/versions", json=body).json()
    assert version["note"] == "Slower at the seal.\nFor atlas only."
    assert http.get(f"/api/versions/{version['id']}").json() == version
    (listed,) = http.get(f"/api/graphs/{graph}/versions").json()
    assert (listed["label"], listed["note"]) == ("gentle", version["note"])
    # What is said of a moment makes another version of it; nothing said names the newest one.
    noted = http.post(f"/api/graphs/{graph}/versions", json={"note": "tried on Monday"})
    assert noted.status_code == 201
    again = http.post(f"/api/graphs/{graph}/versions", json={})
    assert (again.status_code, again.json()["id"]) == (200, noted.json()["id"])
    refused = http.post(f"/api/graphs/{graph}/versions", json={"note": "x" * 4001})
    assert (refused.status_code, refused.json()["where"]["path"]) == (400, "/note")
