"""What `pyproject.toml` cannot say: `models/` at the top is the one source of the shipped models.

In a built package the folder is `gesturec/models`; in a checkout, and in an editable install of one,
it stays where it is (`gesturec.cli.models` looks in both places).
"""

from setuptools import find_namespace_packages, setup

PACKAGES = find_namespace_packages(include=["gesturec", "gesturec.*"], exclude=["*.__pycache__", "*.__pycache__.*"])

setup(
    packages=[*PACKAGES, "gesturec.models"],
    package_dir={"gesturec.models": "models"},
)
