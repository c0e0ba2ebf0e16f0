"""What ``hwsim`` may say on standard error of a command that goes well."""

import re


def only_news(error):
    """Whether there is nothing but what begins now."""
    return all(
        re.fullmatch(r"hwsim: (planning|running \d+ \w+( twice)?|planning and running .*) \.\.\.", s) for s in error.splitlines()
    )


class OutcomeAlone:
    """A log of which a report sees the outcome."""

    def __init__(self, outcome):
        self.outcome = outcome

    def __len__(self):
        return self.outcome.sizes["part"]
