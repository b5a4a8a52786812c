# SPDX-License-Identifier: BSD-3-Clause
"""`carom view`: its answers to requests. The page itself in a browser: test_view_page.py."""

import contextlib
import http.client
import json
import os
import re
import resource
import select
import shutil
import signal
import socket
import struct
import subprocess
import time

import h5py
import numpy as np
import pytest

from runs import (CAROM, ROUGH, SPHERES, SPRINGS, data_sets, mpi_environment, needs_carom, needs_compiler, run, same, signalled,
                  wait_until_stopped, write_deck)

pytestmark = needs_carom


@contextlib.contextmanager
def page(*arguments, **options):
    """Starts `carom` with these arguments; returns (process, port, path)."""
    process = subprocess.Popen([CAROM, *map(str, arguments)], stdout=subprocess.PIPE, text=True, **options)
    try:
        address = next(line for line in process.stdout if "http" in line)
        port, path = re.search(r"http://127\.0\.0\.1:(\d+)(/[0-9a-f]{32}/)", address).groups()
        yield process, int(port), path
    finally:
        process.terminate()
        process.wait(600)


def get(port, path, method="GET"):
    answer = asked(port, path, method)
    return answer.status, answer.read()


def asked(port, path, method="GET", **headers):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=600)
    connection.request(method, path, headers=headers)  # unchanged: urllib would normalise the path
    return connection.getresponse()


def open_sockets(process):
    """The numbers of the descriptors that are sockets."""
    folder = f"/proc/{process.pid}/fd"
    found = set()
    for number in os.listdir(folder):
        with contextlib.suppress(FileNotFoundError):  # closed meanwhile
            if os.readlink(f"{folder}/{number}").startswith("socket:"):
                found.add(int(number))
    return found


def wait_until(condition):
    """Fails only if something hangs: the time is many times what a busy machine takes."""
    deadline = time.monotonic() + 300
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("finished")
    run(write_deck(folder, SPHERES), folder / "run",
        ["output.events=true", "output.rdf_interval=0.5"])
    return folder / "run"


@pytest.fixture(scope="module")
def shown(finished):
    with page("view", finished) as (_, port, path):
        yield port, path


def test_the_page_is_given_to_its_token_only(shown):
    port, path = shown
    status, body = get(port, path)
    assert status == 200 and b"<title>Carom</title>" in body
    wrong = path[:-2] + ("0" if path[-2] != "0" else "1") + "/"
    for other in ("/", "/runs", wrong, wrong + "runs", path[:-1], "//" + path, "/../" + path):
        status, body = get(port, other)
        assert status == 403 and b"carom" in body and len(body) < 100, other


@pytest.mark.parametrize("path", ["../../etc/passwd", "0/../deck.toml", "0/deck.toml", "%2e%2e/run.log", "0/frame/../../x", "1/state", "0",
                                  "-1/state", "0/frame/-1", "0/frame/99", "0/frame/1x", "0/thermo/", "0/frame/99999999999999999999"])
def test_no_other_file_is_given_away(shown, path):
    assert get(shown[0], shown[1] + path)[0] == 404


def test_nothing_can_be_changed(shown):
    port, path = shown
    for method in ("POST", "PUT", "DELETE", "OPTIONS"):
        assert get(port, path + "runs", method)[0] == 405


def test_head_gets_the_headers_of_get_and_no_body(shown):
    (port, path), end = shown, "\r\n\r\n"
    for target in (path, path + "runs", path + "nothing", "/"):
        expected = asked(port, target)
        request, n = f"HEAD {target} HTTP/1.1\r\nHost: localhost", 1 if target == "/" else 3  # an error ends the connection
        with socket.create_connection(("127.0.0.1", port), 60) as client:
            client.sendall(f"{(n - 1) * (request + end)}{request}\r\nConnection: close{end}".encode())
            received = b"".join(iter(lambda: client.recv(1 << 16), b""))
        heads = received.decode().split(end)
        assert heads[-1] == "" and len(heads) == n + 1, received[:1000]
        assert heads[0].startswith(f"HTTP/1.1 {expected.status} ") and f"Content-Length: {len(expected.read())}" in heads[0]


HOSTS = {200: ["localhost", "LocalHost:80", "127.0.0.1", "127.0.0.1:9", "[::1]", "[::1]:8000"],
         421: ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "localhost.", "localhost:80.evil.example", "local", "", "[::1", "::1",
               "127.0.0.11", "a@localhost"]}


