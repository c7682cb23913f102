"""What decides how a file is read: settings that a person gave, and guesses that carry their reasons."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from softnlp.base.errors import InputError, nearest
from softnlp.base.reading import shown

_PREFIX = "registration."


class AskError(InputError):
    """A file can be read in more than one way, or lacks a number; the text shows the readings and what settles them."""


class NoHeaderError(AskError):
    """Nothing names the columns of a file."""


class NamedError(InputError):
    """A file is of a kind that is no table of measurements, which the text names."""


@dataclass(frozen=True)
class Guess:
    """A setting that nobody gave. key, value : as `--set` takes them. reason : why it is likely."""

    key: str
    value: Any
    reason: str


@dataclass(eq=False)
class Choices:
    """The settings of one import.

    given : by dotted key. used : every setting that decided something, given or guessed, in the order of use.
    guesses : those that were not given. dropped : rows left out, by reason. varying : keys that were guessed to be one
    thing of one file and another of the next. against : settings that a file itself contradicts, with what to say.
    decisive : those that all the same decided something else. notes : what else was done, in words.
    read : the columns that were used, by file and name.
    """

    given: Mapping[str, Any]
    used: dict[str, Any] = field(default_factory=dict)
    guesses: list[Guess] = field(default_factory=list)
    dropped: dict[str, int] = field(default_factory=dict)
    varying: set[str] = field(default_factory=set)
    against: dict[str, str] = field(default_factory=dict)
    decisive: set[str] = field(default_factory=set)
    notes: list[str] = field(default_factory=list)
    read: set[tuple[str, str]] = field(default_factory=set)
    _known: set[str] = field(default_factory=set)

    def get(self, key: str, default: Any = None) -> Any:
        """Return a setting that may be left out."""
        self._known.add(key)
        value = self.given.get(key)
        if value is None:
            return default
        self.used[key] = value
        return value

    def number(self, key: str, low: float = 0.0, high: float = float("inf")) -> float | None:
        """Return a setting that is a number above `low`, None where it is left out; raises `InputError` for others."""
        value = self.get(key)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int | float) or not low < value < high:
            raise InputError(f"expected a number above {low:g} and below {high:g}, got {shown(value)}", key=key)
        return float(value)

    def numbers(self, key: str, count: int) -> list[float] | None:
        """Return a setting that is a list of numbers, None where it is left out; raises `InputError` for others."""
        value = self.get(key)
        if value is None:
            return None
        fits = isinstance(value, list) and len(value) == count
        if not fits or any(isinstance(v, bool) or not isinstance(v, int | float) for v in value):
            raise InputError(f"expected a list of {count} numbers, got {shown(value)}", key=key)
        return [float(v) for v in value]

    def one_of(self, key: str, known: Iterable[str], default: str) -> str:
        """Return a setting that is one of some words; raises `InputError` for another."""
        value, words = self.get(key, default), list(known)
        if value not in words:
            hint = nearest(str(value), words)
            raise InputError(f"expected {' or '.join(map(repr, words))}, got {shown(value)}{hint}", key=key)
        return str(value)

    def take(self, key: str, guess: Any, reason: str) -> Any:
        """Return a setting, or the guess in its place, which is then kept with its reason."""
        value = self.get(key)
        if value is None:
            value = guess
            self.note(key, guess)
            if not any(known.key == key and known.value == guess for known in self.guesses):
                self.guesses.append(Guess(key, guess, reason))
        return value

    def note(self, key: str, value: Any) -> None:
        """Keep what was decided; what differs from file to file is decided again by a repeated import."""
        if key in self.used and self.used[key] != value:
            self.varying.add(key)
        self.used[key] = value

    def drop(self, count: int, reason: str) -> None:
        """Count rows that are left out."""
        if count:
            self.dropped[reason] = self.dropped.get(reason, 0) + int(count)

    def say(self, note: str) -> None:
        """Keep what was done beside, once."""
        if note not in self.notes:
            self.notes.append(note)

    def require_used(self) -> None:
        """Raise `InputError` for a setting that nothing asked for, and one that only contradicts a file."""
        for key in self.given:
            if key not in self._known:
                raise InputError(f"this setting is not used here{nearest(key, self._known)}", key=key)
            if key in self.against and key not in self.decisive:
                raise InputError(self.against[key], key=key)


def settings_from_words(words: Iterable[str]) -> dict[str, Any]:
    """Return settings from "key=value" words; a value is TOML, or else the text that stands there.

    Raises
    ------
    InputError
        For a word without "=".
    """
    found: dict[str, Any] = {}
    for word in words:
        key, equals, text = word.partition("=")
        if not equals or not key.strip():
            raise InputError(f"expected key=value, got {shown(word)}", key="--set")
        try:
            value = tomllib.loads(f"value = {text}")["value"]
        except (tomllib.TOMLDecodeError, KeyError):
            value = text.strip()
        if isinstance(value, bool):  # no setting is yes or no, but a stress may be the true one
            value = text.strip()
        found[key.strip().removeprefix(_PREFIX)] = value
    return found


def flat(tables: Mapping[str, Any], head: str = "") -> dict[str, Any]:
    """Return tables within tables as one with dotted keys; those of [registration] stand at the top."""
    found: dict[str, Any] = {}
    for key, value in tables.items():
        name = f"{head}{key}"
        if isinstance(value, Mapping):
            found |= flat(value, "" if name == _PREFIX[:-1] else f"{name}.")
        else:
            found[name] = value
    return found
