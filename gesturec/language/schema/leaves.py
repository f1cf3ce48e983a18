"""The forms of values that the language has, each with the JSON Schema that editors check it by."""

from __future__ import annotations

from typing import Annotated, Any, Final, TypeAlias

from gesturec.language.document import Mapping, Node, Sequence, Text
from gesturec.language.schema import leaf as form
from gesturec.language.schema.leaf import Json, Leaf

NUMBER_JSON: Final[Json] = {"type": ["number", "string"]}
KEY_JSON: Final[Json] = {"type": "string", "pattern": r"^[A-Za-z_][A-Za-z0-9_]*$"}
PATH_KEY_JSON: Final[Json] = {"type": "string", "pattern": r"^[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*$"}
NAME_JSON: Final[Json] = {"type": "string", "pattern": r"^\$?[A-Za-z_][A-Za-z0-9_]*$"}
PATH_JSON: Final[Json] = {"type": "string", "pattern": r"^\$?[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*$"}
PARAMETER_JSON: Final[Json] = {"type": "string", "pattern": r"^\$[A-Za-z_][A-Za-z0-9_]*$"}
INTERVAL_JSON: Final[Json] = {"type": "string", "pattern": r"\.\.|^\$"}
SCALAR_JSON: Final[Json] = {"type": ["string", "number", "boolean"]}


def any_of(*schemas: Json) -> Json:
    """A value that fits one of several schemas."""
    return {"anyOf": list(schemas)}


def list_of(item: Json, **more: Any) -> Json:
    """A list with items of one schema."""
    return {"type": "array", "items": item, **more}


def map_of(value: Json, keys: Json | None = None) -> Json:
    """A mapping with the author's names as keys."""
    return {"type": "object", "additionalProperties": value, **({"propertyNames": keys} if keys else {})}


def words(*allowed: str, passes: bool = True) -> Leaf:
    """One of a few words."""
    word: Json = {"type": "string", "enum": list(allowed)}
    json = any_of(word, PARAMETER_JSON) if passes else word
    return Leaf("one of " + ", ".join(allowed), form.word_of(*allowed), json, passes)


VECTOR_JSON: Final = any_of({"type": "string"}, list_of(NUMBER_JSON, minItems=3, maxItems=3))
LEVELS_JSON: Final = any_of(list_of(NUMBER_JSON, minItems=1), map_of(NUMBER_JSON, NAME_JSON), PARAMETER_JSON)
MEMBERS_JSON: Final = any_of(list_of(PATH_JSON, uniqueItems=True), PARAMETER_JSON)
NAMES_JSON: Final = any_of(list_of(PATH_JSON), PARAMETER_JSON)
REST_JSON: Final = any_of(
    {
        "type": "object",
        "properties": {
            "x": VECTOR_JSON,
            "y": VECTOR_JSON,
            "z": VECTOR_JSON,
            "turns": list_of(list_of({"type": ["string", "number"]}, minItems=2, maxItems=2)),
            "quaternion": list_of(NUMBER_JSON, minItems=4, maxItems=4),
        },
        "additionalProperties": False,
    },
    PARAMETER_JSON,
)
CONFIGURATION_JSON: Final = any_of({"type": ["string", "boolean"]}, map_of(any_of(SCALAR_JSON, map_of(SCALAR_JSON))))
KEYS_JSON: Final = any_of({"type": "string"}, map_of(any_of(map_of(NUMBER_JSON), PARAMETER_JSON)))
# Phases nest, so they have a definition of their own.
PHASES_JSON: Final[Json] = {"$ref": "#/$defs/Phases"}
PHASES_DEFINITION: Final = map_of(any_of(NUMBER_JSON, {"$ref": "#/$defs/Phases"}), NAME_JSON)
DWELL_JSON: Final = any_of(INTERVAL_JSON, map_of(INTERVAL_JSON))
THEIRS_JSON: Final = any_of(
    {"type": ["string", "number"]}, list_of({"type": ["string", "number"]}), map_of(NUMBER_JSON)
)
BOUND_JSON: Final = any_of(NAMES_JSON, map_of(THEIRS_JSON, PATH_JSON))
COLOR_JSON: Final = any_of({"type": "string"}, list_of(NUMBER_JSON, minItems=3, maxItems=3))

