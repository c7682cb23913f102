"""How hypothesis searches where only the first failure counts."""

from hypothesis import Phase, settings

# For `mutmut` (docs/mutation.md): always the same examples, and no time spent on making a failure small.
settings.register_profile("mutation", derandomize=True, database=None, phases=(Phase.explicit, Phase.generate))
