"""Where an author slipped in a text that YAML refuses, and what to write instead.

In: the text and the parser's error. Out: a `Slip`. YAML notices a bracket or quote that is never closed, and a comma
or colon that is not there, only at what comes after, often lines later; here the tokens before that place are looked
through once more for the slip itself. A line that is indented no further than the one where a bracket was opened, or
begins with `- `, is taken to stand outside of it: so it is in every layout that people use.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, Final, NamedTuple

import yaml
from yaml import tokens as token

CLOSES: Final = {"[": "]", "{": "}"}
STARTS: Final = (token.FlowSequenceStartToken, token.FlowMappingStartToken)
ENDS: Final = (token.FlowSequenceEndToken, token.FlowMappingEndToken)
OUTSIDE: Final = (token.BlockEntryToken, token.StreamEndToken, token.DocumentStartToken, token.DocumentEndToken)
# What a value of `[…]` or `{…}` can end with, and what one can begin with.
ENDS_VALUE: Final = (token.ScalarToken, token.AliasToken, *ENDS)
BEGINS_VALUE: Final = (token.ScalarToken, token.AliasToken, token.AnchorToken, token.TagToken, token.KeyToken, *STARTS)
# What stands in place of a comma or colon on other keyboards and in other languages.
STRANGE_COMMAS: Final = ";\N{FULLWIDTH COMMA}\N{FULLWIDTH SEMICOLON}\N{IDEOGRAPHIC COMMA}"
STRANGE_COLONS: Final = "=\N{FULLWIDTH COLON}"
STRANGE_BLANK: Final = re.compile("[\u00a0\u1680\u2000-\u200b\u202f\u205f\u3000\ufeff]")
CONFLICTS: Final = ("<<<<<<<", "=======", ">>>>>>>")
SIMPLE: Final = re.compile(r"[\w.+-]+\Z")  # a value that is no expression
WORD: Final = re.compile(r"[A-Za-z_][\w-]*\Z")
LONGEST_KEY: Final = 200  # characters of a line that are looked through for its key
# A line of a block: `key: …`, behind any number of `- `.
BLOCK_KEY: Final = re.compile(r"[ ]*(?:- +)*([^\s:#'\"\[\]{}-][^:#'\"\[\]{}]*?)[ ]*(:(?:\s|$)|$)")


class Slip(NamedTuple):
    """What is wrong, from where to where, and what to write."""

    problem: str
    start: int
    end: int
    help: str | None


class Open(NamedTuple):
    """A bracket that is open: its sign, where it stands, and the indentation of its line."""

    sign: str
    at: int
    indent: int


class Layout(NamedTuple):
    """A text in lines."""

    text: str

    def start(self, index: int) -> int:
        """Where the line of a character begins."""
        return self.text.rfind("\n", 0, index) + 1

    def line(self, index: int) -> str:
        """The line of a character."""
        end = self.text.find("\n", index)
        return self.text[self.start(index) : len(self.text) if end < 0 else end].rstrip("\r")

    def indent(self, index: int) -> int:
        """How far the line of a character is indented."""
        line = self.line(index)
        return len(line) - len(line.lstrip(" "))

    def begins_line(self, index: int) -> bool:
        """Whether only blanks stand before a character."""
        return not self.text[self.start(index) : index].strip()

    def above(self, index: int) -> int | None:
        """Where the nearest line above that says something begins to say it."""
        at = self.start(index)
        while at > 0:
            at = self.start(at - 1)
            bare = self.line(at).strip()
            if bare and not bare.startswith("#"):
                return at + self.indent(at)
        return None


def slip_of(text: str, error: yaml.MarkedYAMLError, parser: Any) -> Slip | None:
    """The author's slip behind an error of the parser; None where nothing better is known than what the parser says."""
    mark = error.problem_mark or error.context_mark
    if mark is None:
        return None
    layout, problem = Layout(text), str(error.problem)
    at = min(mark.index, len(text))
    if text[at : at + 1] == "\t" and set(text[layout.start(at) : at]) <= set(" \t-"):
        return Slip("a tab cannot indent", at, at + 1, "indent with spaces")
    read = list(tokens_before(text, at, parser))
    found = foreign_line(layout, error) or unclosed_quote(layout, read, error) or bracket_slip(layout, read)
    found = found or missing_blank(layout, at) or strange_blank(layout, at)
    if found is not None:
        return found
    if error.context == "while scanning a simple key" and error.context_mark is not None:
        return missing_colon(layout, error.context_mark.index)
    if problem.startswith("mapping values are not allowed"):
        return second_colon(layout, at)
    if "unknown escape character" in problem:
        return Slip(
            "`\\` begins no escape that there is", at, at + 1, "a text with `\\` in it is put in quotes like `'`"
        )
    if error.context == "while scanning a block scalar" and not layout.begins_line(at):
        before = text[at - 2] if text[at - 1] == " " else text[at - 1]
        return Slip(
            "a text goes on behind its mark", at, at + 1, f"a text that begins with `{before}` is put in quotes"
        )
    if "cannot start any token" in problem:
        sign = text[at : at + 1]
        return Slip(f"no text begins with `{sign}`", at, at + 1, f"put the text that begins with `{sign}` in quotes")
    if isinstance(error, yaml.parser.ParserError):
        return out_of_line(layout, read, at) or rest_of_line(layout, read, at)
    return None


