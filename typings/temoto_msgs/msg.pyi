from collections.abc import Sequence

class _Fields:
    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]: ...

class UmrfGraphStart(_Fields):
    umrf_graph_name: str
    umrf_graph_json: str
    targets: Sequence[str]
    name_match_required: bool
    def __init__(
        self,
        *,
        umrf_graph_name: str = "",
        umrf_graph_json: str = "",
        targets: Sequence[str] = (),
        name_match_required: bool = False,
    ) -> None: ...

class UmrfGraphStop(_Fields):
    umrf_graph_name: str
    targets: Sequence[str]
    def __init__(self, *, umrf_graph_name: str = "", targets: Sequence[str] = ()) -> None: ...

class UmrfGraphPause(_Fields):
    umrf_graph_name: str
    targets: Sequence[str]
    def __init__(self, *, umrf_graph_name: str = "", targets: Sequence[str] = ()) -> None: ...

class UmrfGraphResume(_Fields):
    umrf_graph_name: str
    targets: Sequence[str]
    def __init__(self, *, umrf_graph_name: str = "", targets: Sequence[str] = ()) -> None: ...

class UmrfGraphModify(_Fields):
    umrf_graph_name: str
    targets: Sequence[str]
    modified_graph: str
    continue_from: str
    def __init__(
        self,
        *,
        umrf_graph_name: str = "",
        targets: Sequence[str] = (),
        modified_graph: str = "",
        continue_from: str = "",
    ) -> None: ...

class UmrfGraphFeedback(_Fields):
    actor: str
    history: Sequence[str]
    def __init__(self, *, actor: str = "", history: Sequence[str] = ()) -> None: ...
