"""The server of the page answers only those that know its address, from its own origin, on this machine."""

import http.client
import socket
from contextlib import closing, suppress

import msgspec
import pytest
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.frames import Frame, Opcode
from websockets.sync.client import connect

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
        "/{twice}/",
        "/{token};x/",
        "/x/../{token}/",
        "/foxglove/{token}/",
    ],
)
def test_without_the_token_there_is_nothing(server, path):
    own = token(server)
    names = {"encoded": f"%{ord(own[0]):02x}{own[1:]}", "twice": f"%25{ord(own[0]):02x}{own[1:]}"}
    assert status(server, path.format(token=own, upper=own.swapcase(), short=own[:-1], **names))[0] == 403


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
        "%252e%252e/%252e%252e/etc/passwd",
        "assets/..;/..;/etc/passwd",
        "%c0%ae%c0%ae/%c0%ae%c0%ae/etc/passwd",
        "proc/self/environ",
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
    "localhost:{port}.evil.example",
    "localhost.evil.example:{port}",
    "127.0.0.2:{port}",
    "0.0.0.0:{port}",
    "[::1]:{port}",
    "localhost:{port}, evil.example",
    "localhost.:{port}",
    "user@localhost:{port}",
    "[::ffff:127.0.0.1]:{port}",
    "localhost:0{port}",
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
    "http://localhost:{port} http://evil.example",
    "http://localhost:{port}, http://localhost:{port}",
    "http://user@localhost:{port}",
    "http://localhost:{port}/",
    "",
)


@pytest.mark.parametrize(
    ("header", "value"), [*(("Host", each) for each in HOSTS), *(("Origin", each) for each in ORIGINS)]
)
def test_another_host_or_origin_gets_nothing(server, header, value):
    wrong = {header: value.format(port=server.viser.get_port())}
    assert status(server, f"/{token(server)}/", **wrong)[0] == 403
    assert status(server, f"/{token(server)}/", **{"Origin": "http://evil.example", **wrong})[0] == 403


def test_a_tunnel_may_begin_at_another_port(server):
    """As by `ssh -L 9090:localhost:8080`: the browser names the port that it knows, as host and as origin."""
    own = {"Host": "localhost:9090", "Origin": "http://localhost:9090"}
    assert status(server, f"/{token(server)}/", **own)[0] == 200
    assert status(server, f"/{token(server)}/", **{**own, "Origin": "http://localhost:9091"})[0] == 403
    assert status(server, "/", **own)[0] == 403


def answer(server, request):
    """Send the bytes of a request, and return what comes first; nothing if the connection is closed."""
    port = server.viser.get_port()
    with socket.create_connection(("127.0.0.1", port), timeout=5.0) as connection, suppress(ConnectionError):
        connection.sendall(request.format(port=port, token=token(server)).encode("latin1"))
        return connection.recv(65536)
    return b""


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
    assert answer(server, f"GET /{{token}}/ HTTP/1.1\r\n{headers}\r\n").startswith(b"HTTP/1.1 403 ")


HOST = "Host: localhost:{port}\r\n"
OWN = "GET /{token}/ HTTP/1.1\r\n" + HOST
UPGRADE = f"{OWN}Origin: http://localhost:{{port}}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
KEY = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
ODD_REQUESTS = {
    "token in headers": f"GET / HTTP/1.1\r\n{HOST}Authorization: Bearer {{token}}\r\nCookie: token={{token}}\r\n",
    "token in the referer": f"GET / HTTP/1.1\r\n{HOST}Referer: http://localhost:{{port}}/{{token}}/\r\n",
    "token in a fragment": f"GET /#/{{token}}/ HTTP/1.1\r\n{HOST}",
    "token and NUL": f"GET /{{token}}\0/ HTTP/1.1\r\n{HOST}",
    "no text instead of the token": f"GET /\xff\xfe/ HTTP/1.1\r\n{HOST}",
    "no text in the path": f"GET /{{token}}/\xff\xfe HTTP/1.1\r\n{HOST}",
    "NUL in the path": f"GET /{{token}}/\0 HTTP/1.1\r\n{HOST}",
    "path and its host": f"GET http://localhost:{{port}}/{{token}}/ HTTP/1.1\r\n{HOST}",
    "HTTP/1.0 without a host": "GET /{token}/ HTTP/1.0\r\n",
    "HTTP/2": "PRI * HTTP/2.0\r\n\r\nSM\r\n",
    "TLS": "\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + 300 * "\0",
    "POST": f"POST /{{token}}/ HTTP/1.1\r\n{HOST}",
    "host in two lines": "GET /{token}/ HTTP/1.1\r\nHost: evil.example\r\n localhost:{port}\r\n",
    "no text in the host": "GET /{token}/ HTTP/1.1\r\nHost: \xff\r\n",
    "two lengths": f"{OWN}Content-Length: 0\r\nContent-Length: 40\r\n\r\nGET /{{token}}/ HTTP/1.1\r\n{HOST}",
    "chunks": f"{OWN}Transfer-Encoding: chunked\r\n\r\n0\r\n\r\nGET /{{token}}/ HTTP/1.1\r\n{HOST}",
    "two encodings": f"{OWN}Accept-Encoding: gzip\r\nAccept-Encoding: br\r\n",
    "two upgrades": f"{UPGRADE}Upgrade: h2c\r\n",
    "long ranges": f"{OWN}Range: bytes={5000 * '0-,'}\r\n",
    "no key": UPGRADE,
    "two keys": UPGRADE + KEY + KEY,
    "another version": f"{UPGRADE}{KEY}Sec-WebSocket-Version: 12\r\n",
    "no protocol's name": f"{UPGRADE}{KEY}Sec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: @@,,;\r\n",
}