def tokens_before(text: str, end: int, parser: Any) -> Iterator[Any]:
    """The tokens that begin no later than a place, as far as there are any."""
    try:
        for each in yaml.scan(text, Loader=parser):
            if each.start_mark.index > end:
                return
            yield each
    except (yaml.YAMLError, ValueError, RecursionError):
        return


def foreign_line(layout: Layout, error: yaml.MarkedYAMLError) -> Slip | None:
    """A line that version control left behind, or a comment of another language."""
    for mark in (error.context_mark, error.problem_mark):
        if mark is None or mark.index > len(layout.text):
            continue
        start, line = layout.start(mark.index), layout.line(mark.index)
        if line.startswith(CONFLICTS):
            help = "keep one of the two sides and remove the marks"
            return Slip("a conflict of version control stands here", start, start + len(line), help)
        slashes = re.search(r"(?:^|[ \t])(//|/\*)", line[mark.index - start :] or line)
        if slashes is not None and line.find(slashes[1]) == max(0, mark.index - start):
            at = start + line.find(slashes[1])
            return Slip(f"`{slashes[1]}` begins no comment", at, at + 2, "a comment begins with `#`")
    return None


def missing_blank(layout: Layout, at: int) -> Slip | None:
    """A list item without the blank behind its dash."""
    match = re.match(r" *-(?=[A-Za-z_{\[])", layout.line(at))
    if match is None:
        return None
    dash = layout.start(at) + match.end() - 1
    return Slip("a blank is missing behind `-`", dash, dash + 1, f"write `- {first_key(layout, dash + 1)}`")


def strange_blank(layout: Layout, at: int) -> Slip | None:
    """A blank that YAML takes for a letter, in a line or the one above it."""
    for place in (at, layout.above(at)):
        found = None if place is None else STRANGE_BLANK.search(layout.line(place))
        if found is not None and place is not None:
            start = layout.start(place) + found.start()
            return Slip(f"this blank is U+{ord(found[0]):04X}", start, start + 1, "write a space in its place")
    return None


def unclosed_quote(layout: Layout, read: Sequence[Any], error: yaml.MarkedYAMLError) -> Slip | None:
    """A quote that the text ends without, or that a later one closes in the middle of what follows."""
    if error.context == "while scanning a quoted scalar" and error.context_mark is not None:
        return never_closed(layout, error.context_mark.index)
    for before, after in pairwise(read):
        if not isinstance(before, token.ScalarToken) or before.style not in ("'", '"'):
            continue
        is_cut = before.end_mark.index == after.start_mark.index and isinstance(after, token.ScalarToken)
        if is_cut and before.start_mark.line < before.end_mark.line:
            return never_closed(layout, before.start_mark.index)
    return None


def never_closed(layout: Layout, index: int) -> Slip:
    """A quote or bracket without its partner."""
    sign = layout.text[index]
    help = (
        f"write `{CLOSES[sign]}` where its last value ends" if sign in CLOSES else f"write `{sign}` where the text ends"
    )
    return Slip(f"this `{sign}` is never closed", index, index + 1, help)


def bracket_slip(layout: Layout, read: Sequence[Any]) -> Slip | None:
    """The first thing that is wrong with brackets and what stands in them."""
    opened: list[Open] = []
    line, indent = -1, 0
    had_colon: list[bool] = []  # whether the item that is being read in each open bracket has its colon
    for before, each in zip([None, *read], read, strict=False):
        if each.start_mark.line > line:
            line, indent = each.start_mark.line, each.start_mark.column
        if isinstance(each, ENDS):
            sign = "]" if isinstance(each, token.FlowSequenceEndToken) else "}"
            if not opened or CLOSES[opened[-1].sign] != sign:
                return wrong_end(layout, opened, sign, each.start_mark.index)
            opened.pop()
            had_colon.pop()
        elif opened and (found := inside_slip(layout, opened[-1], had_colon[-1], before, each)) is not None:
            return found
        if isinstance(each, STARTS):
            index = each.start_mark.index
            opened.append(Open(layout.text[index], index, indent))
            had_colon.append(False)
        elif had_colon and isinstance(each, (token.FlowEntryToken, token.ValueToken)):
            had_colon[-1] = isinstance(each, token.ValueToken)
    return None


