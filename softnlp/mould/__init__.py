"""Moulds from the model: what a maker prints, pours and draws to get the body that was computed."""

from softnlp.mould.assembly import Moulds, SegmentMould, moulds
from softnlp.mould.bill import bill
from softnlp.mould.checks import Check, checks_of
from softnlp.mould.files import mould_files
from softnlp.mould.parts import Part
from softnlp.scenario.mould import MouldTable

__all__ = ["Check", "MouldTable", "Moulds", "Part", "SegmentMould", "bill", "checks_of", "mould_files", "moulds"]
