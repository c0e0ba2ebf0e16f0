"""The table of a reproduction: what is printed, what is correct, what comes out here, and what that makes of
what is printed.
"""


class Published:
    """Rows of a table; a row that does not come out as it should stops the page."""

    def __init__(self):
        self.rows = []

    def row(self, what, published, correct, ours, tolerance=0.0, why="", within=None):
        """One line: what is printed (a text, with its digits; "=" for an exact claim), what is correct, what
        comes out here.

        `within`: where a single random run, or a reading, may lie.
        """
        if isinstance(ours, str):
            assert ours == correct, f"{what}: {ours} for {correct}"
        else:
            assert abs(ours - correct) <= tolerance, f"{what}: {ours} for {correct}"
        self.rows.append(
            (what, published, shown(correct), shown(ours), verdict(what, published, ours, why, within))
        )

    def missing(self, what, published, why):
        """What the source does not give the inputs of."""
        self.rows.append((what, published, "-", "-", f"cannot be reproduced: {why}"))

    def beyond(self, what, published, correct, ours, tolerance, why):
        """What the printed inputs do not give: ours is held to what is correct, the printed number stands
        beside it.
        """
        assert abs(ours - correct) <= tolerance, f"{what}: {ours} for {correct}"
        self.rows.append((what, published, shown(correct), shown(ours), f"cannot be reproduced: {why}"))

    def show(self):
        """Print the table."""
        heads = ("", "published", "correct", "ours", "")
        width = [max(len(row[k]) for row in (heads, *self.rows)) for k in range(5)]
        for row in (heads, *self.rows):
            print("   ".join(text.ljust(w) for text, w in zip(row, width, strict=True)).rstrip())


def verdict(what, published, ours, why, within):
    """What our number makes of the printed one."""
    if published == "-":
        return "ours"
    if within is not None and within[0] <= float(published) <= within[1]:
        return f"agrees: {within[0]:.4g} to {within[1]:.4g} is to be expected"
    if within is None and agrees(published, ours):
        return "reproduced"
    assert why, f"{what}: {published} is not {ours}"
    return f"printed value wrong: {why}"


def agrees(published, ours):
    """Whether a number is what was printed, to the last digit."""
    if isinstance(ours, str) or published == "empty":
        return published == ours
    digits = 9 if published[0] == "=" else len(published.partition(".")[2])
    return abs(float(published.strip("= ")) - ours) <= 0.5001 * 10.0**-digits


def shown(value):
    """A number as it stands in the table."""
    if isinstance(value, complex):
        return f"{value.real:.2f}±{abs(value.imag):.2f}j"
    return value if isinstance(value, str) else f"{round(value, 12):.6g}"
