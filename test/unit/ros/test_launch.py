"""The master of a program that brings its system along."""

import socket

import pytest

from solfer.errors import MiddlewareError
from solfer.middleware.ros.node.launch import Launch, free_port


def test_two_starts_get_different_masters():
    first, second = free_port(), free_port()
    assert 11311 not in (first, second)
    with socket.socket() as master:
        master.bind(("", first))
        master.listen()
        assert free_port() != first


@pytest.mark.slow
def test_a_launch_that_ends_reports_its_output(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://localhost:1")  # put back afterwards: Launch sets it
    with Launch(["solfer", "no_such_file.launch"], tmp_path / "log", free_port()) as system:
        with pytest.raises(MiddlewareError, match="no_such_file.launch"):
            system.wait_for_master(20.0)


def test_a_folder_that_cannot_be_made(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://localhost:1")
    (tmp_path / "file").write_text("")
    with pytest.raises(MiddlewareError, match="cannot be made"):
        Launch([], tmp_path / "file" / "log", free_port()).__enter__()
