"""What the shell imports and what needs no compiled module: it is part of the snapshot of Python's memory.

A snapshot can't hold a compiled module such as msgspec's, so nothing here may import one.
"""

# ruff: noqa: F401
from motorcade.missions import check, watch
from motorcade.program import blocks, compiler, decompiler, python_reader, python_writer
from motorcade.upload import transfer
