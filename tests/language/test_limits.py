"""Hostile files are refused quickly, in little memory, by name and place; broken ones get one located finding."""

from __future__ import annotations

import time
import tracemalloc

import pytest

from gesturec.compile import findings_of
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.source import Source
from gesturec.language.document import Document
from gesturec.language.findings import Findings
from gesturec.language.limits import Limits
from gesturec.language.reader import read_document

# What issue 2 allows.
MOST_SECONDS = 2.0
MOST_BYTES = 150 * 2**20

BOMB = b"a: &a [x,x,x,x,x,x,x,x,x]\n" + b"".join(
    b"%c: &%c [%s]\n" % (c, c, b",".join([b"*%c" % (c - 1)] * 9)) for c in range(98, 107)
)


def read(data: bytes, limits: Limits | None = None) -> tuple[Document | None, tuple[Diagnostic, ...]]:
    findings = Findings()
    return read_document("m.yaml", data, findings, limits or Limits()), findings.sorted()


@pytest.mark.parametrize(
    ("data", "limit"),
    [
        (BOMB, "nodes"),
        (b"[" * 100_000, "depth"),
        (b"{a: " * 100_000, "depth"),
        (b"- " * 100_000, "depth"),
        (b"a: &a [" * 100_000, "depth"),
        (b"x: &x 1\ny: [" + b"*x, " * 5_000 + b"]", "aliases"),
        (b"x: " + b"y" * 100_000, "scalar_length"),
        (b"x: [" + b"1, " * 400_000 + b"]", "nodes"),
        (b"#" * 5_000_000, "file_bytes"),
    ],
    ids=[
        "alias bomb",
        "brackets",
        "braces",
        "dashes",
        "anchors",
        "aliases",
        "a long text",
        "many items",
        "a large file",
    ],
)
def test_what_is_too_large_is_refused_quickly_and_in_little_memory(data: bytes, limit: str) -> None:
    start = time.process_time()
    read(data)
    seconds = time.process_time() - start
    tracemalloc.start()
    document, findings = read(data)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert document is None
    (finding,) = findings
    assert finding.rule == "limit-exceeded"
    assert finding.help is not None and f"Limits.{limit}" in finding.help
    assert seconds < MOST_SECONDS
    assert peak < MOST_BYTES


def test_an_alias_bomb_is_small_and_means_much() -> None:
    assert len(BOMB) < 400
    assert 9**10 > 3_000_000_000


def test_a_limit_that_is_raised_lets_the_file_pass() -> None:
    deep = b"a: " + b"[" * 60 + b"]" * 60
    assert read(deep)[0] is None
    assert read(deep, Limits(depth=100))[0] is not None


def test_aliases_within_limits_are_copies() -> None:
    document, findings = read(b"a: &a {b: [1, 2]}\nc: *a\n")
    assert findings == () and document is not None
    assert [value for _, value in sorted(document.root.items())] == [{"b": ["1", "2"]}] * 2


@pytest.mark.parametrize(
    ("data", "rule", "place"),
    [
        (b"\xff\xfea", "bad-encoding", (1, 1)),
        (b"a: b\nc: \xe9\n", "bad-encoding", (2, 4)),
        ("a: b".encode("utf-16"), "bad-encoding", (1, 1)),
        (b"a: [1,\nb: 2", "bad-yaml", (1, 4)),
        (b"a: 'b", "bad-yaml", (1, 4)),
        (b"a: \x00", "bad-yaml", (1, 4)),
        (b"", "wrong-kind", (1, 1)),
        (b"# nothing\n", "wrong-kind", (1, 1)),
        (b"- a\n", "wrong-kind", (1, 1)),
        (b"%YAML 9.9\n---\na: b", "bad-yaml", (1, 1)),
    ],
)
def test_a_broken_file_gets_one_located_finding(data: bytes, rule: str, place: tuple[int, int]) -> None:
    document, findings = read(data)
    assert document is None
    (finding,) = findings
    assert finding.span is not None
    assert (finding.rule, finding.span.line, finding.span.column) == (rule, *place)


def test_every_scalar_stays_text_with_its_place() -> None:
    document, findings = read("on: yes\ny: 010\nx: 12:30\ng: 'a''b'\nü: \"tab\\t\"\n".encode())
    assert findings == () and document is not None
    assert dict(document.root) == {"on": "yes", "y": "010", "x": "12:30", "g": "a'b", "ü": "tab\t"}
    place = {str(key): (value.span.line, value.span.column) for key, value in document.root.items()}
    assert place == {"on": (1, 5), "y": (2, 4), "x": (3, 4), "g": (4, 4), "ü": (5, 4)}


def test_a_byte_order_mark_is_dropped() -> None:
    document, findings = read(b"\xef\xbb\xbfa: b\n")
    assert findings == () and document is not None
    assert dict(document.root) == {"a": "b"}


@pytest.mark.parametrize("end", ["\r\n", "\r"])
def test_lines_end_as_other_systems_end_them(end: str) -> None:
    source = Source("m.yaml", end.join(("gesturec: 1", "name: a", "nmae: b", "")))
    (line,) = {f.span.line for f in findings_of(source) if f.rule == "unknown-key" and f.span is not None}
    assert line == 3 and source.line_text(3) == "nmae: b"


@pytest.mark.parametrize("sign", ['"', "'", "[", "{", "a ", "\u00a0"])
def test_a_long_broken_text_is_told_in_time(sign: str) -> None:
    text = "gesturec: 1\nname: a\nx-a: [" + sign * 30_000 + "\n: ]\n"
    assert findings_of(Source("m.yaml", text))
