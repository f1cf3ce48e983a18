"""The models that come with the package: a name in, the path of its YAML file out.

In a built package they are in `gesturec/models`; in a checkout, or an editable install of one, `models/` at the top
is the one source (see `setup.py`).
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Final

_PACKAGE: Final = Path(__file__).parent
_FOLDERS: Final = (_PACKAGE / "models", _PACKAGE.parent / "models")


@cache
def shipped_models() -> MappingProxyType[str, Path]:
    """Path of every shipped model by its name.

    >>> "hand" in shipped_models()
    True
    """
    folder = next((folder for folder in _FOLDERS if folder.is_dir()), None)
    found = {} if folder is None else {path.stem: path for path in sorted(folder.glob("*.yaml"))}
    return MappingProxyType(found)
