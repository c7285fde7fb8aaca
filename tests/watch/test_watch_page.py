"""The live page of a watch answers only requests with its token and shows every event.

It also reconnects when the watch comes back.
"""

import contextlib
import errno
import http.client
import json
import re
import socket
import time
from pathlib import Path
from threading import Event, Thread

import pytest
from campaigns import MEDIUM
from chromium import Chromium, find
from waiting import LONGEST_S

import rftfit
from rftfit.bench.page import page_of
from rftfit.bench.server import LivePage

HOST = "127.0.0.1"
PROGRAM = find()


@pytest.fixture(scope="module")
def page():
    """A page that tests only ask."""
    live_page = LivePage()
    yield live_page
    live_page.close()


def ask(page, path, method="GET", **headers):
    """Status and text of an answer."""
    connection = http.client.HTTPConnection(HOST, page.port, timeout=LONGEST_S)
    connection.request(method, path, headers=headers)
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer.status, text, answer.headers


def test_the_page_needs_its_token_and_asks_nobody_else(page):
    status, text, headers = ask(page, f"/{page.token}/")
    assert status == 200
    assert "EventSource" in text
    assert "http" not in text.replace("http-equiv", "")
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "connect-src 'self'" in policy


FOREIGN = [
    {"Host": "example.org"},
    {"Host": "example.org:80"},
    {"Origin": "http://example.org"},
    {"Origin": "null"},
    {"Origin": f"http://{HOST}:1"},
]


@pytest.mark.parametrize(
    ("path", "headers"),
    [(path, {}) for path in ("/", "/{}", "/{}/events", "/favicon.ico", "//", "/../{}/")]
    + [(path, headers) for headers in FOREIGN for path in ("", "events")],
)
def test_without_the_token_or_from_another_host_a_request_gets_nothing(page, path, headers):
    wrong = page.token[:-1] + ("0" if page.token[-1] != "0" else "1")
    path = f"/{page.token}/{path}" if headers else path.format(wrong)
    assert ask(page, path, **headers)[:2] == (403, "")


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS"])
def test_nothing_but_reading_is_possible(page, method):
    status, _, headers = ask(page, f"/{page.token}/", method)
    assert status == 501
    assert "Access-Control-Allow-Origin" not in headers


def test_only_this_machine_is_listened_to_and_each_start_has_a_token_of_its_own(page):
    """An open tab must not hand the token of the next watch to whoever has taken its port."""
    assert page.server_address[0] == HOST
    tokens = {page.token}
    for _ in range(2):
        next_page = LivePage()
        next_page.close()
        tokens.add(next_page.token)
    assert len(tokens) == 3


def test_silent_connections_take_neither_the_page_nor_the_logs(bench, monkeypatch):
    """250 of another user: most are closed at once, the rest after a while, and a push is judged meanwhile."""
    monkeypatch.setattr("rftfit.bench.server._Handler.timeout", 1.0)
    page = LivePage()
    silent = []
    for _ in range(250):
        with contextlib.suppress(OSError):
            silent.append(socket.create_connection((HOST, page.port), timeout=5))
    name = bench.plates[0]
    bench.push(name)
    watch = bench.watch()
    bench.settle(watch)
    assert watch.state(MEDIUM, name) == "measured"
    time.sleep(1.5)
    assert ask(page, f"/{page.token}/")[0] == 200
    page.close()
    for connection in silent:
        connection.close()


def dribble(sockets, stop):
    """Send a byte on each connection again and again; a connection that was ended is opened anew."""
    while not stop.wait(0.05):
        for index, (connection, port) in enumerate(sockets):
            try:
                connection.send(b"G")
            except OSError:
                connection.close()
                sockets[index] = socket.create_connection((HOST, port), timeout=5), port


def test_slow_connections_without_the_token_never_keep_the_owner_out(capfd):
    """More than there are places; each begins a request that it never ends, and comes back when it is ended."""
    page, stop = LivePage(), Event()
    sockets = [
        (socket.create_connection((HOST, page.port), timeout=5), page.port) for _ in range(32 + 8)
    ]
    thread = Thread(target=dribble, args=(sockets, stop))
    thread.start()
    try:
        for _ in range(20):
            began_s = time.monotonic()
            assert ask(page, f"/{page.token}/")[0] == 200
            assert time.monotonic() - began_s < 2.0
    finally:
        stop.set()
        thread.join()
        page.close()
        for connection, _ in sockets:
            connection.close()
    assert capfd.readouterr().err == ""


def test_a_connection_with_the_token_stays_when_others_come():
    page = LivePage()
    owner = http.client.HTTPConnection(HOST, page.port, timeout=LONGEST_S)
    strangers = []
    for _ in range(3):
        owner.request("GET", f"/{page.token}/")
        assert owner.getresponse().read()
        strangers += [
            socket.create_connection((HOST, page.port), timeout=LONGEST_S) for _ in range(32)
        ]
    # the oldest of them have been ended: nothing more comes from there
    assert strangers[0].recv(1) == b""
    owner.close()
    page.close()
    for connection in strangers:
        connection.close()


