"""The command line: arguments in, text and files out. `main.py` chooses the command; one module a command."""
