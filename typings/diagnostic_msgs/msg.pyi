class DiagnosticStatus:
    name: str
    level: bytes
    message: str
    def __init__(self, *, name: str = "", level: bytes = b"\0", message: str = "") -> None: ...

class DiagnosticArray:
    status: list[DiagnosticStatus]
    def __init__(self, *, status: list[DiagnosticStatus] = ...) -> None: ...
