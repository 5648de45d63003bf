from collections.abc import Sequence

class UmrfGraphGet:
    class Request:
        @classmethod
        def get_fields_and_field_types(cls) -> dict[str, str]: ...

    class Response:
        umrf_jsons: Sequence[str]
        graph_jsons_indexed: Sequence[str]
        graph_jsons_running: Sequence[str]
        @classmethod
        def get_fields_and_field_types(cls) -> dict[str, str]: ...
