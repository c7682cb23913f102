"""Broken input files, as data: what each holds, and what the error has to name.

Used by the tests of the reader and of the command line.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

MAIN = "scenario.toml"
DIRECTORY = object()
"""In place of a file's content: a directory of that name."""

STUDY = 'study = "forward"\n'
ROBOT = '[robot]\nname = "D25L60"\n'
MATERIAL = '[material]\nname = "Ecoflex 00-50"\nmodel = "mooney-rivlin"\n'
PRESSURE = "[pressure]\nramp = { sets = [1], to_bar = 1.5, steps = 3 }\n"
CSV_PRESSURE = '[pressure]\nfile = "p.csv"\n'
OWN_ROBOT = """[robot]
outer_diameter_mm = 25
lumen_diameter_mm = 9
chamber_circle_diameter_mm = 17
chamber_diameter_mm = 4.5
chamber_wall_mm = 0.5
length_mm = 60
chamber_sets = 3
chambers_per_set = 2
chamber_angle_deg = 50
"""


def scenario(
    *, top: str = STUDY, robot: str = ROBOT, material: str = MATERIAL, pressure: str = PRESSURE, more: str = ""
) -> str:
    """Return a scenario that runs, with the given parts in place of its own."""
    return top + robot + material + pressure + more


def own_law(formula: str, constants: str = "c = 0.02") -> str:
    """Return a [material] with a formula."""
    return (
        f"[material]\nname = 'mine'\nmodel = 'my-law'\nformula = '''{formula}'''\n[material.constants]\n{constants}\n"
    )


@dataclass(frozen=True)
class Broken:
    """One broken input.

    name : what is wrong. main : content of the scenario, None when there is no such file. names : words that the one
    line has to contain, beside the scenario's path. files : the others of its folder.
    """

    name: str
    main: str | bytes | object
    names: tuple[str, ...]
    files: Mapping[str, str | bytes | object] = field(default_factory=dict)

    def write(self, folder: Path) -> Path:
        """Write the files to a folder; return the path of the scenario."""
        for name, content in {MAIN: self.main, **self.files}.items():
            path = folder / name
            if content is DIRECTORY:
                path.mkdir()
            elif isinstance(content, bytes):
                path.write_bytes(content)
            elif isinstance(content, str):
                path.write_bytes(content.encode())
        return folder / MAIN


def _csv(name: str, content: str | bytes | object, *names: str) -> Broken:
    return Broken(f"csv: {name}", scenario(pressure=CSV_PRESSURE), ("[pressure]", "file", *names), {"p.csv": content})


HEADER = "t_s,p1_bar,p2_bar,p3_bar\n"

