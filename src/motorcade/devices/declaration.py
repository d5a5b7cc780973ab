"""What a device declares; it imports nothing of Motorcade, since all other packages may read it.

A device is data: `motorcade.devices` lists those that there are. These follow from it: fields of words and frames
(`words.formats`), steps with their blocks, Python names and tables of the documentation (`program.steps`), the
record of what a car senses (`car.senses`), methods of a board (`car.board`, MotorcadeBoard.h) and their checks, tables
of pin files, what the Arduino library reads, things on a mat (`mats.schema` and the page's editor), and columns of
recordings and pictures (`engine.moment`). CONTRIBUTING.md says how a device is added.
"""

from dataclasses import dataclass


@dataclass(eq=False)
class Bits:
    """Consecutive bits of a control word.

    Attributes:
        name: the field's name.
        high, low: its first and last bit, 31 to 11; bit 31 is the most significant.
        meaning: one phrase for tables and documentation.
        source: the document that defines it.
        needs: name of the one-bit field without which this one should be 0.
    """

    name: str
    high: int
    low: int
    meaning: str
    source: str
    needs: str = ""


@dataclass(eq=False)
class Input:
    """What is chosen in a step, and its block: one of ``options``, a level from a menu, or seconds.

    Attributes:
        name: the step's field.
        bits: the field of the control word that the value goes into.
        options: for a choice, the names of raw values that follow each other.
        menu: for a level, the menu of the page that shows what levels mean: speed, light or radius.
        first: the level of a new block.
        least: the smallest level that may be chosen; for a choice, the raw value of its first option.
    """

    name: str
    bits: str
    options: tuple[str, ...] = ()
    menu: str = ""
    first: int = 0
    least: int = 0


def seconds(bits: str = "") -> Input:
    """Return the input for a duration, whose level goes into the field ``bits``; without it the step has its own."""
    return Input("seconds", bits)


@dataclass(eq=False)
class Call:
    """A function of Python that makes a step.

    Attributes:
        name: its name.
        about: its docstring.
        sets: the inputs that the name decides, as (name, value) pairs.
        order: the other inputs in the order of its parameters; one with a ``first`` other than 0 has that default.
    """

    name: str
    about: str
    sets: tuple[tuple[str, str], ...] = ()
    order: tuple[str, ...] = ()


@dataclass(eq=False)
class Block:
    """The block of a kind of step.

    Attributes:
        drawer: the drawer of the page's toolbox that has it.
        icon: the path, in a square of 24, of its icon.
        in_start: whether the page's first level, with few kinds of blocks, has it.
    """

    drawer: str
    icon: str
    in_start: bool = False


@dataclass(eq=False)
class StepKind:
    """A kind of step.

    Attributes:
        kind: its name in JSON, in a block's type, and in the keys of its texts (blocks, startBlocks, tooltips, ...).
        about: the docstring of its class.
        block: its block.
        inputs: what is chosen in it.
        sets: fields of the control word that are the same in every step of the kind, as (name, value) pairs.
        calls: its functions in Python; without them the class itself is called by the kind's name.
        accompanies: the step has a bit of the word but no duration of its own.
        minds: what a drive senses that has these bits in its own word: a condition of its ``unless``.
        group: the part of a word that it fills, where that isn't the device's own: of one group a car does one thing
            at a time.
    """

    kind: str
    about: str
    block: Block
    inputs: tuple[Input, ...]
    sets: tuple[tuple[str, int], ...] = ()
    calls: tuple[Call, ...] = ()
    accompanies: bool = False
    minds: str = ""
    group: str = ""


@dataclass(eq=False)
class Column:
    """What all cars show of something at a moment: a column of recordings and pictures (`motorcade.engine.moment`).

    Attributes:
        name: the field of `motorcade.engine.moment.Moment`.
        dtype: NumPy's name of its type in a world.
        packed: its type in recordings and, where ``is_pictured``, in pictures; "bool" is a flag there.
        is_pictured: whether pictures have it as a column.
        unit: of its numbers.
        limits: the least and the greatest of its numbers; None: those of the type.
        recorded: its name in recordings, where that is another one.
    """

    name: str
    dtype: str
    packed: str
    is_pictured: bool = True
    unit: str = ""
    limits: tuple[float, float] | None = None
    recorded: str = ""

    def __post_init__(self) -> None:
        self.recorded = self.recorded or self.name


