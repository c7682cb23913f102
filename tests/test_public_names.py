"""Every public name says what it takes and gives: each parameter and field by its own name, with unit and shape.

The rules, for what `softnlp.__all__` names and for the package's classes that these return or hold:

- parameters stand in a Parameters section, fields of data in an Attributes section, named as in the code, all of them;
- what returns something says so in a Returns section; a property says it in its own line;
- a number or an array names its unit in brackets, [Pa], [1] where it has none, [SI] where a name beside it decides;
- an array names its shape in parentheses, (steps, sets); what may be either says "number" or a shape;
- an entry "As `softnlp.forward`" takes its words from there, where the same name has to be documented.
"""

from __future__ import annotations

import ast
import dataclasses
import inspect
import re
import typing
from collections.abc import Callable, Iterator
from enum import Enum
from functools import cached_property
from itertools import pairwise
from types import FunctionType
from typing import Any

import pytest

import softnlp

SECTION = re.compile(r"^(Parameters|Attributes|Returns|Raises|Yields|Notes|Examples)\n-+\n", re.MULTILINE)
UNITS = r"1|SI|bar|deg|s|m|N|Pa|N m|N m\^2|rad|kg/m|"
UNITS += r"Pa/s|kg/m\^3|m/s\^2|m/s|J|Hz|kg|1/N|1/\(N m\)|1/m|m/N|N/m|m/Pa|rad/Pa|m\^3/Pa\^3|%|m, rad or N"
UNIT = re.compile(rf"\[({UNITS})(, ({UNITS}))*\]")
SHAPE = re.compile(r"\((\w+,|(\w+, )+\w+|\w+, \.\.\.)\)")
REFERENCE = re.compile(r"^As `(?:softnlp\.)?(\w+)`")
ARRAY = re.compile(r"\bArray\b|NDArray|ndarray|\bVector\b|tuple\[float|Sequence\[float")
NUMBER = re.compile(r"\bfloat\b|\bAny\b|\bscalar\b")
# Machinery that a result keeps for solving again, and a protocol of the scenario; no interface.
INNER = {"Engine", "FreeConstants", "ImplicitDerivatives", "LinearPoint", "Solution", "Task"}
# What posing a problem of one's own hands on; each says what it is made of in its own words.
INNER |= {"Chain", "CompiledProblem", "LoadCase"}


def sections(doc: str) -> dict[str, str]:
    """Split a docstring at its headings; the head goes under ""."""
    parts = SECTION.split(inspect.cleandoc(doc))
    return {"": parts[0], **dict(zip(parts[1::2], parts[2::2], strict=True))}


def entries(section: str) -> dict[str, str]:
    """Return the words of each name in a section of "a, b : type" lines and indented text."""
    found: dict[str, str] = {}
    names: list[str] = []
    for line in section.splitlines():
        if line and not line.startswith(" "):
            head, _, rest = line.partition(" : ")
            names = [name.lstrip("*") for name in head.split(", ")]
            assert not set(names) & set(found), f"{names} documented twice"
            found |= {name: rest.strip() for name in names}
        else:
            found |= {name: f"{found[name]} {line.strip()}".strip() for name in names}
    return found


def lacking(annotation: str, words: str) -> str | None:
    """Return what the words on a value of this annotation do not say."""
    if "Callable" in annotation or annotation.startswith(("Mapping[str, Any]", "dict[str, Any]")):
        return None
    array, number = ARRAY.search(annotation), NUMBER.search(annotation)
    if not array and not number:
        return None
    if not UNIT.search(words):
        return "no unit such as [Pa] or [1]"
    if (array or "Any" in annotation) and not SHAPE.search(words) and not ("Any" in annotation and "number" in words):
        return "no shape such as (steps, sets)"
    return None


def judged(where: str, written: dict[str, str], annotations: dict[str, str]) -> Iterator[str]:
    """Yield what is wrong with the entries for these names."""
    if list(written) != list(annotations):
        missing, unknown = [n for n in annotations if n not in written], [n for n in written if n not in annotations]
        if missing or unknown:
            yield f"{where}: not documented: {missing}, not there: {unknown}"
        else:
            yield f"{where}: documented in another order than declared"
    for name in annotations.keys() & written.keys():
        words = written[name]
        if not words.strip():
            yield f"{where}: nothing is said of {name}"
        if reference := REFERENCE.match(words):
            target = getattr(softnlp, reference[1], None)
            there = entries(sections(inspect.getdoc(target) or "").get("Parameters", "")) if target else {}
            if name not in there:
                yield f"{where}: {name} is 'as {reference[1]}', which says nothing of it"
            continue
        if problem := lacking(annotations[name], words):
            yield f"{where}: {name} has {problem}: {words}"


def judged_function(where: str, function: Callable[..., Any]) -> Iterator[str]:
    """Yield what is wrong with a function's or method's docstring."""
    parts = sections(function.__doc__ or "")
    if not parts[""].strip():
        yield f"{where}: no docstring"
        return
    signature = inspect.signature(function)
    parameters = {p.name: str(p.annotation) for p in signature.parameters.values() if p.name not in ("self", "cls")}
    keywords = {p.name for p in signature.parameters.values() if p.kind is p.VAR_KEYWORD}
    parameters |= dict.fromkeys(keywords & parameters.keys(), "keywords")
    yield from judged(where, entries(parts.get("Parameters", "")), parameters)
    returned = str(signature.return_annotation)
    if returned != "None":
        if "Returns" not in parts:
            yield f"{where}: no Returns section"
        elif problem := lacking(returned, parts["Returns"]):
            yield f"{where}: what it returns has {problem}"