def wrong_end(layout: Layout, opened: Sequence[Open], sign: str, index: int) -> Slip:
    """A closing bracket that does not close the last one that was opened."""
    if not opened:
        return Slip(f"this `{sign}` closes nothing", index, index + 1, f"remove it, or open `{opposite(sign)}` before")
    wanted = CLOSES[opened[-1].sign]
    if any(CLOSES[each.sign] == sign for each in opened[:-1]):
        return Slip(
            f"this `{opened[-1].sign}` is not closed before `{sign}`",
            opened[-1].at,
            opened[-1].at + 1,
            f"write `{wanted}` where its last value ends",
        )
    if layout.text[index + 1 :].lstrip(" ")[:1] == wanted:
        return Slip(f"this `{sign}` closes nothing", index, index + 1, "remove it")
    return Slip(f"`{sign}` cannot close `{opened[-1].sign}`", index, index + 1, f"write `{wanted}` in its place")


def opposite(sign: str) -> str:
    """The bracket that a sign closes."""
    return "[" if sign == "]" else "{"


def inside_slip(layout: Layout, opened: Open, had_colon: bool, before: Any, each: Any) -> Slip | None:
    """What is wrong with a token in brackets, after the one before it."""
    is_first = isinstance(before, (token.FlowEntryToken, *STARTS))
    begins_line = not is_first and each.start_mark.line > before.end_mark.line
    if isinstance(each, OUTSIDE) or (begins_line and each.start_mark.column <= opened.indent):
        return never_closed(layout, opened.at)
    if isinstance(each, token.ScalarToken) and each.plain and runs_out(layout, opened, each):
        return never_closed(layout, opened.at)
    if isinstance(before, ENDS_VALUE) and isinstance(each, BEGINS_VALUE):
        return missing_sign(layout, opened, had_colon, before, each)
    if isinstance(each, token.FlowEntryToken) and is_first:
        at = each.start_mark.index
        return Slip("nothing stands before this comma", at, at + 1, "remove it")
    if isinstance(each, token.ValueToken) and had_colon and isinstance(before, token.ScalarToken) and before.plain:
        return missing_comma_in(layout, before)
    return None


def runs_out(layout: Layout, opened: Open, scalar: Any) -> bool:
    """Whether a text without quotes goes on into a line that is not of the bracket's."""
    start, end = scalar.start_mark.index, scalar.end_mark.index
    lines = re.finditer(r"\n( *)(?=[^\s#])", layout.text[start : end + 1])
    return any(len(match[1]) <= opened.indent or layout.text.startswith("- ", start + match.end()) for match in lines)


def missing_sign(layout: Layout, opened: Open, had_colon: bool, before: Any, each: Any) -> Slip:
    """Two values with nothing between them: a colon is missing behind what may be a key, else a comma."""
    end = before.end_mark.index
    is_key = isinstance(before, token.ScalarToken) and WORD.match(before.value) is not None
    if opened.sign == "{" and not had_colon and is_key and isinstance(each, STARTS):
        help = f"write `{before.value}: {opened_text(each)}…`"
        return Slip(f"a colon is missing behind `{before.value}`", before.start_mark.index, end, help)
    if had_colon and isinstance(before, token.ScalarToken) and before.plain and isinstance(each, STARTS):
        what = f"a text with `{opened_text(each)}` in it stands here without quotes"
        if SIMPLE.match(before.value) is None:
            return Slip(what, before.start_mark.index, end, "put all of it in quotes")
    return Slip("a comma is missing here", end, end + 1, f"write a comma before `{first_word(layout, each)}`")


def opened_text(each: Any) -> str:
    """The sign of an opening bracket."""
    return "[" if isinstance(each, token.FlowSequenceStartToken) else "{"


def first_word(layout: Layout, each: Any) -> str:
    """What a value begins with, for a message."""
    rest = layout.text[each.start_mark.index :]
    match = re.match(r"([\"']?)[\w.$-]+\1|\S", rest)
    return match[0] if match else ""


def missing_comma_in(layout: Layout, scalar: Any) -> Slip:
    """A second colon in one item of `{…}`: the last word before it is the next key, or the text needs quotes."""
    start, end = scalar.start_mark.index, scalar.end_mark.index
    parts = layout.text[start:end].rsplit(None, 1)
    if len(parts) < 2:
        return Slip("a text with `: ` in it stands here without quotes", start, end, "put it in quotes")
    at, key = start + len(parts[0]), parts[1]
    if layout.text[at - 1] in STRANGE_COMMAS:
        return Slip("a comma is missing here", at - 1, at, f"write `,` in place of `{layout.text[at - 1]}`")
    help = f"write a comma before `{key}`; a text with `: ` in it is put in quotes"
    return Slip("a comma is missing here", at, at + 1, help)


