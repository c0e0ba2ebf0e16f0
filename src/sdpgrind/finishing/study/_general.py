"""General linear model of runs without an orthogonal array, by statsmodels."""

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.extras import need
from sdpgrind.finishing.study._linear_model import LinearModel, Term


def type_two(model: LinearModel, y: Floats) -> Floats:
    """Sum of squares of type II of each term: its addition to all terms that do not contain it."""
    frames, formulas = need("pandas", "statsmodels"), need("statsmodels.formula.api", "statsmodels")
    tables = need("statsmodels.stats.anova", "statsmodels")
    if not model.terms:
        return np.zeros(0)
    scale = float(np.max(np.abs(y - y.mean()))) or 1.0
    # numbered: names of users may clash with those of the formula language (C, I, Q)
    data = {f"f{k}": model.codes[:, k] for k in range(model.codes.shape[1])} | {"y": (y - y.mean()) / scale}
    fit = formulas.ols("y ~ " + " + ".join(map(_formula, model.terms)), frames.DataFrame(data)).fit()
    found = tables.anova_lm(fit, typ=2)
    return np.array([found.loc[_formula(term), "sum_sq"] for term in model.terms]) * scale**2


def _formula(term: Term) -> str:
    return ":".join(f"C(f{k}, Sum)" for k in term)
