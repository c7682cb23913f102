"""Formulas of a page as MathML, made when the site is built: browsers draw it without a script or a font of ours."""

from __future__ import annotations

import html
import re

from latex2mathml.converter import convert

_FORMULA = re.compile(r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<tex>.*?)\\[)\]]</(?P=tag)>', re.DOTALL)
_NUMBER = re.compile(r"\\tag\{([^}]*)\}")
_UNKNOWN = re.compile(r"<mi>\\|<mo>\\|<mtext>\\|<mi>&</mi>")


def converted(page: str, uri: str) -> str:
    """Return the HTML of a page with its formulas converted.

    Raises
    ------
    ValueError
        For a formula that is not understood, with the page.
    """

    def replace(match: re.Match[str]) -> str:
        tex = html.unescape(match["tex"]).strip()
        is_block = match["tag"] == "div"
        number = _NUMBER.search(tex)
        made = convert(_NUMBER.sub("", tex).strip(), display="block" if is_block else "inline")
        if _UNKNOWN.search(made):
            raise ValueError(f"{uri}: formula not understood: {tex}")
        if not is_block:
            return made
        label = f'<span class="equation-number">({number[1]})</span>' if number else ""
        return f'<div class="equation">{made}{label}</div>'

    return _FORMULA.sub(replace, page)
