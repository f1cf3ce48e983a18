"""Every rule that a finding may carry, declared once: id, severity, one line.

`gesturec explain RULE` prints the page `pages/<rule>.md`; the tests run every page's examples. Ids name the
fault, never the fix, and never change.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from gesturec.diagnostics.diagnostic import Severity


class Rule(NamedTuple):
    """One rule: what `error[id]` means."""

    id: str
    severity: Severity
    summary: str


ERRORS: Final = (
    # the text of a file
    ("unreadable-file", "a file cannot be opened or read"),
    ("bad-encoding", "a file is not UTF-8 text"),
    ("bad-yaml", "the text is not YAML"),
    ("limit-exceeded", "something is larger than its limit"),
    ("yaml-tag", "a value carries a YAML tag"),
    ("merge-key", "a mapping uses YAML's merge key `<<`"),
    ("duplicate-key", "a mapping has the same key twice"),
    ("null-value", "a value is null or left empty"),
    # what the keys and values of the language are
    ("unknown-key", "a key is not one of the language here"),
    ("missing-key", "a required key is missing"),
    ("wrong-kind", "a value is of another kind than its key takes"),
    ("conflicting-keys", "two keys stand together that exclude each other"),
    ("bad-number", "a text is not a number, quantity or constant expression"),
    ("bad-name", "a text is not a name"),
    ("reserved-name", "a name is a word of the language"),
    ("bad-interval", "a text is not an interval `lo .. hi`"),
    ("bad-choice", "a word is not one of the few allowed"),
    ("bad-color", "a color is neither a CSS name nor `[r, g, b]`"),
    ("bad-arc", "an arc is not `a -> b` or `a <-> b`"),
    ("newer-version", "the file is written for a newer gesturec"),
    # expressions and gesture patterns
    ("bad-expression", "a text is not an expression"),
    ("bad-pattern", "a text is not a gesture pattern"),
    ("unknown-function", "an expression calls a function that there is not"),
    ("wrong-arguments", "a function is called with the wrong number of arguments"),
    ("wrong-type", "a truth stands where a number does, or a vector where one number does"),
    ("wrong-unit", "a quantity of one kind stands where another belongs"),
    ("unknown-unit", "a number carries a unit that there is not"),
    ("undefined-value", "a constant expression has no value"),
    ("not-a-truth", "a pattern applies `&`, `not` or `for` to what is not a truth"),
    ("not-constant", "a part of the body is named where only a constant can stand"),
    ("misplaced-name", "a name is used where what it speaks of is not known"),
    # names
    ("unknown-name", "an expression uses a name that is not seen there"),
    ("unknown-joint", "a name is not a joint of its limb"),
    ("unknown-limb", "a name is not a limb"),
    ("unknown-group", "a name is not a limb, a group or a part"),
    ("unknown-token", "a name is not a token"),
    ("unknown-template", "a name is not a template"),
    ("unknown-parameter", "`$name` is neither an argument nor a parameter"),
    ("unknown-pose", "a name is not a pose"),
    ("unknown-state", "a name is not a state or phase of its machine"),
    ("unknown-gesture", "a name is not a gesture"),
    ("unknown-machine", "a name is not a machine"),
    ("unknown-level", "a value or name is not a level of its joint"),
    ("unknown-setting", "`--set` or a profile names no parameter"),
    ("bad-setting", "`--set` or a profile gives a parameter a value that it cannot take"),
    ("other-model", "a profile was made for another model"),
    ("duplicate-name", "one name is given to two things"),
    ("shadowed-name", "a name would mean two things in one place"),
    ("circular-reference", "things are defined by each other in a circle"),
    ("circular-include", "files include each other in a circle"),
    # bodies
    ("unknown-argument", "a limb gives an argument that its template has not"),
    ("missing-argument", "a limb leaves out an argument of its template"),
    ("bad-axis", "an axis is no direction"),
    ("bad-rest", "a rest is no rotation"),
    ("no-joint", "a joint that another needs moves nothing or is not there"),
    ("levels-not-rising", "levels do not rise"),
    ("too-few-levels", "a list of levels is empty"),
    ("reversed-range", "an interval's end is below its start"),
    ("uneven-range", "`every` does not divide the range"),
    ("level-out-of-range", "a level lies outside the joint's range"),
    ("not-a-full-turn", "`wrap` on a range that is no full turn of a hinge"),
    ("value-out-of-range", "a value lies outside what is allowed"),
    ("keyed-without-values", "a keyed joint has no state, cycle or path that gives it values"),
    ("mixed-units", "bare numbers of files with different units are added"),
    ("empty-group", "a group has no members"),
    ("repeated-member", "a list of members names the same one twice"),
    ("mixed-group", "a group has members of different kinds"),
    # machines, constraints, poses
    ("two-machines", "a limb belongs to two machines"),
    ("parents-differ", "the limbs of one machine hang from different parts"),
    ("no-machine", "a limb without a free joint is given a machine"),
    ("bad-keys", "the keys of a cycle or path are not such a curve"),
    ("bad-phases", "phases do not begin at 0 and rise"),
    ("allow-of-several", "an `allow` names several machines"),
    ("groups-disagree", "two groups say different things of a limb"),
    ("no-value", "a test or pose asks for a state that cannot be"),
    ("constant-constraint", "a constraint names no joint, state or token"),
    # bindings, tests
    ("bad-weights", "the weights of a bound token do not sum to one"),
    ("bad-binding", "a binding's order leaves out a name that it uses"),
    # what expansion and analysis find
    ("unsatisfiable", "constraints leave a machine without a state"),
    ("division-by-zero", "an expression divides by zero in a state"),
    ("too-many-states", "a machine has more states than the limit"),
)

WARNINGS: Final = (
    ("unused-name", "something is defined and never used"),
    ("replaced-entry", "an entry of a group is replaced by its limbs' own entries"),
    ("radians-suspected", "an angle looks like radians in a file of degrees"),
    ("beyond-a-turn", "the angles of a hinge go beyond a full turn"),
    ("time-suspected", "a bare time looks like milliseconds, and is in seconds"),
    ("ignored-key", "a key says nothing of what it stands on"),
    ("empty-value", "a mapping or list has nothing in it"),
    ("equal-limits", "an interval's two ends are the same"),
    ("never-measured", "a binding or a test names a virtual token"),
    ("few-root-tokens", "the root has fewer than three tokens, or all in one line, so that its frame cannot be fitted"),
    ("no-visible-token", "a machine moves no token that can be measured"),
    ("dead-end", "a state has no way out"),
    ("unreachable", "a state cannot be reached"),
    ("impossible-state", "relations across machines make a state impossible"),
    ("idle-constraint", "a constraint removes nothing"),
    ("equal-states", "two states of a machine put every visible token in the same place"),
    ("never-matches", "a pattern can never be met"),
    ("step-already-true", "a step of a pattern has begun before the step that it shall follow"),
    ("empty-pose", "a pose holds in no state"),
)

RULES: Final = {
    **{id: Rule(id, "error", summary) for id, summary in ERRORS},
    **{id: Rule(id, "warning", summary) for id, summary in WARNINGS},
}


def severity(rule: str) -> Severity:
    """Severity of a rule; KeyError for an id that is not in the table."""
    return RULES[rule].severity


def page(rule: str) -> str:
    """The page that `gesturec explain RULE` prints, Markdown."""
    from importlib.resources import files

    return files("gesturec.diagnostics").joinpath("pages", f"{rule}.md").read_text(encoding="utf-8")
