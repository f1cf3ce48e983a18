"""Leaves of the schema: what one value of the language may look like, declared beside what editors are told.

A leaf stays the document's node, with its place; its text is parsed where its names are known. Here only its form
is checked: a text, a list of three, one of a few words. Wrong forms are reported and become None, so that one wrong
value never hides another.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, Final

from gesturec.diagnostics.diagnostic import Related
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.document import Mapping, Node, Sequence, Text
from gesturec.language.findings import Findings

Json = dict[str, Any]
Test = Callable[[Any, Findings], bool]

PASSED: Final = re.compile(r"\$[A-Za-z_][A-Za-z0-9_]*\Z")
NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
PATH: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*\Z")
# What stands in place of a comma on other keyboards.
STRANGE_COMMAS: Final = ";\N{FULLWIDTH COMMA}\N{IDEOGRAPHIC COMMA}"
# What is written as a text, and may begin as a list or mapping of YAML does.
QUOTED: Final = frozenset(("an expression", "a gesture pattern"))
RESERVED: Final = frozenset(
    ("and", "or", "not", "if", "else", "for", "in", "true", "false", "within", "root", "world", "prev", "next", "when")
)


def is_passed(node: object) -> bool:
    """Whether a node is `$name` alone, which passes any value whole."""
    return isinstance(node, Text) and PASSED.match(node) is not None


def kind_of(node: object) -> str:
    """What a node is, in words."""
    if isinstance(node, Text):
        return f"`{node}`" if len(node) <= 40 else "a text"
    return "a list" if isinstance(node, Sequence) else "a mapping"


def wrong_kind(node: Any, wanted: str, findings: Findings) -> None:
    """Report a node of the wrong form."""
    message = f"{wanted} is wanted here, and this is {kind_of(node)}"
    begins = node.span.text[:1]
    is_text = wanted in QUOTED and not isinstance(node, Text) and begins in ("[", "{")
    help = f"a text that begins with `{begins}` is put in quotes" if is_text else bracketed(node, wanted)
    findings.report("wrong-kind", message, first_line(node), f"not {wanted}", help)


def bracketed(node: Any, wanted: str) -> str | None:
    """What to write for a list without its brackets, or a mapping with those of a list."""
    if isinstance(node, Sequence) and wanted.startswith("a mapping") and node.span.text.startswith("["):
        is_pairs = len(node) > 0 and all(isinstance(item, Mapping) for item in node)
        return "a mapping is written in curly brackets: `{key: value, …}`" if is_pairs else None
    if isinstance(node, Sequence) and wanted == "poses joined by `->`":
        return f"write `{' -> '.join(map(str, node))}`" if every_path([str(item) for item in node]) else None
    if not isinstance(node, Text) or not wanted.startswith(("a list", "a vector")):
        return None
    if wanted.startswith("a list of") and PATH.match(node):
        return f"write `[{node}]`"
    if "," not in node:
        return None
    return f"a list is written in square brackets: `[{node.strip('[](){}')}]`" if len(node) <= 40 else None


def first_line(node: Any) -> Any:
    """The place of a node; of a list or mapping in block style its first item, which is where one looks."""
    if isinstance(node, Mapping) and node and node.span.start == next(iter(node)).span.start:
        return next(iter(node)).span
    return node.span


@dataclass(frozen=True, eq=False)
class Leaf:
    """One form of value. `test` reports and returns False where the node is not of it."""

    wanted: str
    test: Test
    json: Json = field(default_factory=lambda: {"type": "string"})
    passes: bool = True  # whether `$name` may stand for it

    def read(self, node: Any, findings: Findings) -> Node | None:
        """The node, or None if it is reported."""
        if node is None or (self.passes and is_passed(node)):
            return node  # type: ignore[no-any-return]
        return node if self.test(node, findings) else None


def every(tests: Iterable[bool]) -> bool:
    """Whether all hold; each is asked, so that each can report."""
    return False not in list(tests)


def text_of(wanted: str) -> Test:
    """Any text."""

    def test(node: Any, findings: Findings) -> bool:
        if isinstance(node, Text):
            return True
        wrong_kind(node, wanted, findings)
        return False

    return test


def word_of(*words: str) -> Test:
    """One of a few words."""

    def test(node: Any, findings: Findings) -> bool:
        if node in words and isinstance(node, Text):
            return True
        if not isinstance(node, Text):
            wrong_kind(node, "one of " + ", ".join(words), findings)
            return False
        listed = ", ".join(f"`{word}`" for word in words)
        short = next((word for word in words if len(word) > 2 and node.startswith(word)), None)
        help = f"did you mean `{short}`?" if short else did_you_mean(node, words)
        findings.report("bad-choice", f"`{node}` is not one of {listed}", node.span, help=help)
        return False

    return test


def is_name(node: Any, findings: Findings) -> bool:
    """A name of the author's."""
    if not isinstance(node, Text):
        wrong_kind(node, "a name", findings)
    elif NAME.match(node) is None:
        rule = "a name has letters, digits and `_`, and begins with no digit"
        findings.report("bad-name", f"`{node}` is not a name: {rule}", node.span, "not a name", helped(node))
    elif node in RESERVED:
        findings.report(
            "reserved-name", f"`{node}` is a word of the language and names nothing of the author's", node.span
        )
    else:
        return True
    return False


