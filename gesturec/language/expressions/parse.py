"""Text to syntax tree: the LALR parser over `grammar.lark`, loaded when the first text needs it.

In: a scalar of the document. Out: a tree, or `ExpressionError` with one located finding. Length, brackets
and depth are bounded before anything recursive sees the tree, so no text can exhaust the stack. A plain
number, which most scalars are, does not need the parser at all.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

from gesturec.diagnostics.diagnostic import Diagnostic, Related
from gesturec.diagnostics.source import Span
from gesturec.diagnostics.suggest import nearest
from gesturec.language.document import Text
from gesturec.language.expressions import tree
from gesturec.language.expressions.place import Place, place_of
from gesturec.language.schema.leaf import strange

if TYPE_CHECKING:
    from gesturec.language.expressions.lalr import Token

# An expression beyond these is no author's; the checker recurses up to five calls a level.
MOST_CHARACTERS: Final = 10_000
MOST_BRACKETS: Final = 60
MOST_DEPTH: Final = 120

WHAT: Final = {
    "expr": ("bad-expression", "an expression"),
    "interval": ("bad-interval", "an interval `lo .. hi`"),
    "wanted": ("bad-expression", "a value, an interval or `value +- tolerance`"),
    "arc": ("bad-arc", "an arc `a -> b` or `a <-> b`"),
    "pattern": ("bad-pattern", "a gesture pattern"),
}
NUMBER_ALONE: Final = re.compile(r"(-?)((?:0|[1-9][0-9]{0,14})(?:\.[0-9]{1,15})?)(?: ?(%|[a-zA-Z]+(?:/[a-z]+)?))?")
KEYWORDS: Final = frozenset(("if", "else", "or", "and", "not", "for", "in", "within", "true", "false"))
# Words that stand between others, in expressions and in patterns: what a name there may be a slip of.
WORDS_BETWEEN: Final = (("and", "or", "if", "else", "for", "in"), ("for", "within"))
CHOICE: Final = "x if test else y"
# What other languages and keyboards write.
MEANT_SIGNS: Final = {
    "\N{MINUS SIGN}": "-",
    "\N{EN DASH}": "-",
    "\N{MULTIPLICATION SIGN}": "*",
    "\N{DIVISION SIGN}": "/",
    "\N{LESS-THAN OR EQUAL TO}": "<=",
    "\N{GREATER-THAN OR EQUAL TO}": ">=",
    "\N{NOT EQUAL TO}": "!=",
    "\N{HORIZONTAL ELLIPSIS}": "..",
    "...": "..",
}
MEANT: Final = {
    **MEANT_SIGNS,
    "=": "==",
    "= =": "==",
    "===": "==",
    ":=": "==",
    "is": "==",
    "equals": "==",
    "=>": ">=",
    "> =": ">=",
    "=<": "<=",
    "< =": "<=",
    "!==": "!=",
    "! =": "!=",
    "=!": "!=",
    "<>": "!=",
    "< >": "!=",
    "is not": "!=",
    "xor": "!=",
    "&&": "and",
    "||": "or",
    "!": "not",
    "~": "not",
    "^": "**",
    "//": "/",
    "&": "and",
    "|": "or",
    "{": "(",
    "}": ")",
    "?": CHOICE,
    "if": CHOICE,
    "of": "in",
}
MEANT_IN_INTERVAL: Final = {
    **MEANT_SIGNS,
    "\N{PLUS-MINUS SIGN}": "+-",
    "+/-": "+-",
}
# In an arc.
MEANT_IN_ARC: Final = {"=>": "->", "<=>": "<->", "-->": "->", "- >": "->", "--": "<->"}
# In a pattern.
MEANT_IN_PATTERN: Final = {
    "=>": "->",
    "- >": "->",
    "-->": "->",
    "<-": "->",
    "<->": "->",
    "\N{RIGHTWARDS ARROW}": "->",
    "then": "->",
    "in": "within",
    "&&": "&",
    "||": "|",
    "!": "not",
    "~": "not",
    "+": "{1..}",
    "and": "&",
    "or": "|",
}
MEANT_IN: Final = {
    "pattern": MEANT_IN_PATTERN,
    "arc": MEANT_IN_ARC,
    "interval": MEANT_IN_INTERVAL,
    "wanted": MEANT_IN_INTERVAL,
}
COMPARISONS: Final = frozenset(("<", "<=", "=", "=<", "==", "!=", ">=", ">"))
# What is read as one sign where it stands: signs of this language and of others, the longer first, else a word.
SIGNS: Final = re.compile(
    r"<=>|<->|===|!==|\.\.\.|\+/-|-->|->>?|<-|--|-\s+>|&&|\|\||//|\*\*|=<|=>|=!|<>|:=|[=!<>]=|=\s+=|[<>!]\s+=|<\s+>"
    r"|is\s+not\b|\.\.|\+-|\w+|\S"
)
QUOTES: Final = "'\"\N{LEFT DOUBLE QUOTATION MARK}\N{RIGHT DOUBLE QUOTATION MARK}\N{LEFT SINGLE QUOTATION MARK}"
QUANTITY: Final = r"[0-9]+(?:\.[0-9]+)?(?: ?(?!to\b)[a-z%]+(?:/[a-z]+)?)?"
LONGEST_ENDS: Final = 60
TWO_ENDS: Final = re.compile(rf"\W*?(-?{QUANTITY})\s*(?:\W+|to)\s*({QUANTITY})\W*")
ONE_END: Final = re.compile(rf"([<>])=?\s*(-?{QUANTITY})")

DECIMAL_COMMA: Final = re.compile(r"(?<=[0-9]),(?=[0-9])")


class ExpressionError(Exception):
    """A text that is not what it should be; `diagnostic` says where and why."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        self.diagnostic = diagnostic
        super().__init__(diagnostic.message)


