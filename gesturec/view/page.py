"""One self-contained HTML page of a decoded take: compiled model and decoding in, text out.

No request leaves the page: style, script and data are inside it, and its policy (Content-Security-Policy) forbids all
else, so that names out of a hostile file can at most be read. Names reach the page as JSON with `<` escaped
and are written as text alone. The parts of the script are files of `assets/`, joined in the order of `SCRIPTS`.
"""

from __future__ import annotations

import base64
import hashlib
import json
from importlib.resources import files
from typing import TYPE_CHECKING, Any, Final

from gesturec.view.payload import page_payload

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact
    from gesturec.runtime.step import Decoding

SCRIPTS: Final = ("page.js", "space.js", "paint.js", "scene.js", "graph.js", "ribbon.js", "why.js")


def render_page(artifact: Artifact, decoding: Decoding, title: str, up: str | None = None) -> str:
    """The page of a take.

    Parameters
    ----------
    artifact, decoding
        The model, and what was decoded with it.
    title
        What the page is called; usually the recording's name.
    up
        The world's upward axis (`y`, `-z`); None is what the decoding knew of it, and a guess where that is nothing.
    """
    style, script = _asset("page.css"), _script()
    page = _asset("page.html")
    parts = {
        "policy": _policy(style, script),
        "style": style,
        "script": script,
        "data": script_json(page_payload(artifact, decoding, title, up)),
    }
    head, *rest = page.split("{{")
    return head + "".join(parts[name] + text for name, text in (piece.split("}}", 1) for piece in rest))


def script_json(value: Any) -> str:
    """JSON that nothing inside a script element can end: no `<`, `>`, `&`, no NaN, plain ASCII."""
    text = json.dumps(value, allow_nan=False, ensure_ascii=True, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _asset(name: str) -> str:
    return files("gesturec.view").joinpath("assets", name).read_text(encoding="utf-8")


def _script() -> str:
    parts = "\n".join(_asset(name) for name in SCRIPTS)
    return f'(() => {{\n"use strict";\n{parts}\nstart();\n}})();'


def _policy(style: str, script: str) -> str:
    """Nothing but this very style and script, by their digests."""
    return (
        f"default-src 'none'; style-src '{_digest(style)}'; script-src '{_digest(script)}'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode("utf-8")).digest()).decode("ascii")
