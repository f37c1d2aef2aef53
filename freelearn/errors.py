"""The one exception that a user's mistake raises."""


class UserError(Exception):
    """A mistake in what the user gave: says what is wrong, where, and what to do.

    The commands print it as one message without a traceback and exit with status 2.
    """
