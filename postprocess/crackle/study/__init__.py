"""Many runs together: ensembles, every fit made once, tables, the paper's values."""
from crackle.study.ensembles import Ensemble, Missing, Study, read_study

__all__ = ["Ensemble", "Missing", "Study", "read_study"]
