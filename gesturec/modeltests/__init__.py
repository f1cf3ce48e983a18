"""Tests that stand in the model's own file: `run_tests` simulates each path, decodes it, and looks at what came out."""

from gesturec.modeltests.run import Outcome, run_tests

__all__ = ["Outcome", "run_tests"]
