"""The end of a process without ROS, its errors, and its log."""

import logging
import os
import signal
import sys
import threading

import pytest

from solfer.errors import ConfigError
from solfer.process import SIGNALS, ProcessEnd, run_main
from solfer.realtime.background_logs import logged_apart


@pytest.fixture(autouse=True)
def _handlers_and_log_as_before():
    handlers, root = {number: signal.getsignal(number) for number in SIGNALS}, logging.getLogger()
    logs, level = root.handlers[:], root.level
    yield
    for number, handler in handlers.items():
        signal.signal(number, handler)
    root.handlers[:] = logs
    root.setLevel(level)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_asks_for_the_end_once(number):
    asked = []
    end = ProcessEnd(lambda: asked.append(1))
    assert end.running() and not asked
    os.kill(os.getpid(), number)
    assert not end.running() and asked == [1]
    assert [signal.getsignal(each) for each in SIGNALS] == [signal.SIG_DFL] * 3  # a second one ends it at once


def test_close_restores_the_earlier_handlers():
    def mine(number, frame):
        pass

    signal.signal(signal.SIGTERM, mine)
    before = [signal.getsignal(each) for each in SIGNALS]
    end = ProcessEnd()
    assert signal.getsignal(signal.SIGTERM) is not mine
    end.close()
    assert [signal.getsignal(each) for each in SIGNALS] == before


def fails(_):
    raise ConfigError("a wrong rate", where="robot.yaml:3:1", expected="above 0")


def interrupted(_):
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("main", "code", "text"),
    [
        (lambda arguments: len(arguments), 2, ""),
        (fails, 2, "error: robot.yaml:3:1: a wrong rate\n  expected: above 0\n"),
        (interrupted, 130, ""),
    ],
)
def test_the_exit_code_is_that_of_main(monkeypatch, capsys, main, code, text):
    monkeypatch.setattr(sys, "argv", ["xbot", "robot.yaml", "__name:=xbot", "/tf:=tf", "--rate"])
    with pytest.raises(SystemExit) as ended:
        run_main(main)
    assert (ended.value.code, capsys.readouterr()) == (code, ("", text))


def test_a_node_logs_to_its_output(monkeypatch, capsys):
    logging.getLogger().handlers.clear()
    monkeypatch.setattr(sys, "argv", ["xbot"])

    def main(_):
        logging.getLogger("solfer.arm").info("moves")
        logging.getLogger("solfer.arm").debug("unseen")
        return 0

    with pytest.raises(SystemExit):
        run_main(main)
    assert capsys.readouterr().out == "[INFO] [solfer.arm]: moves\n"


class KeptRecords(logging.Handler):
    """Keeps messages and the threads that wrote them."""

    def __init__(self, level):
        super().__init__(level)
        self.kept = []

    def emit(self, record):
        self.kept.append((record.getMessage(), threading.get_ident()))


def test_another_thread_writes_the_log():
    root, every, errors = logging.getLogger(), KeptRecords(logging.INFO), KeptRecords(logging.ERROR)
    root.handlers[:] = [every, errors]
    root.setLevel(logging.INFO)
    with pytest.raises(ZeroDivisionError), logged_apart():
        logging.info("first")
        logging.error("second")
        1 / 0  # noqa: B018
    assert root.handlers == [every, errors]
    assert [text for text, _ in every.kept] == ["first", "second"] and [text for text, _ in errors.kept] == ["second"]
    assert threading.get_ident() not in {thread for _, thread in every.kept}
    logging.info("third")
    assert every.kept[2] == ("third", threading.get_ident())


def test_handlers_that_a_component_replaces_are_taken_back(caplog):
    end = ProcessEnd()
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    signal.signal(signal.SIGINT, lambda number, frame: None)
    assert end.running() and end.running()
    assert len(caplog.messages) == 1 and "handled by others" in caplog.text
    os.kill(os.getpid(), signal.SIGTERM)
    assert not end.running()
    assert [signal.getsignal(each) for each in SIGNALS] == [signal.SIG_DFL] * 3


def test_a_forked_child_does_not_go_on_as_a_second_process():
    end = ProcessEnd()
    child = os.fork()
    if not child:
        end.running()
        os._exit(0)  # it went on
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 1
    assert end.running()