def helped(node: Text) -> str | None:
    """What to write for a text that is nearly a name."""
    if "#" in node and NAME.match(node.partition("#")[0]):
        return "a comment begins with a blank and `#`"
    bare = node.strip("“”„‘’«»")
    if bare != node and PATH.match(bare):
        return f"write `{bare}`"
    if not node.isascii():
        return strange(node)
    parts = node.split()
    return f"names in a list have commas between them: `{', '.join(parts)}`" if every_path(parts) else None


def strange(text: str) -> str:
    """What the first letter of a text is that is of another script, however it looks."""
    import unicodedata

    char = next(char for char in text if not char.isascii())
    return f"`{char}` is {unicodedata.name(char, 'no letter').lower()}, U+{ord(char):04X}"


def every_path(parts: list[str]) -> bool:
    """Whether these are two names or more."""
    return len(parts) > 1 and all(PATH.match(part) for part in parts)


def is_path(node: Any, findings: Findings) -> bool:
    """A name, or names joined by dots."""
    if isinstance(node, Text) and PATH.match(node) is not None:
        return True
    if isinstance(node, Text):
        message = f"`{node}` is not a name, or names joined by dots"
        findings.report("bad-name", message, node.span, "not a name", helped(node))
    else:
        wrong_kind(node, "a name", findings)
    return False


def texts_in(node: Any, wanted: str, findings: Findings) -> bool:
    """A list whose items are all texts."""
    if not isinstance(node, Sequence):
        wrong_kind(node, wanted, findings)
        return False
    return every(text_of("a text")(item, findings) for item in node)


def is_vector(node: Any, findings: Findings) -> bool:
    """`[a, b, c]`, or an expression that is a vector."""
    if isinstance(node, Text):
        return True
    if not texts_in(node, "a vector `[x, y, z]`", findings):
        return False
    if len(node) != 3:
        parts = [part.rstrip(STRANGE_COMMAS) for item in node for part in item.split()]
        help = f"a comma is missing: `[{', '.join(parts)}]`" if len(parts) == 3 else None
        message = f"a vector has three numbers, and this has {len(node)}"
        findings.report("wrong-kind", message, node.span, "not `[x, y, z]`", help)
    return len(node) == 3


def is_levels(node: Any, findings: Findings) -> bool:
    """A list of numbers, or names with numbers."""
    if isinstance(node, Mapping):
        return every(is_name(key, findings) and text_of("a number")(value, findings) for key, value in node.items())
    return texts_in(node, "a list of levels, or names with levels,", findings)


def is_rest(node: Any, findings: Findings) -> bool:
    """A mapping; which keys it has is seen where it is read."""
    if isinstance(node, Mapping):
        return True
    wrong_kind(node, "a rest such as `{turns: [[z, 30]]}`", findings)
    return False


