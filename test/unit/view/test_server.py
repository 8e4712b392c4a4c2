"""The server of the page answers only those that know its address, from its own origin, on this machine."""

import http.client
import socket

import pytest
from websockets.exceptions import InvalidStatus

viser = pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")

from support.page import opened_page  # noqa: E402

from solfer.view import PageServer  # noqa: E402


@pytest.fixture(scope="module")
def server():
    made = PageServer(0)
    yield made
    made.close()


def status(server, path, **headers):
    """Ask for a path, and return status and headers."""
    port = server.viser.get_port()
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=5.0)
    host = headers.pop("Host", f"localhost:{port}")
    connection.request("GET", path, headers={"Host": host, **headers})
    answer = connection.getresponse()
    return answer.status, dict(answer.getheaders())


def test_the_address_serves_the_page(server):
    path = "/" + server.address.split("/", 3)[3]
    code, headers = status(server, path)
    assert code == 200 and headers["Referrer-Policy"] == "no-referrer"
    assert server.address.startswith("http://localhost:") and len(path) > 30


@pytest.mark.parametrize("path", ["/", "/index.html", "/wrong/", "//", "/?token"])
def test_without_the_token_there_is_nothing(server, path):
    assert status(server, path)[0] == 403
    token = server.address.split("/")[3]
    assert status(server, f"/{token[:-1]}/")[0] == 403
    assert status(server, f"/{token}x/")[0] == 403


def test_another_host_or_origin_gets_nothing(server):
    path = "/" + server.address.split("/", 3)[3]
    assert status(server, path, Host="evil.example")[0] == 403
    assert status(server, path, Origin="http://evil.example")[0] == 403
    assert status(server, path, Upgrade="WebSocket")[0] == 403  # no origin at all


def test_pages_connect_with_token_and_origin_alone(server):
    with opened_page(server.address) as page:
        page.receive(0.5)
        assert page.gui or page.nodes
    for address, origin in ((server.address, "http://evil.example"), (server.address[:-2], None)):
        with pytest.raises(InvalidStatus), opened_page(address, origin):
            pass


def test_only_the_address_of_this_machine_is_served(server):
    for other in ("127.0.0.2", "::1"):
        with pytest.raises(OSError):
            socket.create_connection((other, server.viser.get_port()), timeout=1.0).close()


def test_no_page_opens_a_way_from_other_machines(server):
    """Viser would open a tunnel to a server of others when a page asks for it."""
    from viser import _messages

    with opened_page(server.address) as page:
        page.send(_messages.ShareUrlRequest())
        page.receive(0.3)
    assert server.viser._share_tunnel is None
