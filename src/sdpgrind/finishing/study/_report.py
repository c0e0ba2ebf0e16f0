"""Text report of a study."""

from sdpgrind.base.brief import counted
from sdpgrind.base.rng import Seed
from sdpgrind.finishing.study._anova import AnovaTable, anova
from sdpgrind.finishing.study._best import best
from sdpgrind.finishing.study._means import level_means
from sdpgrind.finishing.study._next_runs import next_runs
from sdpgrind.finishing.study._observations import Observations, present
from sdpgrind.finishing.study._power import power
from sdpgrind.finishing.study._prediction import predict
from sdpgrind.finishing.study._ratios import RATIOS
from sdpgrind.finishing.study._texts import aligned, amount, labelled, level


def report(study: Observations, rng: Seed) -> str:
    """Text of a study; see `Study.report`."""
    whole = anova(study, None)
    judged = whole.error.ms is not None
    pool = "F<1" if judged else None
    parts = [_head(study), _runs(study), _what_the_ratio_says(study), _hidden(study)]
    parts += [f"Analysis of variance\n{anova(study, pool)!r}", _findings(whole, judged)]
    parts += [f"Mean ratio at each level\n{level_means(study, 0.95)!r}"]
    if study.ratio != "none":
        parts += _what_to_do(study, pool, judged)
    if judged:
        parts += [f"A repetition of the study\n{power(study, rng, 2000, None, pool, 0.05)!r}"]
    if judged and study.ratio != "none" and not study.interactions:
        parts += [f"Further runs worth making\n{next_runs(study, 3, pool)!r}"]
    return "\n\n".join(part for part in parts if part)


def _head(study: Observations) -> str:
    count = study.readings.shape[1]
    where = "of any kind" if study.confounding is None else f"in the {study.array.name}"
    text = f"{study.name}: {study.runs} runs {where}, {counted(count, 'reading')} each"
    return f"{text}; missing: {', '.join(map(str, study.missing))}" if study.missing else text


def _runs(study: Observations) -> str:
    ratio = [format(x, ".3f") for x in study.sn_ratio]
    names = [labelled(name, study.units.get(name, "")) for name in study.factors]
    heads = ("run", *names, "mean reading", RATIOS[study.ratio].unit or "ratio")
    settings = {name: values.tolist() for name, values in study.settings.items()}
    rows, kept, there = [], iter(ratio), present(study)
    for k in range(study.runs):
        values = [level(settings[name][k]) for name in study.factors]
        read = (
            (amount(float(study.readings[k].mean()), study.unit), next(kept)) if there[k] else ("missing", "")
        )
        rows.append((str(k + 1), *values, *read))
    return aligned(heads, rows)


def _what_the_ratio_says(study: Observations) -> str:
    if study.ratio == "none":
        return ""
    reference = (
        f"; 0 dB is {amount(study.reference, study.unit)}" if study.ratio in ("smaller", "larger") else ""
    )
    text = f"Ratio: {study.ratio}{reference}."
    if study.readings.shape[1] == 1:
        text += (
            " Of a single reading the ratio is the reading itself on another scale:"
            " it carries no information on noise."
        )
    return text


def _hidden(study: Observations) -> str:
    found = study.confounding
    if found is None or study.interactions:
        return ""
    if found.whole:
        hidden = "; ".join(f"{c} or {a} x {b}" for a, b, c in found.whole)
        return f"Interactions of two factors that no reading tells from a main effect: {hidden}."
    if found.clear:
        return "No interaction of two factors falls on a main effect."
    return (
        "Interactions of two factors, if there are any, fall in part on main effects; none hides one whole."
    )


def _findings(table: AnovaTable, judged: bool) -> str:
    if not judged:
        return f"Significance is not available: {table.error.note}."
    seen = table.significant()
    unseen = [row.source for row in table.effects if row.source not in seen]
    text = f"Significant at 5 %: {', '.join(seen) or 'nothing'}."
    return f"{text} Not seen: {', '.join(unseen)}." if unseen else text


def _what_to_do(study: Observations, pool: str | None, judged: bool) -> list[str]:
    found = best(study, None, 0.05)
    kept = best(study, "F<1", 0.05) if judged and pool else found
    parts = [f"Best levels\n{found!r}", f"To be expected there\n{predict(study, kept, 1, 0.95)!r}"]
    single = study.sn_ratio.max()
    values = {
        name: column[present(study)].tolist()[int(study.sn_ratio.argmax())]
        for name, column in study.settings.items()
    }
    where = ", ".join(f"{name} {level(value)}" for name, value in values.items())
    return [*parts, f"Best single run: {where} with {single:.3f} {RATIOS[study.ratio].unit}"]
