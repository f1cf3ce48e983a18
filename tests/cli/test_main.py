"""The command line as a whole: help, exit codes, one line for every error, files that are whole or not there."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from gesturec.cli import main as main_module
from gesturec.cli.main import COMMANDS, NOT_BUILT, main
from gesturec.cli.output import text_output
from gesturec.runtime.status import STATUSES

ROOT = Path(__file__).parent.parent.parent
Capture = pytest.CaptureFixture[str]


def gesturec(*arguments: str, cwd: Path, **more: str) -> subprocess.CompletedProcess[str]:
    """Run in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **more}
    command = [sys.executable, "-c", "import sys; from gesturec.cli.main import main; sys.exit(main())", *arguments]
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=120)


def test_help_names_every_command_that_is_built(capsys: Capture) -> None:
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    for name in COMMANDS:
        assert f"  {name} " in text
    for name in NOT_BUILT:
        assert f"  {name} " not in text


def test_every_command_has_its_module_and_its_help(capsys: Capture) -> None:
    for name in COMMANDS:
        assert main([name, "--help"]) == 0
        out = capsys.readouterr().out
        assert out.startswith(f"usage: gesturec {name}")
        assert "--json" in out, f"{name} prints facts and takes no --json"


def test_a_status_of_a_frame_is_explained_as_a_rule_is(capsys: Capture) -> None:
    for status in STATUSES:
        assert main(["explain", status.name]) == 0
        assert status.doc in capsys.readouterr().out
    assert main(["explain", "misfit", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["status"] == "misfit"
    assert main(["explain"]) == 0
    listed = capsys.readouterr().out
    assert "unknown-joint" in listed and "coasting" in listed
    assert main(["explain", "misift"]) == 2
    assert "did you mean `misfit`" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["decod"], "did you mean `decode`"),
        (["serve"], "`serve` is not built yet"),
        (["--strict", "check"], "belongs behind a command"),
        (["explain", "unknown-jiont"], "did you mean `unknown-joint`"),
        (["decode", "hand"], "required"),
        (["decode", "hand", "a.csv", "-o", "out.xlsx"], "`.xlsx`"),
        (["decode", "hand", "a.csv", "b.csv", "-o", "out.csv"], "OUT is one folder"),
        (["decode", "hand", "a.csv", "x/a.csv", "-o", "out"], "one name"),
        (["decode", "hand", "a.csv", "b.csv", "-o", "out", "-o", "more"], "OUT is one folder"),
        (["graph", "hand", "-o", "a.svg", "-o", "a.dot"], "given twice"),
        (["simulate", "hand", "--random", "-o", "a.csv", "--output", "b.csv"], "given twice"),
        (["decode", "hand", "a.csv", "-o", "out", "--decoder", "magic"], "`magic`"),
        (["decode", "hand", "a.csv", "-o", "out", "--noise", "2furlong"], "not a length"),
        (["decode", "hand", "a.csv", "-o", "out", "--lag=-1s"], "negative"),
        (["decode", "hand", "a.csv", "-o", "out", "--scale", "0"], "above zero"),
        (["decode", "hand", "a.csv", "-o", "out", "--cluster", "tcp://here"], "not built yet"),
        (["simulate", "hand", "-o", "a.csv"], "required"),
        (["simulate", "hand", "--random", "-o", "a.xlsx"], "`.xlsx`"),
        (["simulate", "hand", "--random", "-o", "a.csv", "--noise-px", "1"], "needs --rig"),
        (["simulate", "hand", "--random", "--path", "fist", "-o", "a.csv"], "not allowed with"),
        (["compile", "hand", "-o", "a.gcm", "--set", "side"], "name=value"),
        (["graph", "hand", "-o", "a.png"], "`.png`"),
        (["compile", "hand.gcm", "-o", "a.gcm"], "compiled already"),
        (["check", "take.csv"], "is a recording"),
    ],
)
def test_wrong_usage_is_exit_code_2_and_one_message(
    arguments: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    assert message in capsys.readouterr().err
    assert [path for path in tmp_path.iterdir() if path.is_file()] == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["info", "none.csv"], "none.csv: No such file"),
        (["info", "hnd"], "hnd: no such file"),
        (["check", "none.yaml"], "none.yaml"),
        (["info", "none.gcm"], "none.gcm"),
        (["info", "."], "needs its rig"),
        (["score", "none", "none"], "none: no such file"),
        (["compile", "hand", "-o", "none/hand.gcm"], "folder does not exist"),
        (["compile", "hand", "-o", "."], "is a folder"),
    ],
)
def test_what_is_not_there_is_exit_code_1_and_one_line(
    arguments: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 1
    output = capsys.readouterr()
    assert message in output.err + output.out
    assert "Traceback" not in output.err
    assert list(tmp_path.iterdir()) == []


def test_our_own_fault_is_exit_code_3_and_one_line(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    def broken(arguments: list[str]) -> int:
        raise ZeroDivisionError("of\nours")

    monkeypatch.setattr(main_module, "_dispatch", broken)
    assert main(["info"]) == 3
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "ZeroDivisionError: of ours" in error and "--traceback" in error
    with pytest.raises(ZeroDivisionError):
        main(["info", "--traceback"])


def test_a_reader_that_has_enough_is_no_error(tmp_path: Path) -> None:
    command = f"{sys.executable} -c 'import sys; from gesturec.cli.main import main; sys.exit(main())' explain"
    done = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {command} | head -n 1"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_the_version_is_the_package_s(capsys: Capture) -> None:
    import gesturec

    assert main(["--version"]) == 0
    assert capsys.readouterr().out.strip() == f"gesturec {gesturec.__version__}"


def test_an_error_leaves_what_was_there_before(tmp_path: Path) -> None:
    path = tmp_path / "out.csv"
    path.write_text("before", encoding="utf-8")
    with pytest.raises(RuntimeError), text_output(path) as stream:
        stream.write("half of it")
        raise RuntimeError
    assert path.read_text(encoding="utf-8") == "before"
    assert list(tmp_path.iterdir()) == [path]
    with text_output(path) as stream:
        stream.write("after")
    assert path.read_text(encoding="utf-8") == "after"


def test_a_file_that_may_not_be_written_is_one_line_with_its_name(tmp_path: Path) -> None:
    if os.geteuid() == 0:
        pytest.skip("root may write everywhere")
    tmp_path.chmod(0o500)
    done = gesturec("schema", "-o", "schema.json", cwd=tmp_path)
    assert done.returncode == 1 and done.stderr == "error: schema.json: Permission denied\n"


def test_nothing_is_colored_in_a_pipe(tmp_path: Path) -> None:
    done = gesturec("info", "none.csv", cwd=tmp_path, NO_COLOR="1")
    assert "\x1b" not in done.stdout + done.stderr


def test_help_costs_at_most_three_times_bare_python(tmp_path: Path) -> None:
    """Measured in instructions of the interpreter, not in seconds: modules that are loaded."""
    count = "import sys; print(len(sys.modules))"
    bare = int(subprocess.check_output([sys.executable, "-c", count], text=True))
    script = f"from gesturec.cli.main import main; import os; main(['--help']); {count}"
    loaded = subprocess.check_output([sys.executable, "-c", script], text=True, cwd=ROOT)
    assert int(loaded.splitlines()[-1]) <= 3 * bare


def test_the_schema_is_a_json_schema(capsys: Capture) -> None:
    assert main(["schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert {"gesturec", "name", "units", "root", "limbs"} <= set(schema["properties"])