def parse_expression(text: Text) -> tree.Expr:
    """The tree of an expression."""
    return _number_alone(text) or _parse(text, "expr")


def parse_interval(text: Text) -> tree.Interval:
    """The tree of `lo .. hi`, `lo ..` or `.. hi`."""
    return _parse(text, "interval")  # type: ignore[no-any-return]


def parse_wanted(text: Text) -> tree.Expr | tree.Interval | tree.Tolerance:
    """The tree of what a configuration map or a state wants: an expression, an interval, or `90 +- 30`."""
    return _number_alone(text) or _parse(text, "wanted")


def parse_arc(text: Text) -> tree.Arc:
    """The tree of `a -> b` or `a <-> b`."""
    return _parse(text, "arc")  # type: ignore[no-any-return]


def parse_gesture(text: Text) -> tree.Pattern:
    """The tree of a gesture's pattern."""
    return _parse(text, "pattern")  # type: ignore[no-any-return]


def _number_alone(text: Text) -> tree.Expr | None:
    """The tree of a plain number with or without a unit; None if the text is anything else."""
    found = NUMBER_ALONE.fullmatch(text)
    if found is None or found[3] in KEYWORDS - {"in"}:
        return None
    place = place_of(text)
    unit_span = place.part(*found.span(3)) if found[3] else None
    number = tree.Number(float(found[2]), found[3], place.part(found.start(2), found.end()), unit_span)
    return tree.Unary("-", number, place.part(0, found.end())) if found[1] else number


def _parse(text: Text, start: str) -> Any:
    from gesturec.language.expressions.build import Builder
    from gesturec.language.expressions.lalr import WrongCharacter, WrongToken, parse

    place = place_of(text)
    if (finding := _too_large(place, start)) is not None:
        raise ExpressionError(finding)
    try:
        node: Any = parse(place.text, start, Builder(place))
    except WrongCharacter as error:
        raise ExpressionError(_odd_character(place, start, error.at)) from None
    except WrongToken as error:
        raise ExpressionError(_odd_token(place, start, error.token, error.expected)) from None
    if (levels := tree.depth(node)) > MOST_DEPTH:
        message = f"the expression is nested {levels} deep; the limit is {MOST_DEPTH}"
        raise ExpressionError(
            Diagnostic("limit-exceeded", message, text.span, help="split it, for instance into poses")
        )
    return node


def _too_large(place: Place, start: str) -> Diagnostic | None:
    """A finding for a text that is too long or has too many brackets in each other."""
    what = WHAT[start][1]
    if not place.text.strip():
        return Diagnostic(WHAT[start][0], f"{what} is expected here, and the text is empty", place.span)
    if len(place.text) > MOST_CHARACTERS:
        message = f"the text of {what} has {len(place.text):,} characters; the limit is {MOST_CHARACTERS:,}"
        return Diagnostic("limit-exceeded", message, place.part(0, 40), help="split it, for instance into poses")
    level = 0
    for at, char in enumerate(place.text):
        level += (char in "([") - (char in ")]")
        if level > MOST_BRACKETS:
            message = f"brackets are nested more than {MOST_BRACKETS} deep"
            return Diagnostic("limit-exceeded", message, place.part(at, at + 1), "this is one too many")
    return None


def _odd_character(place: Place, start: str, at: int) -> Diagnostic:
    """A finding for a character that no token begins with here."""
    rule, what = WHAT[start]
    word, at = _sign_at(place.text, at)
    span, help = place.part(at, at + len(word)), _meant(word, start) or _ends(place.text, start)
    if help is None and word not in QUOTES and not word.isascii():
        help = strange(word)
    if word in QUOTES:
        help = "names and units stand without quotes"
    elif word in KEYWORDS:
        return Diagnostic(rule, f"`{word}` is a word of the language and stands where it cannot", span, help=help)
    return Diagnostic(rule, f"`{word}` does not belong in {what}", span, help=help)