def test_only_names_of_this_machine_are_answered(shown):
    """The owner of another name can redirect it here, and a page under that name could then read this one."""
    port, path = shown
    for status, names in HOSTS.items():
        for name in names:
            answer = asked(port, path + "runs", Host=name)
            assert answer.status == status and (status == 200) == (b"no name of this machine" not in answer.read()), name
    for hosts in ("", "Host: localhost\r\nHost: evil.example\r\n"):
        with socket.create_connection(("127.0.0.1", port), 60) as client:
            client.sendall(f"GET {path} HTTP/1.1\r\n{hosts}\r\n".encode())
            assert client.recv(100).startswith(b"HTTP/1.1 421 ")


def test_no_answer_is_kept_in_a_cache_or_leads_elsewhere(shown):
    port, path = shown
    answers = [asked(port, path + name) for name in ("", "runs", "0/frame/1", "0/thermo/0", "nothing")]
    answers += [asked(port, "/"), asked(port, path, "POST"), asked(port, path, "HEAD"), asked(port, path, Host="evil.example")]
    assert [answer.status for answer in answers] == [200] * 4 + [404, 403, 405, 200, 421]
    for answer in answers:
        assert answer.headers["Cache-Control"] == "no-store"
        assert answer.headers["Referrer-Policy"] == "no-referrer"
        assert answer.headers["X-Content-Type-Options"] == "nosniff"


def test_connections_without_the_token_do_not_displace_the_page(finished):
    with page("view", finished) as (process, port, path), contextlib.ExitStack() as clients:
        before = len(open_sockets(process))
        mine = http.client.HTTPConnection("127.0.0.1", port, timeout=600)
        mine.request("GET", path + "runs")
        assert mine.getresponse().read()
        kept = mine.sock
        for _ in range(200):
            clients.enter_context(socket.create_connection(("127.0.0.1", port), 60))
        assert get(port, path + "runs")[0] == 200
        assert len(open_sockets(process)) < before + 30
        mine.request("GET", path + "runs")
        assert mine.getresponse().status == 200 and mine.sock is kept


@pytest.fixture(scope="module")
def large(finished, tmp_path_factory):
    """A run with an answer that is larger than any socket buffer."""
    folder = tmp_path_factory.mktemp("large") / "run"
    shutil.copytree(finished, folder)
    (folder / "rdf.csv").write_bytes(b"1.0,2.0\n" * (1 << 21))
    return folder


