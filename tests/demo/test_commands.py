import functools
import re
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request

import pytest

from bem.plots import COLOURS, PULL_OFF
from tests.processes import ROOT


def test_no_model_is_a_failure():
    script = ROOT / "tests" / "demo" / "run.sh"
    done = subprocess.run([script, "no/such.onnx"], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("The demonstrator cannot be tested: no/such.onnx is missing; export it with")


def test_a_tool_has_the_same_colour_as_in_all_other_pictures():
    styles = (ROOT / "demo" / "src" / "styles.css").read_text(encoding="utf-8")
    light = dict(re.findall(r"--(\w+): (#\w{6});", styles.partition("@media")[0]))
    tools = ("solver", "M1", "fast", "accurate")
    assert {name: light[name].upper() for name in tools} == {name: COLOURS[name] for name in tools}
    assert light["peak"].upper() == PULL_OFF


def test_serving_needs_no_environment():
    planned = subprocess.run(["make", "--dry-run", "demo"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert "python3 tools/serve.py demo/dist --port 8000" in planned
    assert ".venv" not in planned


def serve(port, folder=ROOT / "demo" / "public"):
    command = [sys.executable, ROOT / "tools" / "serve.py", folder, "--port", str(port)]
    # Tests that run in the background inherit an ignored SIGINT.
    heard = functools.partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heard)


def test_a_port_that_is_taken_is_one_sentence_and_no_address():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        out, err = serve(port).communicate()
    assert out == ""
    assert err == f"cannot serve at port {port} (Address already in use); choose another with DEMO_PORT=...\n"
    assert serve(70_000).communicate()[1].startswith("cannot serve at port 70000 (ports go up to 65535)")


def test_the_address_is_said_once_it_answers():
    process = serve(0)
    address = process.stdout.readline().split()[0]
    with urllib.request.urlopen(f"{address}curves.json") as page:
        assert page.status == 200
    process.send_signal(signal.SIGINT)
    assert process.communicate()[1].count("Traceback") == 0
    assert process.returncode == 0


def test_only_files_inside_the_folder_are_served(tmp_path):
    secret = tmp_path / "secret"
    secret.mkdir()
    (secret / "index.html").write_text("outside", encoding="utf-8")
    served = tmp_path / "served"
    (served / "own").mkdir(parents=True)
    (served / "page.html").write_text("inside", encoding="utf-8")
    (served / "alias.html").symlink_to("page.html")
    (served / "loop").symlink_to("loop")
    for link, target in (
        ("file", secret / "index.html"),
        ("folder", secret),
        ("own/index.html", secret / "index.html"),
    ):
        (served / link).symlink_to(target)
    process = serve(0, served)
    try:
        address = process.stdout.readline().split()[0]
        for name in ("page.html", "alias.html"):
            assert urllib.request.urlopen(f"{address}{name}").read() == b"inside"
        for name in ("file", "folder/", "folder/index.html", "own/", "../secret/index.html", "loop", "%00"):
            with pytest.raises(urllib.error.HTTPError, match="404"):
                urllib.request.urlopen(f"{address}{name}")
    finally:
        process.send_signal(signal.SIGINT)
    assert "Traceback" not in process.communicate()[1]
