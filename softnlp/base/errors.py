"""What can go wrong before a solve starts, as exceptions a caller can name.

A solve that fails is not an exception: it is a step with a named `softnlp.base.status.Status`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from difflib import get_close_matches

_MOST_LISTED = 50  # names in one message


class SoftnlpError(Exception):
    """Base of every error this package raises on purpose."""


class InputError(SoftnlpError, ValueError):
    """A value from a person or a file is missing, of the wrong type, or impossible.

    The text is one line. `source` (a file), `table` and `key` say where, as far as they are known;
    `located` adds them where the error passes a place that knows. `every` are all mistakes, this one first, where
    there are several.
    """

    def __init__(
        self,
        message: str,
        *,
        source: str | None = None,
        table: str | None = None,
        key: str | None = None,
        every: Sequence[InputError] = (),
    ) -> None:
        self.message = " ".join(message.split())
        self.source = source
        self.table = table
        self.key = key
        self.every = tuple(every)
        super().__init__(self.__str__())

    def located(self, *, source: str | None = None, table: str | None = None, key: str | None = None) -> InputError:
        """Return the same error with the places that it did not yet know filled in.

        Parameters
        ----------
        source, table, key
            The file, the table in it and the key in that; None leaves one as it is.

        Returns
        -------
        InputError
            Of the same class and with the same message.
        """
        return type(self)(
            self.message,
            source=self.source or source,
            table=self.table or table,
            key=self.key or key,
            every=[one.located(source=source, table=table, key=key) for one in self.every],
        )

    def __str__(self) -> str:
        where = " ".join(part for part in (f"[{self.table}]" if self.table else "", self.key or "") if part)
        return ": ".join(part for part in (self.source, where, self.message) if part)


class RobotError(InputError):
    """The dimensions describe a robot that cannot be made; the text names the rule and its numbers."""


class MaterialError(InputError):
    """A material, a law or one of its constants is unknown or impossible."""


class IllPosedError(SoftnlpError, ValueError):
    """The free quantities and the equations do not determine each other; the text names them."""


def first_of(errors: Sequence[InputError], how: str = "") -> InputError:
    """Return the first of some errors, which says how many more there are and has them all; how : to see them."""
    every = [one for error in errors for one in (error.every or (error,))]
    first, more = every[0], len(every) - 1
    if not more:
        return first
    message = f"{first.message} (and {more} more{how})"
    return type(first)(message, source=first.source, table=first.table, key=first.key, every=every)


def nearest(word: str, known: Iterable[str]) -> str:
    """Return "; did you mean 'x'?" for the nearest known word, or "; known: a, b" when none is near."""
    names = list(known)
    close = get_close_matches(word, names, n=1, cutoff=0.5)
    if close:
        return f"; did you mean '{close[0]}'?"
    return f"; known: {listed(names)}" if names else ""


def listed(names: Iterable[str]) -> str:
    """Return names with commas between them; of very many the first ones and how many more there are."""
    every = list(names)
    more = len(every) - _MOST_LISTED
    return ", ".join(every) if more <= 0 else f"{', '.join(every[:_MOST_LISTED])} and {more} more"


@contextmanager
def located(*, source: str | None = None, table: str | None = None) -> Iterator[None]:
    """Fill the places in that an `InputError` from within does not know, see `InputError.located`."""
    try:
        yield
    except InputError as error:
        raise error.located(source=source, table=table) from None


@contextmanager
def reworded(words: Mapping[str, str]) -> Iterator[None]:
    """Say what an error from within advises, and its key, as another interface does: options in place of arguments."""

    def told(text: str) -> str:
        for here, there in words.items():
            text = text.replace(here, there)
        return text

    try:
        yield
    except InputError as error:
        key = None if error.key is None else words.get(f"{error.key}=", error.key)
        raise type(error)(told(error.message), source=error.source, table=error.table, key=key) from None
    except SoftnlpError as error:
        raise type(error)(told(str(error))) from error.__cause__


@contextmanager
def of_table(table: str) -> Iterator[None]:
    """Place an `InputError` from within in a table; one that names another file is quoted at the key for that file."""
    try:
        yield
    except InputError as error:
        if error.source is None:
            raise error.located(table=table) from None
        raise type(error)(str(error), table=table, key="file") from None