def missing_colon(layout: Layout, index: int) -> Slip:
    """A line that should begin with a key, and has no colon behind it."""
    line = layout.text[index : layout.start(index) + len(layout.line(index))].rstrip()
    word = re.match(r"[\w-]+", line)
    if word is None and line[:1] in CLOSES:
        return missing_dash(index)
    if word is None:
        return Slip("a key and a colon are missing", index, index + len(line), "write `key: value`")
    rest = line[word.end() :]
    value = rest.lstrip(" :" + STRANGE_COLONS)
    help = f"write `{word[0]}: {value}`" if value else f"write `{word[0]}:`"
    if rest.startswith(":") and rest.strip(" :"):
        end = index + word.end() + 1
        return Slip(f"a blank is missing behind `{word[0]}:`", index, end, help)
    return Slip(f"a colon is missing behind `{word[0]}`", index, index + word.end(), help)


def missing_dash(index: int) -> Slip:
    """A list or mapping of its own where one has ended."""
    return Slip("the value above has ended, and here another begins", index, index + 1, "a list item begins with `- `")


def second_colon(layout: Layout, at: int) -> Slip:
    """A colon where no key can be: in the middle of a text, or of a key whose line is not one of the block's."""
    head = layout.text[layout.start(at) : at]
    key = re.fullmatch(r"[ ]*(?:- +)*([\w-]+)[ ]*", head)
    above = layout.above(at)
    before = None if above is None else BLOCK_KEY.match(layout.line(above)[:LONGEST_KEY])
    if above is not None and before is not None and not before[2] and (key or WORD.match(before[1])):
        return missing_colon(layout, layout.start(above) + before.start(1))
    if key is None or above is None:
        return Slip("a text with `: ` in it stands here without quotes", at, at + 1, "put the text in quotes")
    start = layout.start(at) + key.start(1)
    column = before.start(1) if before else layout.indent(above)
    return lined_up(start, layout.start(at) + key.end(1), "key", [column + 1], key.start(1) + 1)


def out_of_line(layout: Layout, read: Sequence[Any], at: int) -> Slip | None:
    """The first thing of a line, in a column where nothing of the blocks above begins."""
    if not layout.begins_line(at):
        return None
    if layout.text[at] in CLOSES:
        return missing_dash(at)
    is_item = layout.text.startswith("- ", at)
    column = at - layout.start(at)
    columns = block_columns(read, layout.start(at), is_item)
    if not columns or column in columns:
        return None
    around = [
        max((c for c in columns if c < column), default=None),
        min((c for c in columns if c > column), default=None),
    ]
    end = at + 1 if is_item else at + len(first_key(layout, at))
    return lined_up(at, end, "list item" if is_item else "key", [c + 1 for c in around if c is not None], column + 1)


def first_key(layout: Layout, at: int) -> str:
    """The word that begins at a place; at least its one character."""
    match = re.match(r"[\w-]+|.", layout.text[at:])
    return match[0] if match else " "


def lined_up(start: int, end: int, what: str, columns: Sequence[int], column: int) -> Slip:
    """Something whose indentation is of none of the blocks that it may belong to."""
    where = " or ".join(str(each) for each in columns)
    help = f"the {what}s above it begin in column {where}, this in {column}: line them up"
    return Slip(f"this {what} does not line up with those above it", start, end, help)


def block_columns(read: Sequence[Any], line: int, is_item: bool) -> list[int]:
    """The columns, from 0, of the lists or of the mappings that are open above a line."""
    opened: list[tuple[bool, int]] = []
    for each in read:
        if each.start_mark.index >= line:
            break
        if isinstance(each, (token.BlockSequenceStartToken, token.BlockMappingStartToken)):
            opened.append((isinstance(each, token.BlockSequenceStartToken), each.start_mark.column))
        elif isinstance(each, token.BlockEndToken):
            opened.pop()
    return sorted(column for is_list, column in opened if is_list == is_item)


def rest_of_line(layout: Layout, read: Sequence[Any], at: int) -> Slip | None:
    """Something behind a value that has ended: a text that begins with a quote or a bracket ends with it."""
    before = next((each for each in reversed(read) if each.end_mark.index <= at and isinstance(each, ENDS_VALUE)), None)
    if before is None or layout.start(at) > before.end_mark.index:
        return None
    sign = layout.text[before.end_mark.index - 1]
    if sign not in "\"']}":
        return None
    rest = layout.line(at)[at - layout.start(at) :]
    help = "put all of it in quotes of the other kind" if sign in "\"'" else "put all of it in quotes"
    return Slip(f"the value ends at `{sign}`, and more stands behind it", at, at + max(1, len(rest)), help)
