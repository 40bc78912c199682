"""The Studio from Python: its server, its command, its widget."""

import json
import re
import urllib.error
import urllib.request
from collections.abc import Iterator
from email.message import Message
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import isoswarm as iso
from isoswarm import serving
from isoswarm.cli import app


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A page that stands for the built one."""
    (tmp_path / "index.html").write_text("<title>isoswarm Studio</title>")
    (tmp_path / "core.wasm").write_bytes(b"\0asm")
    (tmp_path / "widget.js").write_text("export default { render() {} }")
    monkeypatch.setattr(serving, "FOLDER", tmp_path)
    return tmp_path


@pytest.fixture
def server(page: Path) -> Iterator[serving.StudioServer]:
    with serving.StudioServer('{"format": "isoswarm scene"}', port=0) as running:
        yield running


def get(url: str, **headers: str) -> tuple[int, Message, bytes]:
    request = urllib.request.Request(url, headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=10) as answer:
            return answer.status, answer.headers, answer.read()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.headers, error.read()


def test_serves_the_page_and_the_scene_and_nothing_else(server: serving.StudioServer) -> None:
    base, _, query = server.url.partition("?")
    assert query == "model=scene.iso.json"
    status, headers, body = get(server.url)
    assert status == 200
    assert b"isoswarm Studio" in body
    assert headers["Cross-Origin-Opener-Policy"] == "same-origin"
    assert get(base + "core.wasm")[1]["Content-Type"] == "application/wasm"
    assert json.loads(get(base + "scene.iso.json")[2]) == {"format": "isoswarm scene"}
    assert get(base + "../setup.py")[0] == 404
    assert get(base + "%2e%2e/%2e%2e/etc/passwd")[0] == 404


def test_answers_only_to_this_machine(server: serving.StudioServer) -> None:
    assert server.url.startswith("http://127.0.0.1:")
    assert get(server.url, Host="elsewhere.example")[0] == 403


def test_a_port_in_use_is_said(server: serving.StudioServer) -> None:
    port = int(server.url.split(":")[2].split("/")[0])
    with pytest.raises(OSError, match="try --port 0"):
        serving.StudioServer(port=port)


def test_a_page_that_is_not_built_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serving, "FOLDER", tmp_path)
    result = CliRunner().invoke(app, ["studio", "--no-browser", "--port", "0"])
    assert result.exit_code == 2
    assert "make studio-page" in result.output


def test_the_command_serves_the_model(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = {}

    def wait(server: serving.StudioServer) -> None:
        seen["scene"] = json.loads(get(server.url.partition("?")[0] + "scene.iso.json")[2])

    monkeypatch.setattr(serving.StudioServer, "wait", wait)
    arguments = ["studio", "sphere(r)", "-n", "50", "--set", "r=1.5", "--no-browser", "--port", "0"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert seen["scene"]["settings"]["amount"] == {"count": 50}
    assert "1.5" in json.dumps(seen["scene"]["model"])


def widget(page: Path, scene: iso.Scene) -> Any:
    pytest.importorskip("anywidget")
    return iso.Studio(scene)


def test_a_change_in_python_comes_to_the_page(page: Path) -> None:
    scene = iso.Scene("sphere(r=1)", n=50)
    studio = widget(page, scene)
    assert studio.parameters == {"sphere/r": 1.0}
    scene.parameters["sphere/r"].value = 1.5
    assert studio.parameters == {"sphere/r": 1.5}
    assert (studio.revision, studio.revision_of) == (1, "values")
    top = scene.pin((0, 0, 1.5), name="top")
    assert studio.pins == [{"id": top.id, "name": "top", "at": [0.0, 0.0, 1.5]}]
    assert (studio.revision, studio.revision_of) == (2, "document")
    assert json.loads(studio.document)["pins"][0]["name"] == "top"


def test_a_change_on_the_page_comes_to_python_and_can_be_undone(page: Path) -> None:
    scene = iso.Scene("sphere(r=1)", n=50)
    top = scene.pin((0, 0, 1), name="top")
    studio = widget(page, scene)
    # As the page tells of a drag: the document first.
    other = iso.Scene("sphere(r=1)", n=50)
    other.pin((0, 0, 1), name="top")
    other.drag("top", to=(0, 0, 1.4))
    before = studio.revision
    studio.document = other.to_json()
    assert scene.parameters["sphere/r"].value == other.parameters["sphere/r"].value
    assert top.position.tolist() == other["top"].position.tolist()
    assert studio.revision == before
    scene.undo()
    assert scene.parameters["sphere/r"].value == 1.0
    assert studio.parameters == {"sphere/r": 1.0}


def test_another_tree_on_the_page_comes_to_python(page: Path) -> None:
    scene = iso.Scene("sphere(r=1)", n=50)
    studio = widget(page, scene)
    studio.document = iso.Scene("sphere(r=1) | translate(box(1, 1, 1), x=1)", n=50).to_json()
    assert {path.split("/")[0] for path in scene.parameters.now} == {"sphere", "translate", "box"}


def test_a_trait_that_is_set_moves_the_scene(page: Path) -> None:
    scene = iso.Scene("sphere(r=1)", n=50)
    studio = widget(page, scene)
    studio.parameters = {"sphere/r": 2.0}
    assert scene.parameters["sphere/r"].value == 2.0
    assert json.loads(studio.document)["model"]["nodes"][0]["params"][0]["value"] == 2.0
    studio.close()
    scene.parameters["sphere/r"].value = 1.0
    assert studio.parameters == {"sphere/r": 2.0}


ROOT = Path(__file__).parents[2]


def test_the_built_page_is_served_with_all_that_it_asks_for() -> None:
    with serving.StudioServer(port=0) as running:
        status, _, body = get(running.url)
        assert status == 200
        asked = re.findall(r'(?:src|href)="\./([^"]+)"', body.decode())
        assert any(name.endswith(".js") for name in asked)
        modules = [str(path.relative_to(serving.FOLDER)) for path in serving.FOLDER.rglob("*.wasm")]
        # The one with which a page starts, and the one with meshes and files.
        assert sorted(name.split("/")[-1].split("_bg")[0] for name in modules) == ["core", "full"]
        for name in [*asked, *modules, "widget.js"]:
            status, headers, body = get(running.url + name)
            assert status == 200, name
            assert body == (serving.FOLDER / name).read_bytes()
            assert headers["Content-Type"].partition(";")[0] in {
                ".js": ("text/javascript", "application/javascript"),
                ".wasm": ("application/wasm",),
                ".css": ("text/css",),
            }.get(Path(name).suffix, (headers["Content-Type"],))


def test_a_wheel_takes_the_page_along() -> None:
    settings = (ROOT / "pyproject.toml").read_text()
    included = re.search(r'^include = \[\{ path = "([^"]+)", format = \["sdist", "wheel"\]', settings, re.MULTILINE)
    assert included is not None
    # Made by `make studio-page`, which `make test-python` sees to.
    assert (serving.FOLDER / "index.html").is_file()
    packed = {path for path in ROOT.glob(included[1] + "/*") if path.is_file()}
    assert packed == {path for path in serving.FOLDER.rglob("*") if path.is_file()}