NOT_A_SCENARIO = [
    Broken("missing file", None, ("no such file",)),
    Broken("directory", DIRECTORY, ("directory",)),
    Broken("empty file", "", ("empty",)),
    Broken("only blanks and newlines", " \n\n\t\n", ("empty",)),
    Broken("only a comment", "# nothing here\n", ("study", "missing")),
    Broken("binary file", b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR\x00", ("binary",)),
    Broken("not UTF-8", (STUDY + "title = '").encode() + b"caf\xe9'\n", ("UTF-8", "0xe9", "line 2")),
    Broken("UTF-16", scenario().encode("utf-16"), ("UTF-8",)),
    Broken("not TOML", "study: forward\nrobot: D25L60\n", ("TOML", "line 1")),
    Broken("unclosed string", scenario(robot='[robot]\nname = "D25L60\n'), ("TOML", "line 3")),
    Broken("unclosed list", scenario(pressure="[pressure]\nsequence_bar = [[0, 0, 0]\n"), ("TOML",)),
    Broken("table twice", scenario(more=ROBOT), ("TOML", "robot")),
    Broken("key twice", scenario(robot=ROBOT + 'name = "D25L40"\n'), ("TOML", "line 4")),
    Broken("deep nesting", "a = " + "[" * 5000, ("TOML",)),
    Broken("endless number", "study = " + "1" * 5000, ("TOML",)),
    Broken("JSON", '{"study": "forward"}', ("TOML", "line 1")),
    Broken("control character", "study = 'forward\x1b[31m'\n", ("TOML", "line 1")),
]

TABLES = [
    Broken("no study", scenario(top=""), ("study", "missing", "'forward'")),
    Broken("misspelt study", scenario(top="study = 'foward'\n"), ("study", "did you mean 'forward'?")),
    Broken("study of a wrong type", scenario(top="study = 1\n"), ("study", "'forward'", "got 1")),
    Broken("study is a table", "[study]\n" + scenario(top=""), ("study", "a table")),
    Broken("no robot", scenario(robot=""), ("[robot]", "missing")),
    Broken("no material", scenario(material=""), ("[material]", "missing")),
    Broken("no pressure", scenario(pressure=""), ("[pressure]", "missing")),
    Broken("unknown table", scenario(more="[solvers]\n"), ("[solvers]", "did you mean 'solver'?")),
    Broken(
        "misspelt required table", scenario(robot="[robto]\nname = 'D25L60'\n"), ("[robto]", "did you mean 'robot'?")
    ),
    Broken("unknown key at the top", scenario(top=STUDY + "titel = 'x'\n"), ("titel", "did you mean 'title'?")),
    Broken("title of a wrong type", scenario(top=STUDY + "title = 5\n"), ("title", "text", "got 5")),
    Broken("title with an escape", scenario(top=STUDY + 'title = "a\\u001b[31m"\n'), ("title", "\\x1b")),
    Broken(
        "unused table contact", scenario(more="[contact]\noffset_mm = 1.0\n"), ("[contact]", "not used", "'forward'")
    ),
    Broken("unused table workspace", scenario(more="[workspace]\nlevels = 3\n"), ("[workspace]", "not used")),
    Broken("unused table target", scenario(more="[target]\ntip_position_mm = [[0, 0, 1]]\n"), ("[target]", "not used")),
    Broken("unused table bounds", scenario(more="[bounds]\npressure_bar = [0, 1]\n"), ("[bounds]", "not used")),
    Broken(
        "value for a table", scenario(top=STUDY + "robot = 'D25L60'\n", robot=""), ("[robot]", "a table", "'D25L60'")
    ),
    Broken("list of tables", scenario(robot="[[robot]]\nname = 'D25L60'\n"), ("[robot]", "a table", "list of 1")),
    Broken("endless title", scenario(top=STUDY + f"title = '{'x' * 10**5}'\n"), ("title", "at most 200 characters")),
    Broken("endless key", scenario(top=STUDY + "x" * 10**5 + " = 1\n"), ("xxxxxxxx", "unknown")),
    Broken("newline in a key", scenario(more='[stiffening]\n"a\\nb" = 1\n'), ("[stiffening]", "a\\nb", "unknown")),
    Broken("newline in a table", scenario(more='["so\\nver"]\n'), ("[so\\nver]", "unknown")),
]

ROBOTS = [
    Broken("unknown robot", scenario(robot="[robot]\nname = 'D25L6'\n"), ("[robot]", "name", "did you mean 'D25L60'?")),
    Broken("robot with nothing", scenario(robot="[robot]\n"), ("[robot]", "name", "missing")),
    Broken("robot name of a wrong type", scenario(robot="[robot]\nname = 25\n"), ("[robot]", "name", "text", "25")),
    Broken("newline in a name", scenario(robot='[robot]\nname = "D25\\nL60"\n'), ("[robot]", "name", "D25 L60")),
    Broken("escape in a name", scenario(robot='[robot]\nname = "D25\\u001b[2J"\n'), ("[robot]", "name", "D25\\x1b[2J")),
    Broken(
        "dimension missing",
        scenario(robot=OWN_ROBOT.replace("length_mm = 60\n", "")),
        ("[robot]", "length_mm", "missing"),
    ),
    Broken(
        "dimension missing beside an own name",
        scenario(robot=OWN_ROBOT.replace("length_mm = 60", "name = 'mine'")),
        ("[robot]", "length_mm", "'mine'"),
    ),
    Broken(
        "misspelt dimension",
        scenario(robot=OWN_ROBOT.replace("lumen_diameter_mm", "lumen_diametre_mm")),
        ("[robot]", "lumen_diametre_mm", "did you mean 'lumen_diameter_mm'?"),
    ),
    Broken("dimension without unit", scenario(robot=ROBOT + "length = 60\n"), ("[robot]", "did you mean 'length_mm'?")),
    Broken("dimension as text", scenario(robot=ROBOT + "length_mm = '60'\n"), ("[robot]", "length_mm", "a number")),
    Broken("dimension as bool", scenario(robot=ROBOT + "length_mm = true\n"), ("[robot]", "length_mm", "got true")),
    Broken("dimension nan", scenario(robot=ROBOT + "length_mm = nan\n"), ("[robot]", "length_mm", "finite", "nan")),
    Broken("dimension inf", scenario(robot=ROBOT + "length_mm = inf\n"), ("[robot]", "length_mm", "finite", "inf")),
    Broken(
        "negative size", scenario(robot=ROBOT + "outer_diameter_mm = -25\n"), ("[robot]", "outer_diameter_mm", "-25")
    ),
    Broken(
        "size zero", scenario(robot=ROBOT + "chamber_diameter_mm = 0\n"), ("[robot]", "chamber_diameter_mm", "above 0")
    ),
    Broken("size of a continent", scenario(robot=ROBOT + "length_mm = 1e9\n"), ("[robot]", "length_mm", "1e+09 mm")),
    Broken(
        "size of an atom", scenario(robot=ROBOT + "chamber_wall_mm = 1e-7\n"), ("[robot]", "chamber_wall_mm", "1e-07")
    ),
    Broken("fraction of a set", scenario(robot=ROBOT + "chamber_sets = 2.5\n"), ("[robot]", "chamber_sets", "whole")),
    Broken(
        "no chambers", scenario(robot=ROBOT + "chambers_per_set = 0\n"), ("[robot]", "chambers_per_set", "at least 1")
    ),
    Broken("a billion chambers", scenario(robot=ROBOT + "chamber_sets = 1_000_000_000\n"), ("[robot]", "chamber_sets")),
    Broken("endless count", scenario(robot=ROBOT + f"chamber_sets = 0x{'f' * 6000}\n"), ("[robot]", "chamber_sets")),
    Broken(
        "angle beyond the circle", scenario(robot=ROBOT + "chamber_angle_deg = 400\n"), ("[robot]", "chamber_angle_deg")
    ),
    Broken(
        "lumen outside", scenario(robot=ROBOT + "lumen_diameter_mm = 30\n"), ("[robot]", "lumen_diameter_mm", "25 mm")
    ),
    Broken(
        "overlapping chambers",
        scenario(robot=ROBOT + "chamber_angle_deg = 30\n"),
        ("[robot]", "chamber_overlap", "2 r_co = 5.5 mm", "allow"),
    ),
    Broken(
        "sets overlap the next set",
        scenario(robot=ROBOT + "chamber_angle_deg = 110\n"),
        ("[robot]", "chamber_overlap", "5.5 mm"),
    ),
    Broken(
        "thin wall",
        scenario(robot=ROBOT + "outer_diameter_mm = 23.5\nchamber_diameter_mm = 6\n"),
        ("[robot]", "wall_thickness", "0.625 mm", "0.8 mm"),
    ),
    Broken(
        "wall below the asked minimum",
        scenario(robot=ROBOT + "minimum_wall_mm = 2.0\n"),
        ("[robot]", "wall_thickness", "1.75 mm", "2 mm"),
    ),
    Broken(
        "chambers outside the wall",
        scenario(robot=ROBOT + "chamber_circle_diameter_mm = 20\n"),
        ("[robot]", "chambers_inside_wall", "12.75 mm", "12.5 mm"),
    ),
    Broken(
        "rule that cannot be lowered",
        scenario(robot=ROBOT + "allow = ['chambers_inside_wall']\n"),
        ("[robot]", "allow", "chambers_inside_wall"),
    ),
    Broken("unknown rule", scenario(robot=ROBOT + "allow = ['overlap']\n"), ("[robot]", "allow", "'chamber_overlap'")),
    Broken(
        "allow is not a list", scenario(robot=ROBOT + "allow = 'chamber_overlap'\n"), ("[robot]", "allow", "a list")
    ),
]

MATERIALS = [
    Broken(
        "misspelt silicone",
        scenario(material=MATERIAL.replace("00-50", "0050")),
        ("[material]", "name", "did you mean 'Ecoflex 00-50'?"),
    ),
    Broken(
        "misspelt law",
        scenario(material=MATERIAL.replace("rivlin", "rivelin")),
        ("[material]", "model", "mooney-rivlin"),
    ),
    Broken("no model", scenario(material="[material]\nname = 'Ecoflex 00-50'\n"), ("[material]", "model", "missing")),
    Broken("no silicone", scenario(material="[material]\nmodel = 'yeoh'\n"), ("[material]", "name", "missing")),
    Broken(
        "model of a wrong type",
        scenario(material="[material]\nname = 'x'\nmodel = 3\n"),
        ("[material]", "model", "text"),
    ),
    Broken(
        "negative density", scenario(material=MATERIAL + "density_kg_m3 = -1070\n"), ("[material]", "density_kg_m3")
    ),
    Broken(
        "density nan", scenario(material=MATERIAL + "density_kg_m3 = nan\n"), ("[material]", "density_kg_m3", "finite")
    ),
    Broken("density without unit", scenario(material=MATERIAL + "density = 1000\n"), ("[material]", "density_kg_m3")),
    Broken("no such materials", scenario(material=MATERIAL + "file = 'mine.toml'\n"), ("[material]", "mine.toml")),
    Broken(
        "materials empty",
        scenario(material=MATERIAL + "file = 'mine.toml'\n"),
        ("[material]", "mine.toml"),
        {"mine.toml": ""},
    ),
    Broken(
        "materials of an endless name",
        scenario(material=MATERIAL + f"file = '{'m' * 5000}'\n"),
        ("[material]", "file", "characters"),
    ),
    Broken(
        "materials binary",
        scenario(material=MATERIAL + "file = 'mine.toml'\n"),
        ("[material]", "mine.toml"),
        {"mine.toml": b"\x00\x01\x02"},
    ),
    Broken(
        "materials not UTF-8",
        scenario(material=MATERIAL + "file = 'mine.toml'\n"),
        ("[material]", "mine.toml", "UTF-8"),
        {"mine.toml": b"[caf\xe9]\n"},
    ),
    Broken(
        "materials directory",
        scenario(material=MATERIAL + "file = 'mine.toml'\n"),
        ("[material]", "mine.toml"),
        {"mine.toml": DIRECTORY},
    ),
    Broken(
        "materials not TOML",
        scenario(material=MATERIAL + "file = 'mine.toml'\n"),
        ("[material]", "mine.toml", "line 1"),
        {"mine.toml": "Ecoflex: 5\n"},
    ),
    Broken(
        "constant of a file is text",
        scenario(material=MATERIAL.replace("Ecoflex 00-50", "mine") + "file = 'mine.toml'\n"),
        ("mine.toml", "mine", "C10_MPa"),
        {"mine.toml": "[mine.mooney-rivlin]\nC10_MPa = '0.1'\nC01_MPa = 0.1\nC20_MPa = 0.1\n"},
    ),
    Broken(
        "constant of a file misspelt",
        scenario(material=MATERIAL.replace("Ecoflex 00-50", "mine") + "file = 'mine.toml'\n"),
        ("mine.toml", "mine", "C1_MPa"),
        {"mine.toml": "[mine.mooney-rivlin]\nC1_MPa = 0.1\nC01_MPa = 0.1\nC20_MPa = 0.1\n"},
    ),
    Broken(
        "both file and constants",
        scenario(material=MATERIAL + "file = 'mine.toml'\n[material.constants]\nC10_MPa = 1\n"),
        ("[material]", "file"),
    ),
    Broken(
        "constant missing",
        scenario(material="[material]\nname = 'x'\nmodel = 'yeoh'\n[material.constants]\nC10_MPa = 0.02\n"),
        ("[material", "C20_MPa"),
    ),
    Broken(
        "constant without unit",
        scenario(material="[material]\nname = 'x'\nmodel = 'neo-hookean'\n[material.constants]\nmu0 = 0.02\n"),
        ("[material", "mu0_MPa"),
    ),
    Broken(
        "constant nan",
        scenario(material="[material]\nname = 'x'\nmodel = 'neo-hookean'\n[material.constants]\nmu0_MPa = nan\n"),
        ("[material]", "mu0_MPa", "nan"),
    ),
    Broken(
        "constants not a table", scenario(material=MATERIAL + "constants = 5\n"), ("[material]", "constants", "a table")
    ),
    Broken("formula of a wrong type", scenario(material=MATERIAL + "formula = 5\n"), ("[material]", "formula", "text")),
    *(
        Broken(f"formula: {name}", scenario(material=own_law(formula)), ("[material]", "formula"))
        for name, formula in {
            "import": '__import__("os").system("true") * c * stretch',
            "import without quotes": "__import__(c) * stretch",
            "attribute": "c * stretch.__class__",
            "attribute of a constant": "c.real * stretch",
            "huge power": "9**9**9**9 * c * (stretch - 1)",
            "huge power of a bracket": "(10**10)**(10**10) * c * (stretch - 1)",
            "huge exponent of stretch": "c * (stretch**99999999 - 1)",
            "huge number": f"c * (stretch - 1) * {'9' * 400}",
            "call": "open(c) * stretch",
            "lambda": "(lambda: 1)() * c * stretch",
            "comprehension": "[x for x in (c, stretch)]",
            "subscript": "c * stretch[0]",
            "comparison": "(stretch > 1) * c",
            "text": "'a' * 1000000000 * c * stretch",
            "statement": "c = stretch",
            "syntax": "c * (stretch - ",
            "unknown name": "c * d * (stretch - 1)",
            "empty": "",
            "very long": "c * (stretch - 1)" + " + 0" * 100000,
            "deep brackets": "-" * 400 + "c * stretch",
            "no stretch": "c * 2",
            "division by zero": "c * (stretch - 1) / (1 - 1)",
        }.items()
    ),
    Broken(
        "fitted range of one number",
        scenario(material=MATERIAL + "fitted_stretch = [1.0]\n"),
        ("[material]", "fitted_stretch", "at least 2"),
    ),
    Broken(
        "fitted range backwards",
        scenario(material=own_law("c * (stretch - 1)").replace("formula", "fitted_stretch = [2.0, 1.0]\nformula")),
        ("[material]", "fitted_stretch"),
    ),
]

PRESSURES = [
    Broken(
        "no source", scenario(pressure="[pressure]\n"), ("[pressure]", "exactly one", "sequence_bar", "ramp", "file")
    ),
    Broken(
        "two sources",
        scenario(pressure=PRESSURE + "sequence_bar = [[0, 0, 0]]\n"),
        ("[pressure]", "exactly one", "sequence_bar and ramp"),
    ),
    Broken(
        "three sources",
        scenario(pressure=PRESSURE + "sequence_bar = [[0, 0, 0]]\nfile = 'p.csv'\n"),
        ("[pressure]", "and file"),
    ),
    *(
        Broken(
            f"sequence: {name}",
            scenario(pressure=f"[pressure]\nsequence_bar = {rows}\n"),
            ("[pressure]", "sequence_bar", *named),
        )
        for name, rows, named in (
            ("empty", "[]", ("at least 1",)),
            ("not a list", "1.5", ("a list", "1.5")),
            ("flat", "[0.0, 0.1, 0.2]", ("row 1", "a list")),
            ("wrong number of columns", "[[0, 0, 0], [0, 0]]", ("row 2", "expected 3", "got 2")),
            ("text", "[[0, 0, 0], [0, 'high', 0]]", ("row 2 column 2", "a number", "'high'")),
            ("bool", "[[0, true, 0]]", ("row 1 column 2", "got true")),
            ("nan", "[[0, nan, 0]]", ("row 1 column 2", "finite")),
            ("inf", "[[0, 0, inf]]", ("row 1 column 3", "finite")),
            ("negative", "[[0, 0, -0.1]]", ("row 1 column 3", "at least 0", "-0.1")),
            ("pascal for bar", "[[0, 0, 0], [150000, 0, 0]]", ("row 2 column 1", "100 bar", "150000", "kPa")),
        )
    ),
    *(
        Broken(f"ramp: {name}", scenario(pressure=f"[pressure]\nramp = {ramp}\n"), ("[pressure]", *named))
        for name, ramp, named in (
            ("not a table", "1.5", ("ramp", "a table")),
            ("set from 0", "{ sets = [0], to_bar = 1, steps = 3 }", ("ramp.sets", "from 1 to 3", "got 0")),
            (
                "set too large",
                "{ sets = [1, 4], to_bar = 1, steps = 3 }",
                ("ramp.sets", "item 2", "from 1 to 3", "got 4"),
            ),
            ("set twice", "{ sets = [1, 1], to_bar = 1, steps = 3 }", ("ramp.sets", "once")),
            ("no set", "{ sets = [], to_bar = 1, steps = 3 }", ("ramp.sets", "at least 1")),
            ("set not in a list", "{ sets = 1, to_bar = 1, steps = 3 }", ("ramp.sets", "a list")),
            ("set is no number", "{ sets = ['1'], to_bar = 1, steps = 3 }", ("ramp.sets", "item 1", "whole")),
            ("one step", "{ sets = [1], to_bar = 1, steps = 1 }", ("ramp.steps", "at least 2")),
            ("half a step", "{ sets = [1], to_bar = 1, steps = 2.5 }", ("ramp.steps", "whole")),
            ("endless steps", "{ sets = [1], to_bar = 1, steps = 10_000_000_000 }", ("ramp.steps", "at most")),
            ("no end", "{ sets = [1], steps = 3 }", ("ramp.to_bar", "missing")),
            ("negative end", "{ sets = [1], to_bar = -1, steps = 3 }", ("ramp.to_bar", "at least 0")),
            ("kilopascal for bar", "{ sets = [1], to_bar = 150, steps = 3 }", ("ramp.to_bar", "100 bar", "kPa")),
            ("misspelt key", "{ sets = [1], to_bars = 1, steps = 3 }", ("ramp.to_bars", "did you mean 'to_bar'?")),
        )
    ),
    Broken("csv: missing", scenario(pressure=CSV_PRESSURE), ("[pressure]", "file", "p.csv", "no such file")),
    Broken(
        "csv: nearly the name of another",
        scenario(pressure="[pressure]\nfile = 'presure.csv'\n"),
        ("[pressure]", "file", "did you mean 'pressure.csv'?"),
        {"pressure.csv": HEADER},
    ),
    Broken("csv: no such folder", scenario(pressure="[pressure]\nfile = 'data/p.csv'\n"), ("data/p.csv", "folder")),
    Broken(
        "csv: name with a newline",
        scenario(pressure='[pressure]\nfile = "p\\n.csv"\n'),
        ("[pressure]", "file", "p\\n.csv"),
    ),
    Broken(
        "csv: name with NUL",
        scenario(pressure='[pressure]\nfile = "p\\u0000.csv"\n'),
        ("[pressure]", "file", "p\\u0000.csv", "single quotes"),
    ),
    Broken("csv: name too long", scenario(pressure=f"[pressure]\nfile = '{'p' * 400}'\n"), ("[pressure]", "file")),
    Broken("csv: file of a wrong type", scenario(pressure="[pressure]\nfile = 5\n"), ("[pressure]", "file", "text")),
    Broken("csv: device", scenario(pressure="[pressure]\nfile = '/dev/zero'\n"), ("[pressure]", "file", "a device")),
    _csv("directory", DIRECTORY, "p.csv", "directory"),
    _csv("empty", "", "p.csv", "empty"),
    _csv("blank lines only", "\n \n", "p.csv", "empty"),
    _csv("header only", HEADER, "p.csv", "row"),
    _csv("binary", b"\x1f\x8b\x08\x00\x00", "p.csv", "binary"),
    _csv("not UTF-8", HEADER.encode() + b"0,0,0,\xff\n", "p.csv", "UTF-8", "line 2"),
    _csv("no header", "0,0,0,0\n1,0.1,0,0\n", "p.csv: line 1", "t_s, p1_bar, p2_bar, p3_bar", "'0'"),
    _csv("column missing", "t_s,p1_bar,p2_bar\n0,0,0\n", "line 1", "'p3_bar'"),
    _csv("column misspelt", HEADER.replace("p2_bar", "p2_mbar") + "0,0,0,0\n", "line 1", "did you mean 'p2_bar'?"),
    _csv("column too many", "p1_bar,p2_bar,p3_bar,p4_bar\n0,0,0,0\n", "line 1", "'p4_bar'"),
    _csv("column twice", "p1_bar,p2_bar,p3_bar,p1_bar\n0,0,0,0\n", "line 1", "'p1_bar' 2 times"),
    _csv("semicolons", HEADER.replace(",", ";") + "0;0;0;0\n", "line 1", "commas"),
    _csv("ragged, short", HEADER + "0,0,0,0\n1,0.1,0\n", "line 3", "expected 4", "got 3"),
    _csv("ragged, long", HEADER + "0,0,0,0,0\n", "line 2", "expected 4", "got 5"),
    _csv("text", HEADER + "0,0,0,0\n1,high,0,0\n", "line 3", "p1_bar", "'high'"),
    _csv("empty cell", HEADER + "0,0,,0\n", "line 2", "p2_bar", "a number"),
    _csv("decimal comma", HEADER + '0,"0,5",0,0\n', "line 2", "p1_bar", "'0,5'"),
    _csv("digits of Python", HEADER + "0,0,0,0\n1,1_5,0,0\n", "line 3", "p1_bar", "'1_5'"),
    _csv("nan", HEADER + "0,0,0,0\n\n1,0,nan,0\n", "line 4", "p2_bar", "finite"),
    _csv("inf", HEADER + "0,0,0,inf\n", "line 2", "p3_bar", "finite"),
    _csv("time nan", HEADER + "nan,0,0,0\n", "line 2", "t_s", "finite"),
    _csv("negative", HEADER + "0,0,0,0\n1,0,0,-0.5\n", "line 3", "p3_bar", "-0.5"),
    _csv("pascal", HEADER + "0,150000,0,0\n", "line 2", "p1_bar", "100 bar"),
    _csv("time backwards", HEADER + "0,0,0,0\n2,0,0,0\n1,0,0,0\n", "line 4", "t_s", "got 1"),
    _csv("unclosed quote", HEADER + '0,"0,0,0\n', "CSV"),
]

SETTINGS = [
    Broken(f"{table}: {line}", scenario(more=f"[{table}]\n{line}\n"), (f"[{table}]", line.split(" ")[0], *named))
    for table, line, named in (
        ("stiffening", "set = 'calibrate'", ("did you mean 'calibrated'?",)),
        ("stiffening", "set = 1", ("'reproduction'",)),
        ("stiffening", "elongation = -0.1", ("at least 0",)),
        ("stiffening", "bending = nan", ("finite",)),
        ("stiffening", "k_e = 0.4", ("unknown", "elongation")),
        ("corrections", "area = 0", ("above 0",)),
        ("corrections", "bore_fraction = 1.5", ("at most 1",)),
        ("corrections", "conventions = 'as-printed'", ("did you mean 'as_printed'?",)),
        ("gravity", "direction = 'down'", ("'-z'",)),
        ("gravity", "direction = 9.81", ("9.81",)),
        ("gravity", "direction = true", ("true",)),
        ("gravity", "direction = [0, 0]", ("3 numbers",)),
        ("gravity", "direction = [0, 0, 0]", ("length 0",)),
        ("gravity", "direction = [0, 0, 'z']", ("3 numbers", "'z'")),
        ("gravity", "direction = [0, 0, true]", ("3 numbers", "true")),
        ("gravity", "direction = [0, nan, 0]", ("finite",)),
        ("gravity", "directon = '-z'", ("did you mean 'direction'?",)),
        ("tip_load", "force_N = 1.0", ("a list",)),
        ("tip_load", "force_N = [1.0, 0.0]", ("at least 3", "list of 2")),
        ("tip_load", "moment_Nmm = [0, 0, 0, 0]", ("at most 3", "list of 4")),
        ("tip_load", "moment_Nmm = [0, inf, 0]", ("item 2", "finite")),
        ("tip_load", "moment_Nm = [0, 0, 0]", ("did you mean 'moment_Nmm'?",)),
        ("solver", "intervals = 'many'", ("'auto'", "'many'")),
        ("solver", "intervals = 0", ("from 1 to 2000",)),
        ("solver", "intervals = 2001", ("from 1 to 2000",)),
        ("solver", "intervals = 20.0", ("whole",)),
        ("solver", "intervals = true", ("true",)),
        ("solver", "accuracy = 0", ("above 0",)),
        ("solver", "accuracy = 0.5", ("at most 0.01",)),
        ("solver", "tolerance = 1e-3", ("at most 0.0001",)),
        ("solver", "tolerance = '1e-8'", ("a number",)),
        ("solver", "transcription = 'shooting'", ("did you mean 'multiple-shooting'?",)),
    )
]

CONTACTS = [
    Broken(
        f"contact: {lines[0]}",
        scenario(top="study = 'blocked-force'\n", more="[contact]\n" + "\n".join(lines) + "\n"),
        ("[contact]", *named),
    )
    for lines, named in (
        (("offset = 1.0",), ("offset", "did you mean 'offset_mm'?")),
        (("offset_mm = nan",), ("offset_mm", "finite")),
        (("tip_cap_mm = -1",), ("tip_cap_mm", "at least 0")),
        (("closure = 'stiff'",), ("closure", "'compliant'")),
        (("chamber_reaction = -1",), ("chamber_reaction", "at least 0")),
        (("wall_point_mm = [0, 0, 0]",), ("wall_normal", "missing", "wall_point_mm")),
        (("wall_normal = [1, 0, 0]",), ("wall_point_mm", "missing", "wall_normal")),
        (("wall_normal = [0, 0, 0]", "wall_point_mm = [0, 0, 0]"), ("wall_normal", "length 0")),
        (("wall_normal = 'x'", "wall_point_mm = [0, 0, 0]"), ("wall_normal", "3 numbers")),
        (("offset_mm = 0.0", "wall_normal = [1, 0, 0]", "wall_point_mm = [0, 0, 0]"), ("offset_mm", "wall_normal")),
        (("weight_force_per_N = 1.0",), ("weight_force_per_N", "'weighted'")),
        (("mode = 'constraint'",), ("mode", "did you mean 'constrained'?")),
        (("mode = 'constrained'", "offset_mm = 0.0"), ("offset_mm", "'constrained'")),
        (("mode = 'constrained' ", "tip_cap_mm = 3.0"), ("tip_cap_mm", "'constrained'")),
        (("mode = 'constrained'  ", "target_force_N = 3.0"), ("target_force_N", "'constrained'")),
        (("mode = 'constrained'   ", "closure = 'free'"), ("closure", "'compliant'", "forward")),
        (("offsets_mm = []",), ("offsets_mm", "at least 1")),
        (("offsets_mm = -1.0",), ("offsets_mm", "a list")),
        (("offsets_mm = [0.0, nan]",), ("offsets_mm", "item 2", "finite")),
        (("offsets_mm = [0.0, -1.0]",), ("offsets_mm", "one step in [pressure]", "got 3")),
        (("offsets_mm = [0.0]", "offset_mm = 1.0"), ("offsets_mm", "at most one", "offset_mm and offsets_mm")),
        (("offsets_mm = [1.0]", "target_force_N = 0.1"), ("target_force_N", "at most one")),
        (("weight_sensitivity = true",), ("weight_sensitivity", "'weighted'")),
        (("weight_sensitivity = 1", "closure = 'weighted'"), ("weight_sensitivity", "true or false")),
        (("closure = 'weighted'", "weight_sensitivity = true"), ("weight_sensitivity", "weight_force_per_N")),
        (
            ("weight_force_per_N = 1", "weight_sensitivity = true", "closure = 'weighted'", "target_force_N = 0.1"),
            ("weight_sensitivity", "each pressure", "target_force_N"),
        ),
        (
            ("weight_force_per_N = 2", "weight_sensitivity = true", "closure = 'weighted'", "mode = 'constrained'"),
            ("weight_sensitivity", "each pressure", "constrained"),
        ),
        (("offset_ramp = -5.0",), ("offset_ramp", "a table")),
        (("offset_ramp = { from_mm = 0, to_mm = -5 }",), ("offset_ramp.steps", "missing")),
        (("offset_ramp = { from_mm = 0, to_mm = -5, steps = 1 }",), ("offset_ramp.steps", "at least 2")),
        (("offset_ramp = { from_mm = 0, to_mm = -5, steps = 3 }",), ("offset_ramp", "one step in [pressure]")),
        (("offset_ramp = { from_mm = 0, to = -5, steps = 3 }",), ("offset_ramp.to", "did you mean 'to_mm'?")),
        (("target_force_N = 0.0",), ("target_force_N", "above 0")),
        (("target_force_N = [0.1]",), ("target_force_N", "a number")),
        (("target_force = 0.1",), ("target_force", "did you mean 'target_force_N'?")),
        (("weight_length_per_mm = 0", "closure = 'weighted'"), ("weight_length_per_mm", "above 0")),
    )
]

CONTACTS += [
    Broken(
        f"contact: {name}",
        scenario(top="study = 'blocked-force'\n", pressure=f"[pressure]\n{pressure}\n", more=f"[contact]\n{line}\n"),
        ("[contact]", "target_force_N", "[pressure]"),
    )
    for name, pressure, line in (
        ("a force without pressure", "sequence_bar = [[0, 0, 0]]", "target_force_N = 0.1"),
        ("a force of unlike pressures", "sequence_bar = [[1.0, 0.5, 0]]", "target_force_N = 0.1"),
    )
]

BROKEN: list[Broken] = [*NOT_A_SCENARIO, *TABLES, *ROBOTS, *MATERIALS, *PRESSURES, *SETTINGS, *CONTACTS]
