"""What ends a command with a message instead of a traceback."""


class EvaluationError(Exception):
    """Says what is wrong, where, and how to mend it."""
