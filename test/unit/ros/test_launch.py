"""The master of a program that brings its system along."""

import secrets
import socket

import pytest

from solfer.errors import MiddlewareError
from solfer.middleware.ros.node.launch import EPHEMERAL_PORTS, Launch, free_port

ROS_PORT = 11311


def test_ports_are_free_and_not_those_of_connections():
    """A connection of anybody else may take an ephemeral port before the master binds to it."""
    with socket.socket() as connection:
        connection.bind(("", 0))
        ephemeral = int(EPHEMERAL_PORTS.read_text().split()[0])
        assert connection.getsockname()[1] >= ephemeral
    ports = [free_port() for _ in range(100)]
    assert len(set(ports)) > 90
    assert all(ROS_PORT < port < ephemeral for port in ports)


def test_a_port_that_is_taken_is_not_chosen(monkeypatch):
    with socket.socket() as master:
        master.bind(("", taken := free_port()))
        master.listen()
        ephemeral = int(EPHEMERAL_PORTS.read_text().split()[0])
        free = free_port()
        choices = iter(ephemeral - 1 - port for port in (taken, taken, free))
        monkeypatch.setattr(secrets, "randbelow", lambda _: next(choices))
        assert free_port() == free


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
