"""What the page's server writes into the terminal."""

import logging
import sys

import pytest
from tornado.websocket import WebSocketClosedError

from freelearn.workbench.server import of_interest


@pytest.mark.parametrize(("problem", "told"), [(WebSocketClosedError(), False), (ValueError("mine"), True)])
def test_a_tab_that_was_closed_is_no_fault(problem, told):
    try:
        raise problem
    except type(problem):
        record = logging.LogRecord("asyncio", logging.ERROR, "", 1, "never retrieved", None, sys.exc_info())
    assert of_interest(record) is told


def test_what_has_no_exception_is_told():
    assert of_interest(logging.LogRecord("bokeh", logging.WARNING, "", 1, "port", None, None))


def test_a_tab_that_was_loaded_anew_before_it_was_there_is_no_fault():
    told = "Failed sending message as connection was closed"
    assert not of_interest(logging.LogRecord("bokeh.server.views.ws", logging.WARNING, "", 1, told, None, None))
