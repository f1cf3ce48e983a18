"""Expressions, intervals, tolerances, arcs and gesture patterns: from text to typed trees and programs.

How the other rooms use it::

    text = text_of(node.text, node.span)             # place.py: finds each character in the file, quoted or not
    tree = parse_expression(text)                    # parse.py: raises ExpressionError(diagnostic)
    typed = check(tree, scope, TRUTH, findings)      # check.py: appends to findings; None if anything was wrong
    program = lower(typed, ids, mirrored=(2,))       # lower.py: a lowering.lowered.Program
    parts = split(typed)                             # the parts of a top-level `and` / `all(…)`
    used = uses(typed)                               # joints, tokens, machines, poses by full name; motion, steps

and where a number or a vector stands::

    number(text, scope, LENGTH, findings)            # constant.py: float in SI, or None
    vector(text, scope, LENGTH, findings)            # "[a, b, c]" or `$name`
    interval(text, scope, kind, findings)            # (low, high) in SI, infinite where open
    constant(tree, scope, findings)                  # Quantity, kind not yet fixed (parameters)

Parsers: `parse_expression`, `parse_interval`, `parse_wanted` (a joint's value in a configuration map: an
expression, `90 +- 30`, or an interval), `parse_arc`, `parse_gesture`; all take a `Text`, all raise
`ExpressionError`. `print_tree` is their inverse. Patterns are scoped and typed by `gestures.check_gesture`.

Nothing here imports lark until the first text is parsed.
"""