def _sign_at(text: str, at: int) -> tuple[str, int]:
    """The sign or word that a character is of, and where it begins: `=<` at its `<` too."""
    found = next((sign for sign in SIGNS.finditer(text) if sign.start() <= at < sign.end()), None)
    return (found[0], found.start()) if found is not None else (text[at : at + 1], at)


def _ends(text: str, start: str) -> str | None:
    """The help for an interval in another notation: `0 to 90`, `[0, 90]`, `< 90`."""
    if start not in ("interval", "wanted") or len(text) > LONGEST_ENDS:
        return None
    if start == "interval" and (two := TWO_ENDS.fullmatch(text)) is not None:
        return f"write `{two[1]} .. {two[2]}`"
    one = ONE_END.fullmatch(text)
    if one is None:
        return None
    return f"write `.. {one[2]}`" if one[1] == "<" else f"write `{one[2]} ..`"


def _meant(word: str, start: str) -> str | None:
    """The help for what other languages write."""
    word = re.sub(r"\s+", " ", word)
    if start == "pattern" and word in COMPARISONS:
        return "a comparison stands in brackets, as in `[index.mcp >= 60]`"
    meant = MEANT_IN.get(start, MEANT).get(word)
    return f"write `{meant}`" if meant else None


def _odd_token(place: Place, start: str, token: Token, expected: set[str]) -> Diagnostic:
    """A finding for a token that cannot stand where it does, or for a text that ends too early."""
    rule, what = WHAT[start]
    wanted = (
        "a value"
        if "NAME" in expected and "NUMBER" in expected
        else "a name"
        if "NAME" in expected
        else "an operator or the end"
    )
    if token.type == "$END":
        return _early_end(place, rule, what, wanted, expected)
    word, at = str(token), token.start_pos
    sign, begins = _sign_at(place.text, at)
    if (help := _meant(sign, start) or _ends(place.text, start)) is not None:
        word, at = sign, begins
    if word == "," and DECIMAL_COMMA.match(place.text, at):
        help = f"a decimal point is a point: `{DECIMAL_COMMA.sub('.', place.text)}`"
    if word == "+-" and start != "wanted":
        help = "`+-` is a tolerance; put a space into `+ -`"
    if wanted == "an operator or the end" and token.type in ("NAME", "NUMBER"):
        wanted = "an operator before it"
    if help is None and (before := _word_in_capitals(place.text[:at])) is not None:
        help = f"words of the language are written small: `{before}`"
    if help is None and token.type == "NUMBER" and wanted == "an operator before it":
        help = "values of a list have commas between them" if start == "expr" else None
    near = None if help else nearest(word, WORDS_BETWEEN[start == "pattern"]) if word.isidentifier() else None
    if near is not None and near != word:
        help = f"did you mean `{near}`?"
    return Diagnostic(
        rule, f"`{word}` is not expected here in {what}", place.part(at, at + len(word)), f"{wanted} is expected", help
    )


def _word_in_capitals(before: str) -> str | None:
    """The keyword that a text ends with in capitals, written small."""
    found = re.search(r"([A-Za-z]+)\s*\Z", before)
    is_keyword = found is not None and found[1].lower() in KEYWORDS and not found[1].islower()
    return found[1].lower() if found is not None and is_keyword else None


def _early_end(place: Place, rule: str, what: str, wanted: str, expected: set[str]) -> Diagnostic:
    """A finding for a text that ends before it is complete, with the bracket that is still open."""
    end = len(place.text.rstrip())
    last = re.search(r"(?:[\w$]+|<->|->>?|\.\.|\*\*|[<>=!]=|.)\Z", place.text[:end], re.DOTALL)
    span = place.part(last.start() if last else 0, end)
    related: tuple[Related, ...] = ()
    if (opened := _open_bracket(place)) is not None and expected & {"RPAR", "RSQB"}:
        related = (Related("this bracket is not closed", opened),)
        wanted = "`)`" if "RPAR" in expected else "`]`"
    elif expected == {"RANGE"} or ("RANGE" in expected and rule == "bad-interval"):
        wanted = "`..`"
    help = _ends(place.text, "interval" if rule == "bad-interval" else "")
    if help is None and rule == "bad-interval" and re.fullmatch(QUANTITY, place.text) is not None:
        help = f"write `{place.text} ..`, `.. {place.text}` or both ends"
    return Diagnostic(rule, f"{what} ends too early here", span, f"{wanted} is expected after this", help, related)


def _open_bracket(place: Place) -> Span | None:
    """The last bracket that is not closed."""
    opened: list[int] = []
    for at, char in enumerate(place.text):
        if char in "([":
            opened.append(at)
        elif char in ")]" and opened:
            opened.pop()
    return place.part(opened[-1], opened[-1] + 1) if opened else None
