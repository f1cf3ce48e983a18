"""What a compiled model can and cannot tell apart, before a camera is touched.

`analyze.analyze` takes an artifact and a noise and gives a frozen `report.Analysis`; `text` and `picture` show it.
"""
