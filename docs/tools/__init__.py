"""How the site is made: figures, tables and notebooks computed by the code, links, formulas."""
