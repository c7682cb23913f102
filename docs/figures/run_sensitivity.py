"""What moves the tip of a loaded robot."""

from docs.figures._shared import as_shown

text, figure = as_shown(
    "softnlp sensitivity scenarios/D25L60_loaded_tip.toml --step 3 --tolerance length_mm=0.2 C01_MPa=3%",
    drawn="results/D25L60_loaded_tip/sensitivity.png",
)
