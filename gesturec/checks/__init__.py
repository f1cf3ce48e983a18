"""A `Model` becomes a `ResolvedBody`: names, kinds, units and circles are checked, all findings at once."""

from __future__ import annotations

from gesturec.checks.check import check_model, resolve_model

__all__ = ["check_model", "resolve_model"]
