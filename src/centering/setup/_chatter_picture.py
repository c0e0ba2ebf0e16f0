"""Picture of a chatter check: the spectrum with its bands, and the free rotations of the work."""

from typing import TYPE_CHECKING, Any

from sdpgrind.base import pictures

if TYPE_CHECKING:
    from centering.setup._chatter import ChatterCheck

QUIET, MET, FREE = pictures.TRACKED, pictures.ALARM, "#5a9a68"
RPM = 9.549296585513721  # derived: 30/pi, rev/min for 1 rad/s


def plot(check: "ChatterCheck") -> Any:
    """Figure of a chatter check; see `ChatterCheck.plot`."""
    figure, (top, low) = pictures.subplots(2, 1, (8, 4.8), height_ratios=(3, 1))
    _spectrum(top, check)
    _speeds(low, check)
    figure.suptitle(_told(check), fontsize=10)
    return figure


def _spectrum(ax: Any, check: "ChatterCheck") -> None:
    """Bars of all undulations; those in a band in colour, with its cause."""
    met = {band.upr: band for band in reversed(check.found)}
    for upr, size in zip(check.upr.tolist(), check.amplitude.tolist(), strict=True):
        ax.vlines(upr, 0, 1e3 * size, color=MET if upr in met else QUIET, lw=2.0)
        if upr in met:
            name = f"{met[upr].cause} {met[upr].order or ''}".strip()
            ax.annotate(
                f"{upr:g} upr: {name}",
                (upr, 1e3 * size),
                (0, 3),
                textcoords="offset points",
                ha="center",
                fontsize=8,
            )
    ax.set_xlim(0, 1.05 * max(check.upr.max(initial=1.0), 1.0))
    ax.set(xlabel="undulations per revolution [upr]", ylabel="amplitude [µm]")
    ax.set_ylim(0, 1.15e3 * max(check.amplitude.max(initial=0.0), 1e-6))


def _speeds(ax: Any, check: "ChatterCheck") -> None:
    """Rotations of the work: free, in a band, and the requested one."""
    for k, (low, high) in enumerate(check.free):
        ax.axvspan(RPM * low, RPM * high, color=FREE, alpha=0.45, lw=0, label=None if k else "free")
    for k, band in enumerate(check.bands):
        ax.axvspan(
            RPM * band.low,
            RPM * band.high,
            color=MET,
            alpha=0.2,
            lw=0,
            label=None if k else "met, by so many upr",
        )
        if check.speeds[0] < band.center < check.speeds[1]:
            ax.annotate(f"{band.upr:g}", (RPM * band.center, 0.5), ha="center", va="center", fontsize=8)
    ax.axvline(RPM * check.work_rotation, color="k", lw=1.5, label="asked for")
    ax.set(xlabel="rotation of the work [rev/min]", yticks=[], xlim=[RPM * speed for speed in check.speeds])
    ax.legend(
        loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False, fontsize=8, borderaxespad=0.1
    )


def _told(check: "ChatterCheck") -> str:
    if check.ok:
        return "nothing is met"
    away = " or ".join(f"{RPM * speed:.4g}" for speed in check.nearest)
    return f"{len(check.found)} met; " + (f"free: {away} rev/min" if away else "no rotation in reach is free")
