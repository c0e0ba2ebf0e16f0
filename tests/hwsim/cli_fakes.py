"""What ``hwsim`` may say on standard error of a command that goes well."""

import re

NEWS = re.compile(
    r"hwsim: about .*\(times of the example\)\n|hwsim: (planning|running \d+ \w+( twice)?|planning and running .*) \.\.\.\n"
)


def only_news(error):
    """Whether there is nothing but what begins now."""
    return without_news(error) == ""


def without_news(error):
    """What was said of it afterwards."""
    return NEWS.sub("", error)


class OutcomeAlone:
    """A log of which a report sees the outcome."""

    def __init__(self, outcome):
        self.outcome = outcome

    def __len__(self):
        return self.outcome.sizes["part"]
