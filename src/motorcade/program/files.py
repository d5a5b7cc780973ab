"""Programs in files: project files and Python text are read and compiled, images are told from them."""

from dataclasses import replace
from pathlib import Path

from motorcade.config.files import decoded, raised_as, read_bytes
from motorcade.config.profile import Profile, load_profile
from motorcade.errors import MotorcadeError
from motorcade.program.compiler import Compiled, compile_program
from motorcade.program.diagnostics import Diagnostic, ProgramError, error, has_errors
from motorcade.program.model import Program, read_program
from motorcade.program.python_reader import PythonProgram, read_python
from motorcade.words.image import parse_image_bytes
from motorcade.words.packing import ImageError, bytes_to_words

# The ending of files with Python text.
PYTHON = ".py"


def is_project(data: bytes, file: Path) -> bool:
    """Whether the bytes of ``file`` are meant as a project or as Python text, not as an image."""
    if file.suffix in (".json", PYTHON):
        return True
    try:
        parse_image_bytes(data)
    except ImageError:
        pass
    else:
        return False
    try:
        return decoded(data).lstrip().startswith("{")
    except UnicodeError:
        return False


def read_project(data: bytes, file: Path) -> tuple[Program, PythonProgram | None]:
    """Read the project, or the Python text (*.py), in the bytes of ``file``; execute nothing. Raises ProgramError.

    Returns:
        The program, and where its parts stand in the Python text; None for a project file.
    """
    if file.suffix != PYTHON:
        return read_program(data), None
    python = read_python(data)
    return python.program, python


def compile_project(data: bytes, file: Path) -> tuple[Compiled, Profile]:
    """Compile the project or the Python text in the bytes of ``file``, for cars of the profile that it names.

    Raises ProgramError where it is none, or the profile, which may be a file beside it, is not valid.
    """
    program, python = read_project(data, file)
    try:
        profile = load_profile(program.profile, file.parent)
    except MotorcadeError as problem:
        wrong: tuple[Diagnostic, ...] = (error("bad-profile", "profile", reason=problem),)
        if python:
            wrong = python.located(wrong)
        raise ProgramError(wrong) from None
    compiled = compile_program(program, profile)
    if python:
        diagnostics = (*python.diagnostics, *python.located(compiled.diagnostics))
        compiled = replace(compiled, diagnostics=diagnostics)
    return compiled, profile


def image_in(source: Path, profile_name: str, place: object = "") -> tuple[bytes, Profile, tuple[Diagnostic, ...]]:
    """Return the image in a file, or the compiled image of the project in it; the profile; and warnings.

    Args:
        profile_name: the profile of an image; a project names its own.
        place: what a sentence calls the file, unless by its path.

    Raises:
        ProgramError: the project has errors; its diagnostics have the warnings too.
        MotorcadeError: the file is neither, or the profile is not valid.
    """
    data = read_bytes(source)
    if is_project(data, source):
        compiled, profile = compile_project(data, source)
        if has_errors(compiled.diagnostics):
            raise ProgramError(compiled.diagnostics)
        return compiled.image, profile, compiled.diagnostics
    with raised_as("not-a-program", ImageError, place=place or source):
        parse_image_bytes(data)
    return data, load_profile(profile_name), ()


def words_in(source: Path) -> tuple[int, ...]:
    """Return the words in an image file. Raises ImageError, or MotorcadeError where it is a project."""
    data = read_bytes(source)
    if is_project(data, source):
        raise MotorcadeError("project-is-no-image", file=source)
    return bytes_to_words(data)
