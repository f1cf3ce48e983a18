"""Every limit of what a file says: refused with what was found, the limit and what raises it; raised, it passes."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import pytest

from gesturec.checks.check import resolve_model
from gesturec.cli.main import main
from gesturec.compile import findings_of
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.errors import ModelError
from gesturec.diagnostics.rules import severity
from gesturec.diagnostics.source import Source
from gesturec.expansion.limits import DEFAULT_LIMITS, Limits
from gesturec.language import load_model
from gesturec.lowering.lower import lower_body

HEAD = """gesturec: 1
name: arm
units: {length: mm, angle: deg}
root: {name: base, tokens: {a: [0, 0, 0], b: [90, 0, 0], c: [0, 60, 0]}}
"""
CHAIN = "{chain: [{joint: bend, axis: z, levels: [0, 45]}, {token: tip, at: [30, 0, 0]}]}"


def limbs(n: int) -> str:
    return HEAD + "limbs:\n" + "".join(f"  l{i}: {CHAIN}\n" for i in range(n))


def mirrors(n: int) -> str:
    images = "".join(f"  l{i + 1}: {{mirror: l{i}, across: z}}\n" for i in range(n))
    return HEAD + f"limbs:\n  l0: {CHAIN}\n{images}"


def hanging(n: int) -> str:
    more = "".join(f"  l{i + 1}: {{parent: l{i}.bend, {CHAIN[1:]}\n" for i in range(n))
    return HEAD + f"limbs:\n  l0: {CHAIN}\n{more}"


def every(n: int) -> str:
    chain = f"[{{joint: bend, axis: z, range: 0 .. 90, every: 90 / {n - 1}}}, {{token: tip, at: [30, 0, 0]}}]"
    return HEAD + f"limbs:\n  l: {{chain: {chain}}}\n"


def count(n: int) -> str:
    return every(2).replace("every: 90 / 1", f"count: {n}")


def samples(n: int) -> str:
    chain = "[{joint: bend, axis: z}, {token: tip, at: [30, 0, 0]}]"
    cycle = f"{{period: 1 s, samples: {n}, keys: {{bend: {{0: 0, 50: 60}}}}}}"
    return HEAD + f"limbs:\n  l: {{chain: {chain}, machine: {{cycle: {cycle}}}}}\n"


def terms(n: int) -> str:
    poses = "poses:\n  all_bent: all(z.bend >= 45 for z in group)\n"
    return limbs(n) + f"groups: {{group: [{', '.join(f'l{i}' for i in range(n))}]}}\n" + poses


def operations(n: int) -> str:
    """A pose of n comparisons: 4 n - 1 operations."""
    return limbs(1) + f"poses:\n  p: {' and '.join(['l0.bend >= 45'] * n)}\n"


def steps(n: int) -> str:
    return (
        limbs(1)
        + "poses:\n  p: l0.bend >= 45\n"
        + f"gestures:\n  g: {' -> '.join(['enter(p)', 'leave(p)'] * (n // 2))}\n"
    )


def nesting(n: int) -> str:
    poses = "".join(f"  p{i + 1}: p{i} and l0.bend >= 45\n" for i in range(n))
    return limbs(1) + f"poses:\n  p0: l0.bend >= 45\n{poses}"


def nested_gestures(n: int) -> str:
    gestures = "".join(f"  g{i + 1}: g{i}\n" for i in range(n))
    return limbs(1) + f"poses:\n  p: l0.bend >= 45\ngestures:\n  g0: p\n{gestures}"


def followed(n: int) -> str:
    joints = ", ".join(f"{{joint: j{i}, axis: z, levels: [0, 45]}}" for i in range(n))
    last = f"{{joint: last, axis: z, follows: {' + '.join(f'j{i}' for i in range(n))}}}"
    return HEAD + f"limbs:\n  l: {{chain: [{joints}, {last}, {{token: tip, at: [30, 0, 0]}}]}}\n"


# limit: what is made of a size, the largest that passes where the limit is as given
CASES: dict[str, tuple[str, Callable[[int], str], int, int]] = {
    "limbs": ("limbs", limbs, 3, 3),
    "mirrors": ("mirrors", mirrors, 3, 3),
    "hanging": ("hanging", hanging, 3, 3),
    "levels by steps": ("levels", every, 10, 10),
    "levels by count": ("levels", count, 10, 10),
    "samples": ("samples", samples, 20, 20),
    "terms": ("terms", terms, 4, 4),
    "operations": ("operations", operations, 7, 2),
    "steps": ("steps", steps, 4, 4),
    "poses of poses": ("nesting", nesting, 5, 5),
    "gestures of gestures": ("nesting", nested_gestures, 5, 5),
    "followed": ("followed", followed, 2, 2),
    "nodes": ("nodes", limbs, 150, 4),
    "file bytes": ("file_bytes", limbs, 500, 4),
}


def errors(text: str, limits: Limits) -> list[Diagnostic]:
    found = findings_of(Source("m.yaml", text), limits=limits)
    return [finding for finding in found if severity(finding.rule) == "error"]


@pytest.mark.parametrize(("name", "make", "limit", "size"), CASES.values(), ids=CASES)
def test_one_more_is_refused_and_a_raised_limit_lets_it_pass(
    name: str, make: Callable[[int], str], limit: int, size: int
) -> None:
    at = Limits(**{name: limit})
    assert errors(make(size), at) == []
    text = make(2 * size + 2)
    (finding,) = errors(text, at)
    assert finding.rule == ("value-out-of-range" if make in (count, samples) else "limit-exceeded")
    assert finding.span is not None and f"{limit}" in finding.message
    assert f"--limit {name}=N" in (finding.help or "") and f"Limits.{name}" in (finding.help or "")
    assert errors(text, Limits(**{name: 1000 * limit})) == []


def test_a_file_of_keys_is_read_whole_or_not_at_all(tmp_path: Path) -> None:
    (tmp_path / "keys.csv").write_text("at,bend\n0,0\n50,60\n")
    chain = "[{joint: bend, axis: z}, {token: tip, at: [30, 0, 0]}]"
    cycle = "{period: 1 s, samples: 20, keys: keys.csv}"
    model = tmp_path / "m.yaml"
    model.write_text(HEAD + f"limbs:\n  l: {{chain: {chain}, machine: {{cycle: {cycle}}}}}\n")
    allowed = findings_of(model, limits=Limits(key_bytes=18))
    assert all(severity(finding.rule) == "warning" for finding in allowed)
    found = findings_of(model, limits=Limits(key_bytes=15))
    assert [finding.rule for finding in found if "key_bytes" in (finding.help or "")] == ["limit-exceeded"]


def test_a_profile_is_held_to_the_size_of_a_file(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(limbs(1))
    profile = tmp_path / "p.yaml"
    profile.write_text("gesturec: 1\n" + "# long\n" * 200)
    (finding,) = findings_of(tmp_path / "m.yaml", profile=profile, limits=Limits(file_bytes=1000))
    assert finding.rule == "limit-exceeded" and "--limit file_bytes=N" in (finding.help or "")
    assert findings_of(tmp_path / "m.yaml", profile=profile) == ()


def doubling(folder: Path, depth: int) -> Path:
    """Files of which each has two bodies of the next: two to the power of `depth` bodies."""
    head = "gesturec: 1\nname: n\nunits: {length: mm, angle: deg}\n"
    for level in range(depth):
        text = f"{head}bodies: {{a: {{model: m{level + 1}.yaml}}, b: {{model: m{level + 1}.yaml}}}}\n"
        (folder / f"m{level}.yaml").write_text(text)
    (folder / f"m{depth}.yaml").write_text(HEAD)
    return folder / "m0.yaml"


def test_bodies_of_bodies_are_counted_before_they_are_built(tmp_path: Path) -> None:
    (finding,) = findings_of(doubling(tmp_path, 60))
    assert finding.rule == "limit-exceeded" and "128 bodies; the limit is 100" in finding.message
    assert finding.span is not None and finding.span.source.name.endswith("m53.yaml")
    assert "--limit bodies=N" in (finding.help or "")


def test_more_bodies_may_be_asked_for(tmp_path: Path) -> None:
    model = doubling(tmp_path, 3)
    assert [finding.rule for finding in findings_of(model, limits=Limits(bodies=7))] == ["limit-exceeded"]
    assert findings_of(model, limits=Limits(bodies=8)) == ()


def test_limbs_that_hang_too_deep_for_the_stack_are_a_finding_still() -> None:
    head, *lines = hanging(300).partition("limbs:\n")
    text = head + "limbs:\n" + "".join(f"{line}\n" for line in reversed(lines[-1].splitlines()))
    body, findings = resolve_model(load_model(Source("m.yaml", text)), limits=Limits(hanging=300))
    assert findings.errors() == ()
    depth = sys.getrecursionlimit()
    try:
        sys.setrecursionlimit(300)  # as if there were a thousand limbs
        with pytest.raises(ModelError) as raised:
            lower_body(body)
    finally:
        sys.setrecursionlimit(depth)
    (finding,) = raised.value.diagnostics
    assert finding.rule == "limit-exceeded" and "too deep" in finding.message


def test_the_command_line_takes_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "m.yaml"
    model.write_text(limbs(4))
    assert main(["check", str(model), "--limit", "limbs=3"]) == 1
    assert "the body has 4 limbs; the limit is 3" in capsys.readouterr().out
    assert main(["check", str(model), "--limit", "limbs=4"]) == 0
    for command in (["dump", "--stage", "document"], ["origin"]):
        path = ["l0"] if command == ["origin"] else []
        assert main([*command, str(model), *path, "--limit", "nodes=10"]) == 1
        capsys.readouterr()
        assert main([*command, str(model), *path, "--limit", "nodes=1000"]) == 0
    assert main(["check", str(model), "--limit", "limb=4"]) == 2
    assert "limbs" in capsys.readouterr().err


def test_help_tells_every_limit_with_its_default(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compile", "--help"]) == 0
    told = capsys.readouterr().out.replace(",", " ").split()
    for field in fields(DEFAULT_LIMITS):
        assert f"{field.name}={getattr(DEFAULT_LIMITS, field.name)}" in told
