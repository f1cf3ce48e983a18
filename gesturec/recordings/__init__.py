"""Readers and writers of recordings: files in, `Recording` out, in metres and seconds; and results to files.

`read.py` chooses the reader; one module a format. A malformed file is one `InputError` with file and row.
"""