Words: TypeAlias = Annotated[Text | None, Leaf("a text", form.text_of("a text"), {"type": "string"}, passes=False)]
Way: TypeAlias = Annotated[
    Text | None, Leaf("poses joined by `->`", form.text_of("poses joined by `->`"), {"type": "string"}, passes=False)
]
Number: TypeAlias = Annotated[Text | None, Leaf("a number", form.text_of("a number"), NUMBER_JSON)]
Vector: TypeAlias = Annotated[Text | Sequence | None, Leaf("a vector", form.is_vector, VECTOR_JSON)]
Axis: TypeAlias = Annotated[Text | Sequence | None, Leaf("an axis", form.is_vector, VECTOR_JSON)]
Rest: TypeAlias = Annotated[Text | Mapping | None, Leaf("a rest", form.is_rest, REST_JSON)]
Interval: TypeAlias = Annotated[Text | None, Leaf("an interval", form.text_of("an interval `lo .. hi`"), INTERVAL_JSON)]
Levels: TypeAlias = Annotated[Text | Sequence | Mapping | None, Leaf("levels", form.is_levels, LEVELS_JSON)]
Truth: TypeAlias = Annotated[
    Text | None, Leaf("a truth", form.word_of("true", "false"), any_of({"type": "boolean"}, PARAMETER_JSON))
]
Name: TypeAlias = Annotated[Text | None, Leaf("a name", form.is_name, NAME_JSON, passes=False)]
Path: TypeAlias = Annotated[Text | None, Leaf("a name", form.is_path, PATH_JSON)]
Names: TypeAlias = Annotated[Text | Sequence | None, Leaf("a list of names", form.is_names, NAMES_JSON)]
Sides: TypeAlias = Annotated[
    Sequence | None, Leaf("two names", form.is_names, list_of(PATH_JSON, minItems=2, maxItems=2), passes=False)
]
Members: TypeAlias = Annotated[Text | Sequence | None, Leaf("a list of names", form.is_members, MEMBERS_JSON)]
Expression: TypeAlias = Annotated[
    Text | None, Leaf("an expression", form.text_of("an expression"), {"type": ["string", "number", "boolean"]})
]
Pattern: TypeAlias = Annotated[Text | None, Leaf("a gesture pattern", form.text_of("a gesture pattern"))]
Arcs: TypeAlias = Annotated[
    Sequence | None,
    Leaf(
        "a list of arcs",
        lambda n, f: form.texts_in(n, "a list of arcs", f),
        list_of({"type": "string", "pattern": "->"}),
    ),
]
Color: TypeAlias = Annotated[Text | Sequence | None, Leaf("a color", form.is_color, COLOR_JSON)]
Configuration: TypeAlias = Annotated[
    Text | Mapping | None, Leaf("a configuration map", form.is_configuration, CONFIGURATION_JSON)
]
Keys: TypeAlias = Annotated[Text | Mapping | None, Leaf("keys", form.is_keys, KEYS_JSON)]
Phases: TypeAlias = Annotated[Mapping | None, Leaf("phases", form.is_phases, PHASES_JSON, passes=False)]
DwellTimes: TypeAlias = Annotated[Text | Mapping | None, Leaf("a dwell time", form.is_dwell, DWELL_JSON)]
BoundTokens: TypeAlias = Annotated[
    Sequence | Mapping | None, Leaf("tokens", form.is_bound_tokens, BOUND_JSON, passes=False)
]
TheirNames: TypeAlias = Annotated[
    Sequence | None,
    Leaf("a list of names", lambda n, f: form.texts_in(n, "a list of names", f), list_of(SCALAR_JSON), passes=False),
]
Arguments: TypeAlias = Annotated[
    Sequence | Mapping | None,
    Leaf(
        "arguments",
        form.is_arguments,
        any_of(list_of(NAME_JSON), {"type": "object", "propertyNames": NAME_JSON}),
        passes=False,
    ),
]
Files: TypeAlias = Annotated[
    Node | None, Leaf("a list of files", form.is_anything, list_of({"type": "string"}), passes=False)
]
Anything: TypeAlias = Annotated[Node | None, Leaf("a value", form.is_anything, {}, passes=True)]
Version: TypeAlias = Annotated[Text | None, Leaf("a version", form.text_of("a version"), {"const": 1}, passes=False)]
LengthUnit: TypeAlias = Annotated[Text | None, words("um", "mm", "cm", "m", "in", passes=False)]
AngleUnit: TypeAlias = Annotated[Text | None, words("deg", "rad", "rev", passes=False)]
Plane: TypeAlias = Annotated[Text | None, words("x", "y", "z", passes=False)]
Direction: TypeAlias = Annotated[Text | None, words("x", "y", "z", "-x", "-y", "-z", passes=False)]
JointType: TypeAlias = Annotated[Text | None, words("hinge", "slide")]
Step: TypeAlias = Annotated[Text | None, words("adjacent", "single", "any")]
