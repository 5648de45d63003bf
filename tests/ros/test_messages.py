"""The interfaces that were built are the ones that engines speak."""

import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from temoto_msgs.msg import (
    UmrfGraphFeedback,
    UmrfGraphModify,
    UmrfGraphPause,
    UmrfGraphResume,
    UmrfGraphStart,
    UmrfGraphStop,
)
from temoto_msgs.srv import UmrfGraphGet

TEXT, TEXTS = "string", "sequence<string>"


def test_every_field_stands_where_the_engine_reads_it() -> None:
    fields = {
        each.__name__: list(each.get_fields_and_field_types().items())
        for each in (
            UmrfGraphStart,
            UmrfGraphStop,
            UmrfGraphPause,
            UmrfGraphResume,
            UmrfGraphModify,
            UmrfGraphFeedback,
            UmrfGraphGet.Request,
            UmrfGraphGet.Response,
        )
    }
    named = [("umrf_graph_name", TEXT), ("targets", TEXTS)]
    assert fields == {
        "UmrfGraphStart": [
            ("umrf_graph_name", TEXT),
            ("umrf_graph_json", TEXT),
            ("targets", TEXTS),
            ("name_match_required", "boolean"),
        ],
        "UmrfGraphStop": named,
        "UmrfGraphPause": named,
        "UmrfGraphResume": named,
        "UmrfGraphModify": [*named, ("modified_graph", TEXT), ("continue_from", TEXT)],
        "UmrfGraphFeedback": [("actor", TEXT), ("history", TEXTS)],
        "UmrfGraphGet_Request": [],
        "UmrfGraphGet_Response": [
            ("umrf_jsons", TEXTS),
            ("graph_jsons_indexed", TEXTS),
            ("graph_jsons_running", TEXTS),
        ],
    }