def unread(port, path):
    """A client that has asked for the large answer and reads its headers only."""
    client = socket.socket()
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 14)
    client.settimeout(600)
    client.connect(("127.0.0.1", port))
    client.sendall(f"GET {path}0/rdf HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
    answer = http.client.HTTPResponse(client)
    answer.begin()
    assert answer.status == 200
    return answer


def test_answers_that_nobody_reads_do_not_add_up(large):
    with page("view", large) as (process, port, path):
        before, answers = len(open_sockets(process)), []
        reading = http.client.HTTPConnection("127.0.0.1", port, timeout=600)
        for _ in range(60):
            reading.request("GET", path + "runs")
            assert reading.getresponse().read()
            answers.append(unread(port, path))
        assert len(open_sockets(process)) < before + 30
        assert answers[-1].read() == (large / "rdf.csv").read_bytes(), "the latest one is kept"
        with pytest.raises((http.client.IncompleteRead, ConnectionError)):
            answers[0].read()


def test_a_connection_on_which_nothing_moves_is_closed(large):
    with page("view", large) as (process, port, path):
        before = len(open_sockets(process))
        silent, half = (socket.create_connection(("127.0.0.1", port), 60) for _ in range(2))
        half.sendall(f"GET {path} HTTP/1.1\r\nHost: loc".encode())
        unmoved, slow = unread(port, path), unread(port, path)
        parts = []
        wait_until(lambda: parts.append(slow.read(1 << 15)) or select.select([silent], [], [], 0.05)[0])
        assert silent.recv(1) == b"" and half.recv(1) == b""
        assert b"".join(parts) + slow.read() == (large / "rdf.csv").read_bytes(), "a slow reader gets all of it"
        slow.close()
        wait_until(lambda: len(open_sockets(process)) == before)
        with pytest.raises((http.client.IncompleteRead, ConnectionError)):
            unmoved.read()
        assert get(port, path)[0] == 200


def test_without_a_free_descriptor_the_server_waits(finished):
    """The server sleeps between its attempts, and accepts the connection as soon as it can."""
    def sleeps():
        with open(f"/proc/{process.pid}/status") as status:
            return next(int(line.split()[1]) for line in status if line.startswith("voluntary_ctxt_switches"))

    with page("view", finished) as (process, port, path):
        before = len(open_sockets(process))
        assert get(port, path)[0] == 200  # it is running, and has opened all its descriptors
        wait_until(lambda: len(open_sockets(process)) == before)
        limits = resource.prlimit(process.pid, resource.RLIMIT_NOFILE)
        numbers = set(map(int, os.listdir(f"/proc/{process.pid}/fd")))
        free = min(set(range(len(numbers) + 1)) - numbers)
        resource.prlimit(process.pid, resource.RLIMIT_NOFILE, (free, limits[1]))
        with socket.create_connection(("127.0.0.1", port), 60) as client:
            client.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            slept = sleeps()
            wait_until(lambda: sleeps() > slept + 3)
            resource.prlimit(process.pid, resource.RLIMIT_NOFILE, limits)
            assert client.recv(100).startswith(b"HTTP/1.1 200 ")


def test_only_this_machine_is_listened_to(shown):
    sockets = subprocess.run(["ss", "-Hltn", f"sport = :{shown[0]}"], capture_output=True, text=True, check=True).stdout.split("\n")
    assert [line.split()[3] for line in sockets if line] == [f"127.0.0.1:{shown[0]}"]


def test_frames_are_those_of_the_trajectory(shown, finished):
    port, path = shown
    state = json.loads(get(port, path + "runs")[1])[0]
    file = h5py.File(finished / "trajectory.h5md")
    group, events = file["particles/trajectory"], h5py.File(finished / "events.h5")["events"]
    assert (state["frames"], state["particles"], state["status"], state["dimension"]) == (7, 108, "done", 3)
    fixed = np.frombuffer(get(port, path + "0/particles")[1], "<f4").reshape(4, 108)
    for values, name in zip(fixed, ("radius", "species", "mass", "charge")):
        assert np.array_equal(values, group[name][:].astype("f4")), name
    for particle, first in ((0, 0), (107, 2), (5, 6)):
        assert np.array_equal(np.frombuffer(get(port, f"{path}0/path/{particle}/{first}")[1], "<f4").reshape(-1, 3),
                              group["position/value"][first:, particle].astype("f4"))
    for nowhere in ("108/0", "0/7", "0", "/0", "0/-1", "0/0/0"):
        assert get(port, f"{path}0/path/{nowhere}")[0] == 404
    for frame in (3, 6, 1):  # forwards and backwards: counts of collisions too
        body = get(port, path + f"0/frame/{frame}")[1]
        time_, _, collisions, *edges, counted, spins, tilt = struct.unpack("<9d", body[:72])
        assert (time_, collisions) == (group["position/time"][frame], file["observables/collisions/value"][frame])
        assert np.array_equal(edges, np.diag(group["box/edges/value"][frame])) and (counted, spins, tilt) == (1, 0, 0)
        values = np.frombuffer(body[72:], "<f4")
        assert np.array_equal(values[:324].reshape(-1, 3), group["position/value"][frame].astype("f4"))
        assert np.allclose(values[324:432], np.linalg.norm(group["velocity/value"][frame], axis=1), rtol=1e-6)
        so_far = events["time"][:] <= time_
        pairs = np.concatenate([events["lo"][so_far], events["hi"][so_far]])
        assert np.array_equal(values[432:], np.bincount(pairs, minlength=108))
    thermo = (finished / "thermo.csv").read_bytes()
    assert get(port, path + "0/thermo/0")[1] == thermo and get(port, path + "0/thermo/100")[1] == thermo[100:]
    assert get(port, path + "0/rdf")[1] == (finished / "rdf.csv").read_bytes()


def test_spins_and_the_tilt_are_those_of_the_trajectory(tmp_path):
    run(write_deck(tmp_path, ROUGH), tmp_path / "run", ["output.events=true", "system.shear={rate=0.5}"])
    group = h5py.File(tmp_path / "run" / "trajectory.h5md")["particles/trajectory"]
    with page("view", tmp_path / "run", "--no-browser") as (_, port, path):
        body = get(port, path + "0/frame/3")[1]
    assert struct.unpack("<9d", body[:72])[6:] == (1, 1, group["box/edges/value"][3, 1, 0]) and group["box/edges/value"][3, 1, 0] > 0
    values = np.frombuffer(body[72:], "<f4").reshape(6, 108)
    assert np.allclose(values[4], np.linalg.norm(group["angular_velocity/value"][3], axis=1), rtol=1e-6) and values[4].min() > 0
    assert values[5].max() > 1 and (values[5] == values[5].round()).all()


def test_bonds_are_those_of_the_trajectory(tmp_path):
    run(write_deck(tmp_path, SPRINGS), tmp_path / "run")
    with page("view", tmp_path / "run", "--no-browser") as (_, port, path):
        pairs = np.frombuffer(get(port, path + "0/bonds")[1], "<u4").reshape(-1, 2)
        group = h5py.File(tmp_path / "run" / "trajectory.h5md")["parameters/vmd_structure"]
        assert len(pairs) and np.array_equal(pairs + 1, np.column_stack([group["bond_from"], group["bond_to"]]))
        assert json.loads(get(port, path + "runs")[1])[0]["bonds"] == len(pairs)


@needs_compiler
def test_a_run_that_is_shown_while_it_goes_on_is_the_same_run(killer, tmp_path):
    """Frames are complete at any time of a request, and the run's results keep their bits. The run stops itself once, so that some are asked for."""
    overrides = ["run.end_time=120", "output.frame_interval=0.2", "output.thermo_interval=0.2", "particles.0.count=500"]
    deck = write_deck(tmp_path, SPHERES)
    run(deck, tmp_path / "alone", overrides)
    sets = [part for override in overrides for part in ("--set", override)]
    seen, stop = {}, signalled(killer, tmp_path / "shown", signal.SIGSTOP, 100)
    with page("run", deck, "-o", tmp_path / "shown", "--view", "--quiet", *sets, env=stop) as (process, port, path):
        wait_until_stopped(process)
        last = json.loads(get(port, path + "runs")[1])[0]["frames"] - 1
        seen = {frame: get(port, path + f"0/frame/{frame}")[1] for frame in (0, last // 2, last)}
        process.send_signal(signal.SIGCONT)
        while process.poll() is None:
            with contextlib.suppress(OSError, http.client.HTTPException):
                state = json.loads(get(port, path + "runs")[1])[0]
                if status := get(port, path + f"0/frame/{state['frames'] - 1}"):
                    assert status[0] == 200, status[1]
                    seen[state["frames"] - 1] = status[1]
        assert process.returncode == 0
    alone, shown = (data_sets(tmp_path / name / "trajectory.h5md") for name in ("alone", "shown"))
    del alone["parameters/deck"], shown["parameters/deck"]  # it names the directory
    assert same(alone, shown)
    with h5py.File(tmp_path / "alone" / "trajectory.h5md") as file:
        for frame, body in seen.items():
            there = file["particles/trajectory/position/value"][frame].astype("<f4").tobytes()
            assert body[72:72 + len(there)] == there
    assert len(seen) > 2
    wait_until(lambda: not open_at(port))  # where there is no terminal


def open_at(port):
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def test_the_page_ends_with_a_run_that_is_killed(tmp_path):
    with page("run", write_deck(tmp_path, SPHERES), "-o", tmp_path / "run", "--view", "--quiet", "--set", "run.end_time=1e5") as (
            process, port, _):
        assert open_at(port)
        process.kill()
        wait_until(lambda: not open_at(port))


def test_a_stopped_viewer_does_not_keep_the_run_from_ending(tmp_path):
    with page("run", write_deck(tmp_path, SPHERES), "-o", tmp_path / "run", "--view", "--quiet", "--set", "run.end_time=1e5") as (
            process, port, _):
        viewer, = subprocess.run(["pgrep", "-P", str(process.pid)], capture_output=True, text=True).stdout.split()
        os.kill(int(viewer), signal.SIGSTOP)
        try:
            process.send_signal(signal.SIGUSR2)
            assert process.wait(600) == 75
            assert not open_at(port)
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(viewer), signal.SIGKILL)


def test_one_rank_of_several_serves_the_page(tmp_path):
    overrides = ["--set", "run.end_time=1e5", "--set", "particles.0.count=2048"]
    process = subprocess.Popen(["mpirun", "-n", "2", CAROM, "run", write_deck(tmp_path, SPHERES), "-o", tmp_path / "run", "--view",
                                "--quiet", *overrides], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=mpi_environment())
    port, path = re.search(r"127\.0\.0\.1:(\d+)(/\w+/)", process.stdout.readline()).groups()
    wait_until(lambda: json.loads(get(int(port), path + "runs")[1])[0]["frames"] >= 2)
    process.send_signal(signal.SIGUSR2)
    out, errors = process.communicate(timeout=600)
    assert process.returncode == 75 and "http" not in out, errors
    assert not open_at(int(port))


def refused(code, *arguments):
    done = subprocess.run([CAROM, *map(str, arguments)], capture_output=True, text=True, timeout=600)
    assert done.returncode == code, done.stderr
    return done.stderr


def test_what_cannot_be_shown(finished, tmp_path):
    assert "has no trajectory.h5md; name the directory" in refused(5, "view", tmp_path)
    assert "has no trajectory.h5md" in refused(5, "view", tmp_path / "nowhere")
    for damage in (b"no HDF5", (finished / "trajectory.h5md").read_bytes()[:3000]):
        (tmp_path / "trajectory.h5md").write_bytes(damage)
        assert f"{tmp_path}/trajectory.h5md: " in refused(5, "view", tmp_path)
    with h5py.File(tmp_path / "trajectory.h5md", "w") as file:
        file["x"] = 1
    assert "no trajectory of carom" in refused(5, "view", tmp_path)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert f"--port {port}: cannot listen there" in refused(2, "view", finished, "--port", port)
        deck = write_deck(tmp_path, SPRINGS)
        assert "cannot listen there" in refused(2, "run", deck, "-o", tmp_path / "run", "--view", "--port", port)
    assert not (tmp_path / "run").exists()
    assert "run is required" in refused(2, "view")
    assert "--view" in refused(2, "run", deck, "--port", "8000")


def test_a_flush_that_a_kill_has_cut_short_is_completed(finished, tmp_path):
    """The journal of this flush, written by the test, has the block of the last step."""
    import zlib
    folder = tmp_path / "killed"
    folder.mkdir()
    data = bytearray((finished / "trajectory.h5md").read_bytes())
    block = struct.pack("<QQ", 0, 512) + bytes(data[:512])
    rest = struct.pack("<QQ", 32 + len(block), len(data)) + block
    data[:512] = bytes(512)  # half of it reached the file
    (folder / "trajectory.h5md").write_bytes(data)
    (folder / "trajectory.h5md.journal").write_bytes(b"CAROMJ01" + struct.pack("<Q", zlib.crc32(rest)) + rest)
    with page("view", folder) as (_, port, path):
        assert json.loads(get(port, path + "runs")[1])[0]["frames"] == 7


def test_an_export_takes_the_frames_that_fit(finished, tmp_path):
    target = tmp_path / "page.html"
    export = [CAROM, "view", str(finished), str(finished), "--export", str(target)]
    assert "7 of 7 frames" in subprocess.run(export, capture_output=True, text=True, check=True).stdout
    text = target.read_text()
    stored = json.loads(re.search(r'id="stored" type="application/json">(.*?)</script>', text, re.S)[1])
    assert len(json.loads(stored["runs"])) == 2 and "0/frame/6" in stored and "1/rdf" in stored
    assert "http:" not in text and "https:" not in text
    done = subprocess.run(export[:3] + export[4:] + ["--max-size", "1"], capture_output=True, text=True, check=True)
    assert "7 of 7" in done.stdout


def test_an_export_of_too_much(tmp_path):
    run(write_deck(tmp_path, SPHERES), tmp_path / "run", ["particles.0.count=16384", "run.end_time=0.04", "output.frame_interval=0.01"])
    target = tmp_path / "page.html"
    done = subprocess.run([CAROM, "view", str(tmp_path / "run"), "--export", str(target), "--max-size", "2"],
                          capture_output=True, text=True, check=True)
    assert "4 of 5 frames, what --max-size takes" in done.stdout and target.stat().st_size < 2e6
    assert "not one frame of 16384 particles fits into a page of 1 MB" in refused(
        2, "view", tmp_path / "run", tmp_path / "run", "--export", tmp_path / "no.html", "--max-size", "1")
    assert not (tmp_path / "no.html").exists()


def test_the_demo_shows_psa_beside_edda(tmp_path):
    with page("demo", tmp_path, "--no-browser") as (process, port, path):
        wait_until(lambda: all(state["frames"] >= 3 for state in json.loads(get(port, path + "runs")[1])))
        states = json.loads(get(port, path + "runs")[1])
        assert [state["integrator"] for state in states] == ["psa", "edda"]
        first = [get(port, path + f"{k}/frame/0")[1] for k in (0, 1)]
        assert first[0][64:] == first[1][64:]
        error = [float(get(port, path + f"{k}/thermo/0")[1].split(b"\n")[-2].split(b",")[7]) for k in (0, 1)]
        assert error[0] > 1e6 * error[1]
        process.send_signal(signal.SIGINT)
        assert process.wait(600) == 0
    children = subprocess.run(["pgrep", "-f", str(tmp_path / "demo.toml")], capture_output=True, text=True).stdout
    assert not children
    assert json.loads((tmp_path / "edda" / "summary.json").read_text())["status"] == "interrupted"
    assert os.path.exists(tmp_path / "psa" / "trajectory.h5md")
