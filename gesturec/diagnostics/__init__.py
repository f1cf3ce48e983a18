"""Findings: where (`source`), what (`diagnostic`, `rules`), how they are shown (`render`, `suggest`)."""
