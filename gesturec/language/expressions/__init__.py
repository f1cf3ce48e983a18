"""Expressions, intervals, tolerances, arcs and gesture patterns: from text to typed trees and programs.

How the other rooms use it (`text` is a `document.Text`)::

    tree = parse_expression(text)                    # parse.py: raises build.ExpressionError(diagnostic)
    typed = check(tree, scope, TRUTH, findings)      # check.py, typed.py: None if anything was wrong
    parts = split(typed)                             # the parts of a top-level `and` / `all(…)`
    used = uses(typed)                               # joints, tokens, machines, poses by full name; motion, steps
    program = lower(typed, ids, mirrored=(2,))       # lowering/programs.py: a lowering.lowered.Program
    needs = dependencies(program.operations)         # the same by id

and where a number, vector or interval stands (constant.py; SI, or None after a finding)::

    number(text, scope, LENGTH, findings)
    vector(text, scope, LENGTH, findings)
    interval(text, scope, kind, findings)            # (low, high), infinite where open
    constant(tree, scope, findings)                  # Quantity, its kind still open (parameters)
    number_of, interval_of, tolerance_of             # the same of trees, as parse_wanted gives them

Parsers: `parse_expression`, `parse_interval`, `parse_wanted` (a joint's value in a configuration map: an
expression, `90 +- 30`, or an interval), `parse_arc`, `parse_gesture`; all take a `Text`, all raise
`ExpressionError`. `print_tree` is their inverse. Patterns are scoped and typed by `gestures.check_gesture`.

Nothing here imports lark but `grammar.py`, which writes the tables of the parser.
"""