def is_color(node: Any, findings: Findings) -> bool:
    """A CSS name or `[r, g, b]`."""
    return isinstance(node, Text) or is_vector(node, findings)


def is_configuration(node: Any, findings: Findings) -> bool:
    """A configuration map, one or two deep, or an expression."""
    if isinstance(node, Text):
        return True
    if not isinstance(node, Mapping):
        wrong_kind(node, "an expression or a configuration map", findings)
        return False
    return every(is_map_entry(value, findings) for value in node.values())


def is_map_entry(node: Any, findings: Findings) -> bool:
    """What a configuration map says of a joint or limb."""
    if isinstance(node, Mapping):
        return every(text_of("a joint's value")(value, findings) for value in node.values())
    return text_of("a joint's value, a joint map or an expression")(node, findings)


def is_keys(node: Any, findings: Findings) -> bool:
    """Keys of a cycle: a mapping of mappings, or the name of a file."""
    if isinstance(node, Text):
        return True
    if not isinstance(node, Mapping):
        wrong_kind(node, "keys by joint, or a file's name", findings)
        return False
    good = True
    for value in node.values():
        if not isinstance(value, Mapping):
            wrong_kind(value, "keys `{0: value, 50: value}`", findings)
            good = False
        elif not every(text_of("a joint's value")(item, findings) for item in value.values()):
            good = False
    return good


def is_phases(node: Any, findings: Findings) -> bool:
    """Phases: names with where they begin, or with phases of their own."""
    if not isinstance(node, Mapping):
        wrong_kind(node, "phases `{name: 0, name: 50}`", findings)
        return False
    parts = [is_name(k, findings) and (isinstance(v, Text) or is_phases(v, findings)) for k, v in node.items()]
    return all(parts)


def is_dwell(node: Any, findings: Findings) -> bool:
    """An interval, or intervals by name."""
    if isinstance(node, Mapping):
        return every(text_of("an interval")(value, findings) for value in node.values())
    return text_of("an interval, or intervals by name,")(node, findings)


def is_names(node: Any, findings: Findings) -> bool:
    """A list of names."""
    if not isinstance(node, Sequence):
        wrong_kind(node, "a list of names", findings)
        return False
    return every(is_path(item, findings) for item in node)


def is_members(node: Any, findings: Findings) -> bool:
    """A list of names, each once; one that stands twice is reported and the list kept, which means the same."""
    if not is_names(node, findings):
        return False
    firsts: dict[Text, Text] = {}
    for item in node:
        first = firsts.setdefault(item, item)
        if first is not item:
            related = (Related("first here", first.span),)
            message = f"`{item}` stands twice in one list of members"
            findings.report("repeated-member", message, item.span, "again here", "name each once", related)
    return True


def is_bound_tokens(node: Any, findings: Findings) -> bool:
    """`{OURS: THEIRS}` or a list of ours."""
    if isinstance(node, Sequence):
        return is_members(node, findings)
    if not isinstance(node, Mapping):
        wrong_kind(node, "tokens with the names that another tool gives them", findings)
        return False
    return every(is_theirs(value, findings) for value in node.values())


def is_theirs(node: Any, findings: Findings) -> bool:
    """A name, a list of names, or names with weights."""
    if isinstance(node, Mapping):
        return every(text_of("a weight")(value, findings) for value in node.values())
    return isinstance(node, Text) or texts_in(node, "a name, a list of names, or names with weights", findings)


def is_arguments(node: Any, findings: Findings) -> bool:
    """A list of names, or names with defaults."""
    if isinstance(node, Mapping):
        return every(is_name(key, findings) for key in node)
    if isinstance(node, Sequence):
        return every(is_name(item, findings) for item in node)
    wrong_kind(node, "a list of arguments, or arguments with defaults", findings)
    return False


def is_anything(node: Any, findings: Findings) -> bool:
    """Any node at all."""
    return True
