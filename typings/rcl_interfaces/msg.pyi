class Log:
    level: int
    name: str
    msg: str
    def __init__(self, *, level: int = 0, name: str = "", msg: str = "") -> None: ...