def field_annotations(cls: type) -> dict[str, str]:
    """Return the fields of a dataclass or a named tuple."""
    if dataclasses.is_dataclass(cls):
        return {f.name: str(f.type) for f in dataclasses.fields(cls)}
    return {name: str(cls.__annotations__[name]) for name in getattr(cls, "_fields", ())}


def judged_class(cls: type) -> Iterator[str]:
    """Yield what is wrong with the docstrings of a class, its fields, properties and methods."""
    where = cls.__name__
    parts = sections(cls.__dict__.get("__doc__") or "")
    if not parts[""].strip() or parts[""].startswith(f"{where}("):  # what `dataclass` writes itself
        yield f"{where}: no docstring"
    fields = field_annotations(cls)
    yield from judged(where, entries(parts.get("Attributes", "")), fields)
    for name, member in vars(cls).items():
        if name.startswith("_") or name in fields:
            continue
        place = f"{where}.{name}"
        if isinstance(member, property | cached_property):
            getter = member.fget if isinstance(member, property) else member.func
            text = inspect.cleandoc(getter.__doc__ or "")
            problem = lacking(str(inspect.signature(getter).return_annotation), text) if text else "no docstring"
            if problem:
                yield f"{place}: {problem}"
        elif isinstance(member, classmethod | staticmethod | FunctionType):
            function = member if isinstance(member, FunctionType) else member.__func__
            yield from judged_function(place, function)
    if issubclass(cls, Enum):
        yield from (f"{where}: {member.value} is not explained" for member in cls if not getattr(member, "advice", ""))


def own_classes(annotation: Any) -> Iterator[type]:
    """Yield the package's classes in a resolved annotation."""
    if isinstance(annotation, type) and annotation.__module__.startswith("softnlp"):
        yield annotation
    for argument in typing.get_args(annotation):
        yield from own_classes(argument)


def hints(thing: Any) -> dict[str, Any]:
    """Return resolved annotations; none where they name what is only imported for type checkers."""
    try:
        return typing.get_type_hints(thing)
    except NameError:
        return {}


def reachable() -> dict[str, type]:
    """Return the public classes, and those of the package that public functions and fields hand out."""
    public = [getattr(softnlp, name) for name in softnlp.__all__]
    pending = [thing for thing in public if isinstance(thing, type)]
    for thing in public:
        if isinstance(thing, FunctionType):
            pending += own_classes(hints(thing).get("return"))
    found: dict[str, type] = {}
    while pending:
        cls = pending.pop()
        if cls.__name__ in found or cls.__name__ in INNER:
            continue
        found[cls.__name__] = cls
        pending += [c for name in field_annotations(cls) for c in own_classes(hints(cls).get(name))]
    return found


CLASSES = reachable()
FUNCTIONS = [name for name in softnlp.__all__ if isinstance(getattr(softnlp, name), FunctionType)]
CONSTANTS = [name for name in softnlp.__all__ if name not in FUNCTIONS and name not in CLASSES and name[0] != "_"]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_says_what_it_takes_and_returns(name: str) -> None:
    assert not list(judged_function(name, getattr(softnlp, name)))


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_a_class_says_what_it_holds(name: str) -> None:
    assert not list(judged_class(CLASSES[name]))


@pytest.mark.parametrize("name", CONSTANTS)
def test_a_constant_is_followed_by_what_it_is(name: str) -> None:
    # read from the source: the value itself has only the docstring of its type
    source = inspect.getsource(__import__(f"softnlp.{softnlp._HOME_OF[name]}", fromlist=["x"]))
    body = ast.parse(source).body
    for statement, following in pairwise(body):
        targets = statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", None)]
        if any(isinstance(target, ast.Name) and target.id == name for target in targets):
            assert isinstance(following, ast.Expr), f"{name} has no text behind it"
            assert isinstance(following.value, ast.Constant)
            text = str(following.value.value)
            assert not isinstance(getattr(softnlp, name), float) or UNIT.search(text), text
            return
    pytest.fail(f"{name} is assigned nowhere")


def test_nothing_public_is_left_out() -> None:
    assert {*FUNCTIONS, *CONSTANTS, *CLASSES, "__version__"} >= set(softnlp.__all__)
    assert {"Pose", "Sensitivities", "Ellipsoid", "Scenario"} <= set(CLASSES)


def test_the_rules_find_what_is_wrong() -> None:
    def bad(pressure: Any, length: float, note: str) -> float:
        """Return nothing good.

        Parameters
        ----------
        pressure
            In each set [Pa].
        width : float
            Of the robot.
        note
            As `softnlp.forward`.
        """
        return length

    found = "\n".join(judged_function("bad", bad))
    for part in ("['length']", "['width']", "no shape", "which says nothing of it", "no Returns"):
        assert part in found, part

    @dataclasses.dataclass
    class Held:
        """Hold.

        Attributes
        ----------
        force : float
            How hard it pulls.
        """

        force: float

        @property
        def twice(self) -> float:
            return 2 * self.force

    found = "\n".join(judged_class(Held))
    assert "force has no unit" in found
    assert "Held.twice: no docstring" in found