def test_a_head_that_never_ends_is_ended(monkeypatch):
    """However often a byte of it comes."""
    monkeypatch.setattr("rftfit.bench.server._Handler.timeout", 0.3)
    page = LivePage()
    with socket.create_connection((HOST, page.port), timeout=LONGEST_S) as slow:
        began_s = time.monotonic()
        with pytest.raises((BrokenPipeError, ConnectionResetError)):  # noqa: PT012 (which of the bytes comes too late is not known)
            while time.monotonic() - began_s < LONGEST_S:
                slow.sendall(b"G")
                time.sleep(0.02)
        assert time.monotonic() - began_s < LONGEST_S
    page.close()


def test_a_full_table_of_files_is_no_verdict_on_a_log(bench, monkeypatch):
    name = bench.plates[0]
    bench.push(name)
    opened = Path.open

    def full(path, *words, **options):
        if path.name.startswith(name):
            raise OSError(errno.EMFILE, "Too many open files")
        return opened(path, *words, **options)

    watch = bench.watch()
    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", full)
        bench.settle(watch)
        assert name not in watch.media[MEDIUM].runs
    bench.settle(watch)
    assert watch.state(MEDIUM, name) == "measured"


def test_a_port_that_is_taken_is_told(page):
    with pytest.raises(rftfit.RftfitError, match=f"--port: found {page.port}: "):
        LivePage(page.port)


def test_the_repeats_of_a_push_are_the_runs_of_its_cell(bench):
    shown, repeat = bench.plates[:2]
    bench.push(shown, repeat)
    watch = bench.watch()
    bench.settle(watch)
    assert "Repeats" not in page_of(watch, f"run={shown}")
    medium = watch.media[MEDIUM]
    medium.alpha = medium.alpha.assign(run_ids=f"{shown} {repeat} gone")
    assert f"Repeats, dashed: {repeat}." in page_of(watch, f"run={shown}")


def test_what_is_told_is_on_the_page(bench):
    good, bad = bench.plates[:2]
    bench.push(good, bad)
    bench.put(bench.logs(bad)[0], b"")
    bench.rows[bench.plates[2]] = dict(bench.every[bench.plates[2]]) | {"kind": "<b>rood</b>"}
    watch = bench.watch()
    assert "No run of the run sheet" in page_of(watch, "")
    bench.settle(watch)
    assert page_of(watch, f"run={good}").count("<svg") == 5
    text = page_of(watch, "")
    assert f"Last push: {bad}" in text
    assert re.search(rf'<nav aria-label="Media"><a [^>]*href="\?medium={MEDIUM}"', text)
    assert "&lt;b&gt;rood" in text
    assert "<b>rood" not in text
    assert re.search(rf"{bad}.{{0,400}}empty", text, re.DOTALL)
    assert "nan" not in re.sub("<[^>]+>", "", text).lower()
    (row,) = [row for row in watch.next_rows(watch.media[MEDIUM]) if row["kind"] == "plate"][:1]
    assert ",".join(row.values()) in text


@pytest.mark.skipif(PROGRAM is None, reason="no Chromium on this machine")
def test_a_browser_shows_it_follows_it_and_comes_back(bench, tmp_path):
    first_name, second_name = bench.plates[:2]
    bench.push(first_name)
    watch = bench.watch()
    bench.settle(watch)
    page = LivePage()

    def until(browser, words):
        for _ in range(LONGEST_S * 20):
            page.show(lambda query: page_of(watch, query), changed=False)
            if words in browser.evaluate("document.body?.innerText ?? ''"):
                return
            time.sleep(0.05)
        raise AssertionError(browser.evaluate("document.body?.innerText ?? ''"))

    with Chromium(PROGRAM, tmp_path / "profile") as browser:
        browser.open(page.address)
        until(browser, f"push: {first_name}")
        bench.push(second_name)
        bench.settle(watch)
        page.show(lambda query: page_of(watch, query), changed=True)
        until(browser, f"Last push: {second_name}")
        browser.click(f"a[href$='run={first_name}']")
        until(browser, f"Push: {first_name}")
        assert browser.evaluate("location.search").endswith(f"run={first_name}")
        for width in (390, 1280):
            for theme in ("light", "dark"):
                browser.call(
                    "Emulation.setDeviceMetricsOverride",
                    width=width,
                    height=900,
                    deviceScaleFactor=1,
                    mobile=width < 600,
                )
                browser.call(
                    "Emulation.setEmulatedMedia",
                    features=[{"name": "prefers-color-scheme", "value": theme}],
                )
                assert browser.evaluate("document.documentElement.scrollWidth") <= width
                ink, paper = json.loads(
                    browser.evaluate(
                        "JSON.stringify([getComputedStyle(document.body).color, getComputedStyle(document.body).backgroundColor])"
                    )
                )
                bright = sum(map(int, re.findall(r"\d+", paper)[:3])) > sum(
                    map(int, re.findall(r"\d+", ink)[:3])
                )
                assert bright == (theme == "light")
        address = page.address
        page.close()
        until(browser, "no answer")
        page = LivePage()
        assert page.address != address
        browser.open(page.address)
        until(browser, "connected")
        asked = {
            e["params"]["request"]["url"]
            for e in browser.events
            if e.get("method") == "Network.requestWillBeSent"
        }
        assert all(url.startswith((address, page.address, "data:")) for url in asked)
        page.close()
