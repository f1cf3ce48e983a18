"""From the lowered model to tables: states, token positions with their moments, transitions, relations, poses.

`expand.expand_model` reads as the stage's table of contents. Nothing here knows the language's text; spans
are carried only to point at the author's line when something cannot be expanded.
"""