@pytest.mark.parametrize("kind", ODD_REQUESTS)
def test_an_odd_request_is_refused_or_closed(server, caplog, capfd, kind):
    """No error of the server's own, and at most one line; a good request behind it is not carried out."""
    got = answer(server, f"{ODD_REQUESTS[kind]}\r\n")
    assert not got or got.startswith(b"HTTP/1.1 4") and got.count(b"HTTP/1.1") == 1
    assert status(server, f"/{token(server)}/")[0] == 200
    assert "Traceback" not in caplog.text + "".join(capfd.readouterr()) and len(caplog.records) <= 1


@pytest.mark.parametrize("place", ["foxglove", "foxglove?x", "foxglove?/", "foxglove/?x", "foxglove/../", "/foxglove"])
def test_origins_of_a_route_get_that_alone(server, place):
    """What serves other programs accepts more origins than the page, which is not reached by its path."""
    server.routes["foxglove"] = ServerConnection.wait_closed
    for origin in ("https://app.foxglove.dev", "file://"):
        with pytest.raises((InvalidStatus, TimeoutError)):  # it is not there, or sends nothing
            with connect(f"{server.address.replace('http', 'ws', 1)}{place}", origin=origin, close_timeout=0.1) as page:
                page.recv(timeout=0.3)
    del server.routes["foxglove"]


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


def frame(opcode, data=b"", is_last=True):
    return Frame(opcode, data, is_last).serialize(mask=True)


TEXT, BINARY, CONT, CLOSE, PING = Opcode.TEXT, Opcode.BINARY, Opcode.CONT, Opcode.CLOSE, Opcode.PING
ODD_FRAMES = {
    "not masked": Frame(BINARY, b"a").serialize(mask=False),
    "compressed": b"\xc2\x80" + bytes(4),
    "reserved bit": b"\x92\x80" + bytes(4),
    "reserved kind": b"\x83\x80" + bytes(4),
    "reserved kind of control": b"\x8b\x80" + bytes(4),
    "long ping": b"\x89\xfe\x00\x7e" + bytes(130),
    "ping in parts": b"\x09\x80" + bytes(4),
    "part without a begin": frame(CONT, b"a"),
    "message within another": frame(BINARY, b"a", False) + frame(BINARY, b"a"),
    "largest length": b"\x82\xff" + 8 * b"\xff",
    "length beyond what a message may have": b"\x82\xff" + (2**62).to_bytes(8, "big"),
    "too long in parts": frame(BINARY, 40_000 * b"a", False) + frame(CONT, 40_000 * b"a"),
    "no text": frame(TEXT, b"\xff"),
    "half of a code": frame(CLOSE, b"\x03"),
    "reserved code": frame(CLOSE, b"\x03\xed"),
    "reason that is no text": frame(CLOSE, b"\x03\xe8\xff"),
    "endless parts": frame(BINARY, b"", False) + 5000 * frame(CONT, b"", False),
    "parts and pings": frame(BINARY, b"", False) + 5000 * (frame(CONT, b"", False) + frame(PING)),
}


@pytest.mark.parametrize("kind", ODD_FRAMES)
def test_odd_frames_end_their_connection_alone(server, caplog, capfd, kind):
    with opened_page(server.address) as other, opened_page(server.address) as page:
        page._connection.socket.sendall(ODD_FRAMES[kind])
        with pytest.raises(ConnectionClosed):
            for _ in range(100):
                page._connection.recv(timeout=5.0)
        button = server.viser.gui.add_button(kind)
        other.until(lambda: kind in other.labels, "the page")
        button.remove()
    assert "Traceback" not in caplog.text + "".join(capfd.readouterr()) and len(caplog.records) <= 2


def test_junk_instead_of_a_request_is_one_line(server, caplog, capfd):
    for junk in (b"\x00\xff\r\n\r\n", b"GET\r\n\r\n", b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 300 + b"\r\n"):
        for _ in range(5):
            with socket.create_connection(("127.0.0.1", server.viser.get_port()), timeout=5.0) as connection:
                connection.sendall(junk)
                connection.shutdown(socket.SHUT_WR)
                connection.recv(65536)
    assert "Traceback" not in caplog.text + "".join(capfd.readouterr())
    assert len(caplog.records) <= 3
