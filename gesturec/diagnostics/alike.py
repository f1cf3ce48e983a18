"""One finding for limbs that are alike: what is said of a limb, of its mirror image and of its template's other limbs.

In: findings, and the names of limbs and machines. Out: the findings, with those that differ in nothing but the limb
told as one that names all of them; where their places differ too, the others' are notes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from gesturec.diagnostics.diagnostic import Diagnostic, Related

TOLD: Final = 8  # names that a finding lists


def listed(names: Sequence[str]) -> str:
    """Names in backticks, with how many more there are."""
    more = f" and {len(names) - TOLD:,} more" if len(names) > TOLD else ""
    return ", ".join(f"`{name}`" for name in names[:TOLD]) + more


def told_once(findings: Iterable[Diagnostic], limbs: Iterable[str]) -> tuple[Diagnostic, ...]:
    """The findings in their order, alike ones at the place of the first."""
    known = sorted(limbs, key=len, reverse=True)
    groups: dict[object, list[tuple[str | None, Diagnostic]]] = {}
    for number, finding in enumerate(findings):
        limb = next((name for name in known if is_about(finding, name)), None)
        key = number if limb is None else without_limb(finding, limb)
        groups.setdefault(key, []).append((limb, finding))
    return tuple(merged(group) for group in groups.values())


def is_about(finding: Diagnostic, limb: str) -> bool:
    """Whether a finding names a limb, or something of it."""
    return f"`{limb}`" in finding.message or f"`{limb}." in finding.message


def without_limb(finding: Diagnostic, limb: str) -> object:
    """What a finding says, whichever limb it is of."""
    related = tuple((own_words(each.message, limb), each.span) for each in finding.related)
    texts = (finding.message, finding.label, finding.help or "")
    is_of_limb = finding.span is None or f"`{limb}`" in finding.message
    return finding.rule, tuple(own_words(text, limb) for text in texts), related, is_of_limb or finding.span


def own_words(text: str, limb: str) -> str:
    """A text with what is in a limb by its own names."""
    return text.replace(f"`{limb}.", "`").replace(f" {limb}.", " ").replace(f"`{limb}`", "``")


def merged(group: Sequence[tuple[str | None, Diagnostic]]) -> Diagnostic:
    """One finding of several that are alike."""
    (limb, first), *others = group
    if limb is None or not others:
        return first
    names = listed([str(name) for name, _ in group])
    text = own_words(first.message, limb).replace("machine `` is", f"machines {names} are each")
    text = text.replace("machine `` cannot", f"machines {names} each cannot").replace("machine ``", f"machines {names}")
    message = text if names in text else f"{text}, in limbs {names} each"
    related = tuple(each._replace(message=own_words(each.message, limb)) for each in first.related)
    places = dict.fromkeys((name, finding.span) for name, finding in others if finding.span != first.span)
    notes = tuple(Related(f"so is `{name}`", span, note=True) for name, span in places if span is not None)
    help = None if first.help is None else own_words(first.help, limb)
    return Diagnostic(first.rule, message, first.span, own_words(first.label, limb), help, (*related, *notes[:TOLD]))
