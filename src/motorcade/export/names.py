"""Names that a user's own format can't have: words of the languages that it is exported to."""

import re

from motorcade.errors import MotorcadeError

LONGEST = 40
# Each part begins with a letter, so that a_1 and a1 don't both become a1 where Kaitai writes them in one.
_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z][a-z0-9]*)*")

_C = """
alignas alignof and and_eq asm auto bitand bitor bool break case catch char class compl complex concept const
const_cast consteval constexpr constinit continue decltype default delete do double dynamic_cast else enum explicit
export extern false float for friend goto if imaginary inline int long mutable namespace new noexcept noreturn not
not_eq nullptr operator or or_eq private protected public register reinterpret_cast requires restrict return short
signed sizeof static static_assert static_cast struct switch template this thread_local throw true try typedef typeid
typename typeof typeof_unqual union unsigned using virtual void volatile wchar_t while xor xor_eq
"""
# Compilers, Windows and Qt define these words away.
_C_MACROS = "emit errno far interface linux near signals slots small stderr stdin stdout unix"
_LUA = """
and break do else elseif end false for function goto if in local nil not or repeat return then true until while
"""
_PYTHON = """
and as assert async await break class continue def del elif else except finally for from global if import in is lambda
nonlocal not or pass raise return try while with yield
"""
_JAVASCRIPT = """
arguments await break case catch class const constructor continue debugger default delete do else enum eval export
extends false finally for function if implements import in instanceof interface let new null package private protected
prototype public return static super switch this throw true try typeof var void while with yield
"""
_KAITAI = "close from_bytes from_file from_io"
# The dissector has filters of these names beside those of the fields.
_WIRESHARK = "refused warning word"
_TAKEN = {
    "C": _C,
    "C (headers define it)": _C_MACROS,
    "Lua": _LUA,
    "Python": _PYTHON,
    "JavaScript": _JAVASCRIPT,
    "Kaitai": _KAITAI,
    "the Wireshark dissector": _WIRESHARK,
}
_LANGUAGES_OF = {word: language for language, words in reversed(_TAKEN.items()) for word in words.split()}


def check_name(name: str) -> None:
    """Raise MotorcadeError where ``name`` can't be a field's or a format's name in every exported language."""
    if not _NAME.fullmatch(name) or len(name) > LONGEST:
        raise MotorcadeError("no-identifier", name=name[:60], longest=LONGEST)
    if name in _LANGUAGES_OF:
        raise MotorcadeError("reserved-name", name=name, owner=_LANGUAGES_OF[name])
