"""The server of the page answers only those that know its address, from its own origin, on this machine."""

import http.client
import socket
from contextlib import closing

import msgspec
import pytest
from websockets.exceptions import InvalidStatus

viser = pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")

from support.page import opened_page  # noqa: E402

from solfer_tools.view import PageServer  # noqa: E402


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


def token(server):
    return server.address.split("/")[3]


@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/index.html",
        "/wrong/",
        "/?{token}",
        "/?token={token}",
        "/index.html?/{token}/",
        "//{token}/",
        "/./{token}/",
        "/%2f{token}/",
        "/{encoded}/",
        "/{upper}/",
        "/{short}/",
        "/{token}x/",
        "/{token}%00/",
        "http://localhost/{token}/",
    ],
)
def test_without_the_token_there_is_nothing(server, path):
    own = token(server)
    encoded = f"%{ord(own[0]):02x}{own[1:]}"
    assert status(server, path.format(token=own, encoded=encoded, upper=own.swapcase(), short=own[:-1]))[0] == 403


@pytest.mark.parametrize(
    "path",
    [
        "../../../../etc/passwd",
        "..%2f..%2f..%2fetc/passwd",
        "%2e%2e/%2e%2e/etc/passwd",
        "..\\..\\etc\\passwd",
        "..%5c..%5cetc%5cpasswd",
        "/etc/passwd",
        "//etc/passwd",
        "%2fetc%2fpasswd",
        "./../index.html",
        "assets/../../viser/__init__.py",
        "index.html%00",
        "%00",
        "%ff%fe",
        "%",
        "file:///etc/passwd",
        "C:/",
        300 * "a",
        3000 * "a",
        1500 * "a/",
        2000 * "../",
    ],
    ids=lambda path: path[:40],
)
def test_no_path_leaves_the_page(server, path):
    """It is not found, also where no file can have such a name."""
    assert status(server, f"/{token(server)}/{path}")[0] == 404


def test_a_request_that_is_too_long_ends_its_connection_alone(server):
    with pytest.raises((http.client.HTTPException, OSError)):
        status(server, f"/{token(server)}/{20000 * 'a'}")
    assert status(server, f"/{token(server)}/")[0] == 200


HOSTS = (
    "evil.example",
    "evil.example:{port}",
    "localhost",
    "localhost:1",
    "localhost:{port}.evil.example",
    "localhost.evil.example:{port}",
    "127.0.0.2:{port}",
    "0.0.0.0:{port}",
    "[::1]:{port}",
    "localhost:{port}, evil.example",
    "",
)
ORIGINS = (
    "null",
    "https://localhost:{port}",
    "http://localhost",
    "http://localhost:1",
    "http://evil.example",
    "http://localhost:{port}.evil.example",
    "file://",
    "https://app.foxglove.dev",
    "",
)


@pytest.mark.parametrize(
    ("header", "value"), [*(("Host", each) for each in HOSTS), *(("Origin", each) for each in ORIGINS)]
)
def test_another_host_or_origin_gets_nothing(server, header, value):
    wrong = {header: value.format(port=server.viser.get_port())}
    assert status(server, f"/{token(server)}/", **wrong)[0] == 403
    assert status(server, f"/{token(server)}/", **{"Origin": "http://evil.example", **wrong})[0] == 403


@pytest.mark.parametrize(
    "headers",
    [
        "Host: localhost:{port}\r\nHost: evil.example\r\n",
        "Host: localhost:{port}\r\nHost: localhost:{port}\r\n",
        "X: y\r\n",
        "Host: localhost:{port}\r\nOrigin: http://localhost:{port}\r\nOrigin: http://evil.example\r\n",
        "Host: localhost:{port}\r\nUpgrade: WebSocket\r\n",  # no origin at all
    ],
)
def test_headers_that_leave_a_doubt_get_nothing(server, headers):
    port = server.viser.get_port()
    with socket.create_connection(("127.0.0.1", port), timeout=5.0) as connection:
        connection.sendall(f"GET /{token(server)}/ HTTP/1.1\r\n{headers.format(port=port)}\r\n".encode())
        assert connection.recv(65536).startswith(b"HTTP/1.1 403 ")


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


JUNK = {
    "text": "hello",
    "empty": b"",
    "opcode": b"\xc1",
    "number": b"\x01",
    "nested": b"\x91" * 20000 + b"\x01",
    "nested maps": b"\x81\xa1a" * 20000 + b"\x01",
    "list": msgspec.msgpack.encode([1, 2]),
    "no type": msgspec.msgpack.encode({"uuid": "a"}),
    "other type": msgspec.msgpack.encode({"type": "RunJavascriptMessage", "source": "1"}),
    "type of a list": msgspec.msgpack.encode({"type": [1]}),
    "wrong field": msgspec.msgpack.encode({"type": "GuiUpdateMessage", "uuid": 3, "updates": {"value": 1}}),
    "no value": msgspec.msgpack.encode({"type": "GuiUpdateMessage", "uuid": "a", "updates": {"nothing": 1}}),
    "camera": msgspec.msgpack.encode({"type": "ViewerCameraMessage", "wxyz": [1.0]}),
}


def test_junk_is_one_line_and_the_page_goes_on(caplog, capfd):
    with closing(PageServer(0)) as server, opened_page(server.address) as page:
        page.receive(0.3)
        for _ in range(20):
            for junk in JUNK.values():
                page._connection.send(junk)
        server.viser.gui.add_button("still there")
        page.until(lambda: "still there" in page.labels, "the page")
    lines = [each.getMessage() for each in caplog.records if each.name.startswith("solfer")]
    assert 1 <= len(lines) <= 3 and all("no message" in each for each in lines)
    assert "Traceback" not in caplog.text + "".join(capfd.readouterr())


def test_junk_instead_of_a_request_is_one_line(server, caplog, capfd):
    for junk in (b"\x00\xff\r\n\r\n", b"GET\r\n\r\n", b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 300 + b"\r\n"):
        for _ in range(5):
            with socket.create_connection(("127.0.0.1", server.viser.get_port()), timeout=5.0) as connection:
                connection.sendall(junk)
                connection.shutdown(socket.SHUT_WR)
                connection.recv(65536)
    assert "Traceback" not in caplog.text + "".join(capfd.readouterr())
    assert len(caplog.records) <= 3
