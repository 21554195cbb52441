"""The two ways in which a verb fails without a traceback."""


class InputError(Exception):
    """The user's input is refused. The message names file, line or key, what was found and what was expected."""

    exit_code = 2


class ToolFailed(Exception):
    """A program that a verb started has failed. An empty message: that program has already said why."""

    def __init__(self, message: str = "", exit_code: int = 1):
        super().__init__(message)
        self.exit_code = exit_code
