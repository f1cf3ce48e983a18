"""`python -m gesturec`: the command line, for where the script of that name is not on the path."""

from gesturec.cli.main import main

if __name__ == "__main__":
    raise SystemExit(main())
