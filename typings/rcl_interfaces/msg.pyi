from builtin_interfaces.msg import Time

class Log:
    stamp: Time
    level: int
    name: str
    msg: str
    def __init__(
        self, *, stamp: Time = ..., level: int = 0, name: str = "", msg: str = ""
    ) -> None: ...
