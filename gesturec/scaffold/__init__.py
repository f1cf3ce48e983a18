"""Starting points for an author: a model's text from a template, a robot (URDF, MJCF) or a skeleton (BVH).

`new_model` makes the text; `urdf`, `mjcf`, `bvh` read files of strangers into one form (`tree`), `limbs` cuts it into
the language's limbs, `text` writes them.
"""

from gesturec.scaffold.new import TEMPLATES, new_model

__all__ = ["TEMPLATES", "new_model"]