@dataclass(eq=False)
class Method:
    """A method of a board.

    Attributes:
        name: its name.
        about: its docstring, which says what it returns and in which unit.
        arguments: (name, smallest, largest) of each argument, all integers.
        returns: the type that it returns: int, bool, a list of frames, or None.
        missing: what it returns where the hardware isn't there.
        shown: the column of recordings and pictures that shows what it sets or returns.
    """

    name: str
    about: str
    arguments: tuple[tuple[str, int, int], ...] = ()
    returns: str = "None"
    missing: str = ""
    shown: Column | None = None


@dataclass(eq=False)
class Sense:
    """What a car senses in each tick by a method of its board: a field of `motorcade.car.senses.Senses`.

    Attributes:
        name: the field.
        method: the method of the board.
        about: what the value is, with its unit.
        nothing: the value of a car without this sense.
        only_if: the argument of the reading without which the sensor stays off and senses nothing, such as looks_mm.
    """

    name: str
    method: str
    about: str
    nothing: int = 0
    only_if: str = ""


@dataclass(eq=False)
class Between:
    """A component in the wire between a pin and a terminal.

    Attributes:
        kind: "series", a resistor in the wire; "ground", a resistor from the wire to GND; or "transistor", an NPN whose
            base is at the pin, its collector at the terminal and its emitter at GND.
        value: the resistor's; "NPN".
        protects: whether it keeps 5 V from a pin that can't take so much, and is needed there alone.
    """

    kind: str
    value: str
    protects: bool = False


@dataclass(eq=False)
class Role:
    """One wire of a part, to a pin of the car's computer.

    Attributes:
        key: its name in a pin file.
        drives: whether the computer drives it; otherwise the computer reads it.
        terminal: what is usually printed on the part.
        needed: whether the part does not work without it.
        supply: what the terminal needs, where the wires of a part need different supplies.
        between: components from the pin to the terminal.
    """

    key: str
    drives: bool
    terminal: str
    needed: bool = True
    supply: str = ""
    between: tuple[Between, ...] = ()


@dataclass(eq=False)
class Option:
    """What a part's table in a pin file says beside its pins.

    Attributes:
        key: its name.
        usual: its value where it is left out.
        choices: the words that it may be; without them it is a whole number.
        least, most: the range of a number.
    """

    key: str
    usual: str | int
    choices: tuple[str, ...] = ()
    least: int = 0
    most: int = 0


LEVELS = ("high", "low")
# Above so many percent of the supply an analog input is high; 0 for a digital one.
THRESHOLD = Option("threshold", 0, least=1, most=99)


@dataclass(eq=False)
class Part:
    """What is wired to a car's computer.

    Attributes:
        key: its table in a pin file; ``device-`` and the key is the phrase that people call it by.
        supply: what it needs besides the wires of its roles; {chip} in it is the voltage of the computer's pins.
        roles: its wires.
        read_by: the method of a board that reads its roles as bits, the first role's the lowest. Boards need no code
            for such a part.
        forms: the ways to wire it, each with its roles; empty where there is one, with all roles that are needed.
        options: what a pin file says beside its pins.
        active: the option that says at which level an input counts as 1; without it that is high.
    """

    key: str
    supply: str
    roles: tuple[Role, ...]
    read_by: str = ""
    forms: tuple[tuple[str, ...], ...] = ()
    options: tuple[Option, ...] = ()
    active: str = ""


@dataclass(eq=False)
class Thing:
    """A kind of things on a mat, which cars meet with a device: a table of a mat's file, and of the page's editor.

    Attributes:
        key: its table.
        field: the attribute of `motorcade.mats.Mat` that holds all of them.
        shape: how one is given: ends, round, corners, line, walk or speech (`motorcade.mats.schema.SHAPES`).
        phrase: what one is, for the titles of the schema.
        is_flat: whether it is a mark on the floor, in nobody's way.
    """

    key: str
    field: str
    shape: str
    phrase: str
    is_flat: bool = False


@dataclass(eq=False)
class Device:
    """Something that a car has, with all that other packages need to know of it.

    Attributes:
        name: its name.
        bits: its fields of a control word.
        group: the name of its part of a word, for what can't start together.
        hue: of this part's colour in the page, in degrees.
        steps: the kinds of steps that fill its fields.
        methods: its methods of a board.
        senses: what a car senses by it.
        parts: what is wired to the car's computer.
        things: what a mat has for it.
    """

    name: str
    bits: tuple[Bits, ...] = ()
    group: str = ""
    hue: int = 0
    steps: tuple[StepKind, ...] = ()
    methods: tuple[Method, ...] = ()
    senses: tuple[Sense, ...] = ()
    parts: tuple[Part, ...] = ()
    things: tuple[Thing, ...] = ()
