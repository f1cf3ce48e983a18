"""The language reference, generated from what the compiler itself reads: schema, functions, units, grammar, rules."""

from gesturec.reference.page import reference_page

__all__ = ["reference_page"]
